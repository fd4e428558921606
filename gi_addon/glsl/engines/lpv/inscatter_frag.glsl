// Light of the volume that the air scatters to the eye: L = ∫ T(eye, t) σs ∫ p(ω·v) L(ω) dω dt along the pixel's ray, at the points
// that single scattering (passes/volumetric_frag.glsl) takes for parallel light, ∝ T of its medium.
//
// The volume's harmonics are of radiance by direction of travel, and Henyey and Greenstein's phase function scales those of order
// l by g^l: the inner integral is Σ g^l L_lm Y_lm(v), v from the point to the eye. Orders above 2 are left out, g³ and less.

#include "lib/view_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "lib/medium_lib.glsl"
#include "engines/lpv/lookup_lib.glsl"

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 uv = gl_FragCoord.xy * view.inverse_resolution;
    float depth = 0.0;
#if HAS_GBUF_DEPTH
    depth = texelFetch(gbuf_depth, pixel, 0).r;
#endif
    EyeRay ray = eye_ray(uv, depth);
    vec3 direction = ray.direction;
    vec3 origin_ws = ray.origin_ws;
    use_grid(0);
    // What light there is outside of the scene's grid it does not know.
    vec2 known = box_span((origin_ws - grid_origin) / grid_cell, direction / grid_cell, vec3(0.0), vec3(grid_size));
    known = vec2(max(known.x, 0.0), min(known.y, ray.end));
    float offset = fract(step_turn + unit_float(hash_u32(uvec2(pixel + view.pixel_offset))));
    vec3 sum = vec3(0.0);
    for (int k = 0; k < MEDIA; ++k) {
        vec2 span = medium_span(k, origin_ws, direction);
        span = vec2(max(span.x, known.x), min(span.y, known.y));
        if (span.y <= span.x || max3(medium_scattering[k].rgb) <= 0.0) {
            continue;
        }
        float phase[SH_COUNT];
        sh_basis(-direction, phase);
        for (int c = 0; c < SH_COUNT; ++c) {
            phase[c] *= phase_share(c, medium_scattering[k].w);
        }
        float sigma = max(vector_mean(medium_extinction[k].rgb), 1e-12);
        float passed = 1.0 - exp(-sigma * (span.y - span.x));
        for (int i = 0; i < step_count; ++i) {
            float rest = max(1.0 - (float(i) + offset) / float(step_count) * passed, 1e-7);
            float t = span.x - log(rest) / sigma;
            vec3 left = medium_transmittance(origin_ws, direction, t) * (passed / (sigma * rest * float(step_count)));
            sum += left * medium_scattering[k].rgb * volume_along(origin_ws + direction * t, phase);
        }
    }
    volume_indirect = vec4(sum, 1.0);
}
