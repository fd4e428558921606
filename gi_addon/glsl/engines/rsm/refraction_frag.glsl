// What refracting surfaces show: a ray refracted where it enters and where it leaves, then cast in the RSMs (the paper's
// §IV-B, with both interfaces).

#include "lib/view_lib.glsl"
#include "lib/bsdf_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "lib/refraction_lib.glsl"
#define RAY_SEES_EMISSION 1
#include "engines/rsm/raycast_lib.glsl"
#if RAY_BOUNCES && !HAS_VPLS
// E/π at a point on the side of normals `ng` and `n`, seen from `eye`: of who has no virtual lights.
vec3 far_side_light(vec3 position_ws, vec3 ng, vec3 n, vec3 eye);
#endif

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float depth = texelFetch(translucent_depth, pixel, 0).r;
    transmission_indirect = vec4(0.0);
    if (depth <= 0.0) {
        return;
    }
    if (texelFetch(translucent_medium, pixel, 0).g > 0.5) {
        // What scatters light on shows what its far side receives, E/π, tinted.
#if RAY_BOUNCES
        vec4 normals = texelFetch(translucent_normal, pixel, 0);
        vec2 uv = gl_FragCoord.xy * view.inverse_resolution;
        vec3 position_ws = position_ws_from_depth(uv, depth);
        vec3 n = octahedral_decode(normals.xy);
        vec3 ng = octahedral_decode(normals.zw);
#if HAS_VPLS
        vec3 far = gather_some_vpls(position_ws, -n, -ng, 0, 1, 1.0).radiance;
#else
        vec3 far = far_side_light(position_ws, -ng, -n, reflect(view_direction_ws(uv), ng));
#endif
        transmission_indirect = vec4(far * texelFetch(translucent_color, pixel, 0).rgb, 1.0);
#endif
        return;
    }
    uint seed = hash_u32(uvec2(pixel + view.pixel_offset));
    vec2 u = fract(sobol_2d(view.subframe, 41u) + unit_shift(seed));
    RefractedRay ray = refracted_ray(pixel, depth, u, 1e-4 * depth);
    if (!ray.passes) {
        return;
    }
    bool hit;
    float distance;
    float choice = unit_float(hash_u32(seed + view.subframe * 2654435761u));
    vec3 radiance = rsm_ray(ray.position_ws, ray.direction, ray.leaving, choice, hit, distance);
    if (hit) {
#if HAS_MEDIUM
        radiance *= medium_transmittance(ray.position_ws, ray.direction, distance);
#endif
        transmission_indirect = vec4(radiance * texelFetch(gbuf_transmission, pixel, 0).rgb, 1.0);
    }
}
