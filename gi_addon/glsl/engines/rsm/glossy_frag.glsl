// Glossy reflections: one ray per pixel and sub-frame into the material's lobe, cast in the RSMs. Neighbours share what their rays
// find (passes/share_reflections_frag.glsl), the sub-frames spread them.

#include "lib/view_lib.glsl"
#include "lib/bsdf_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "lib/reflection_lib.glsl"
#include "engines/rsm/raycast_lib.glsl"

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float depth = texelFetch(gbuf_depth, pixel, 0).r;
    traced = NO_LOBE;
    traced_ray = vec4(0.0);
    Lobe lobe = lobe_unpack(texelFetch(gbuf_specular, pixel, 0), texelFetch(gbuf_lobe, pixel, 0));
    if (depth <= 0.0 || !lobe_reflects(lobe)) {
        return;
    }
    // Every pixel's points are the sequence's, turned by its own offset (R. Cranley and T. Patterson, 1976).
    uint seed = hash_u32(uvec2(pixel + view.pixel_offset));
    ReflectedRay ray = reflected_ray(pixel, fract(sobol_2d(view.subframe, 40u) + unit_shift(seed)));
    traced = NO_LIGHT;
    traced_ray = vec4(ray.direction, ray.pdf);
    if (ray.passes) {
        bool hit;
        float distance;
        float choice = unit_float(hash_u32(seed + view.subframe * 2654435761u));
        vec3 radiance = rsm_ray(ray.position_ws, ray.direction, ray.ng, choice, hit, distance);
#if HAS_MEDIUM
        radiance *= medium_transmittance(ray.position_ws, ray.direction, distance);
#endif
        traced = traced_light(radiance, distance);
    }
}
