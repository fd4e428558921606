// Glossy reflections: rays of the lobe's visible normals, each to the surface it meets, and that surface's radiance. What a
// light gives the surface is in that light's RSM (raycast_lib.glsl), bounces are in the volume in front of it (bounces_lib.glsl),
// and what the picture shows is taken from there. (A. Kaplanyan, "Light Propagation Volumes in CryEngine 3", SIGGRAPH course
// 2009, and the paper's §V sum the volume's harmonics along the one mirrored ray. Orders 0 to 2 of what arrives at a wall ring on
// the side that it does not come from: that gave unlit walls a third of the lit ones' radiance, in other colours.) Lights,
// emissive surfaces and the world as mirrored are direct light, as in Cycles, and not in here.

#include "lib/view_lib.glsl"
#include "lib/bsdf_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "lib/reflection_lib.glsl"
#define RAY_BOUNCES 1
#include "engines/rsm/raycast_lib.glsl"
#include "engines/lpv/bounces_lib.glsl"

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
    // Each pixel turns the sequence by its own number (R. Cranley and T. Patterson, 1976).
    vec2 u = fract(sobol_2d(view.subframe, 40u) + unit_shift(hash_u32(uvec2(pixel + view.pixel_offset))));
    ReflectedRay ray = reflected_ray(pixel, u);
    traced = NO_LIGHT;
    traced_ray = vec4(ray.direction, ray.pdf);
    if (ray.passes) {
        bool hit;
        float distance;
        vec3 radiance = rsm_ray(ray.position_ws, ray.direction, ray.ng, u.x, hit, distance);
#if HAS_MEDIUM
        radiance *= medium_transmittance(ray.position_ws, ray.direction, distance);
#endif
        traced = traced_light(radiance, distance);
    }
}
