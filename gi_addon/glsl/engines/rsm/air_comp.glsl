// Light that the air scatters onto surfaces: points on the lights' rays as virtual lights (single scattering; A. Keller's
// "Instant Radiosity", SIGGRAPH 1997, in a medium, as T. Engelhardt, J. Novák and C. Dachsbacher have it, "Approximate Bias
// Compensation for Rendering Scenes with Heterogeneous Participating Media", Pacific Graphics 2012).
//
// A ray leaves its light evenly over one of its maps and ends where that shows a surface. On it a point is drawn by
// transmittance, pdf σ e^(−σ s) / (1 − e^(−σ S)), and scatters the flux Φ T σs / pdf, W.

#include "engines/rsm/rsm_lib.glsl"
#include "lib/view_lib.glsl"
#include "lib/sequence_lib.glsl"

layout(local_size_x = 64) in;

void main()
{
    int i = int(gl_GlobalInvocationID.x);
    if (i >= point_count) {
        return;
    }
    Vpl vpl;
    vpl.position_ws = vec3(0.0);
    vpl.area = 0.0;
    vpl.normal_ws = vec3(0.0, 0.0, 1.0);
    vpl.light = VPL_AIR;
    vpl.flux = vec3(0.0);
    vpl.anisotropy = 0.0;
#if HAS_MEDIUM
    uint index = view.subframe * uint(point_count) + uint(i);
    vec2 xy = sobol_2d(index, 33u) * 2.0 - 1.0;
    vec2 u = sobol_2d(index, 34u);
    float drawn = u.y * float(view_count * MEDIA);
    LightView v = rsm_views[min(int(drawn) / MEDIA, view_count - 1)];
    int k = int(drawn) % MEDIA;
    Light light = rsm_lights[v.light];
    float shown = texelFetch(rsm_depth, ivec2(v.rect.xy + (xy / v.guard * 0.5 + 0.5) * v.rect.zw), 0).r;
    vec3 origin_ws = light_view_position(v, xy, 0.0);
    vec3 along = v.perspective > 0.5 ? light_view_position(v, xy, 1.0) - origin_ws : v.axis_z;
    float scale = length(along);
    vec3 direction = along / scale;
    vec2 span = medium_span(k, origin_ws, direction);
    span = vec2(max(span.x, 0.0), min(span.y, shown > 0.0 ? shown * scale : 1e30));
    if (span.y > span.x) {
        float sigma = max(vector_mean(medium_extinction[k].rgb), 1e-12);
        float passed = 1.0 - exp(-sigma * (span.y - span.x));
        float rest = max(1.0 - u.x * passed, 1e-7);
        float s = span.x - log(rest) / sigma;
        float weight = passed / (sigma * rest) * float(view_count * MEDIA) / float(point_count); // m
        float beam;
        vec3 flux = light_view_flux(v, light, xy, vec2(2.0), s / scale, beam);
        vpl.position_ws = origin_ws + direction * s;
        vpl.normal_ws = direction;
        vpl.anisotropy = medium_scattering[k].w;
        flux *= medium_transmittance(vpl.position_ws, -direction, v.perspective > 0.5 ? s : 1e30);
        vpl.flux = light.diffuse * flux * medium_scattering[k].rgb * weight;
        // The ball that a point stands for among those of all sub-frames, by its section: nearer it is no point.
        vpl.area = PI * pow(0.2387324 * beam * weight / float(view.subframes), 2.0 / 3.0); // 3/4π
    }
#endif
    vpl.key = 0u;
    vpl.clear_ws = vpl.position_ws;
    vpls[vpl_count + i] = vpl;
}
