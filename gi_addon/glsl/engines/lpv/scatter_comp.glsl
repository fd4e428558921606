// Light that the air scatters out of the lamps' rays, into the cells where it does: the in-scattering volume's sources (M. Billeter,
// E. Sintorn and U. Assarsson, "Real-Time Multiple Scattering using Light Propagation Volumes", I3D 2012).
//
// A texel of a light's map is a ray that ends where that shows a surface, or the grid does. On it points are drawn by
// transmittance, one in each of AIR_POINTS strata, pdf σ e^(−σ s) / (1 − e^(−σ S)), and scatter the flux Φ T σs / pdf, W, as
// intensity Φ p(cosθ): in harmonics Φ g^l Y_lm, Henyey and Greenstein's phase function being Σ g^l (2l + 1)/(4π) P_l.

#include "engines/rsm/rsm_lib.glsl"
#include "engines/lpv/lpv_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "lib/view_lib.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

const int AIR_POINTS = 4;

void main()
{
    vec4 rect = rsm_views[tile].rect;
    if (any(greaterThanEqual(vec2(gl_GlobalInvocationID.xy), rect.zw))) {
        return;
    }
    ivec2 pixel = ivec2(rect.xy) + ivec2(gl_GlobalInvocationID.xy);
    LightView v = rsm_views[tile];
    Light light = rsm_lights[v.light];
    vec2 xy, low, high;
    if (!rsm_texel_span(v, pixel, xy, low, high)) {
        return;
    }
    float shown = texelFetch(rsm_depth, pixel, 0).r;
    vec3 origin_ws = light_view_position(v, xy, 0.0);
    vec3 along = v.perspective > 0.5 ? light_view_position(v, xy, 1.0) - origin_ws : v.axis_z;
    float scale = length(along);
    vec3 direction = along / scale;
    vec2 inside = box_span((origin_ws - grid_origin) / grid_cell, direction / grid_cell, vec3(0.0), vec3(grid_size));
    inside = vec2(max(inside.x, 0.0), min(inside.y, shown > 0.0 ? shown * scale : 1e30));
    float y[SH_COUNT];
    sh_basis(direction, y);
    uint seed = hash_u32(uvec3(pixel, view.subframe));
    for (int k = 0; k < MEDIA; ++k) {
        vec2 span = medium_span(k, origin_ws, direction);
        span = vec2(max(span.x, inside.x), min(span.y, inside.y));
        if (span.y <= span.x || max3(medium_scattering[k].rgb) <= 0.0) {
            continue;
        }
        float sigma = max(vector_mean(medium_extinction[k].rgb), 1e-12);
        float passed = 1.0 - exp(-sigma * (span.y - span.x));
        for (int i = 0; i < AIR_POINTS; ++i) {
            seed = hash_u32(seed);
            float rest = max(1.0 - (float(i) + unit_float(seed)) / float(AIR_POINTS) * passed, 1e-7);
            float s = span.x - log(rest) / sigma;
            vec3 position_ws = origin_ws + direction * s;
            ivec3 cell = ivec3(floor((position_ws - grid_origin) / grid_cell));
            if (!inside_grid(cell, grid_size)) {
                continue;
            }
            float beam;
            vec3 flux = light_view_flux(v, light, 0.5 * (low + high), high - low, s / scale, beam);
            flux *= medium_transmittance(position_ws, -direction, v.perspective > 0.5 ? s : 1e30);
            flux *= medium_scattering[k].rgb * (passed / (sigma * rest * float(AIR_POINTS)));
            int base = cell_index(cell, grid_size) * SH_COUNT * 3;
            seed = hash_u32(seed);
            float dither = unit_float(seed);
            for (int c = 0; c < SH_COUNT; ++c) {
                vec3 units = floor(flux * (phase_share(c, medium_scattering[k].w) * y[c] * fixed_scale) + dither);
                for (int channel = 0; channel < 3; ++channel) {
                    if (units[channel] != 0.0) {
                        atomicAdd(lpv_flux[base + c * 3 + channel], int(units[channel]));
                    }
                }
            }
        }
    }
}
