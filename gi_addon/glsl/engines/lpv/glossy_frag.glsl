// Glossy reflections: rays of the lobe's visible normals, each to the surface it meets, and that surface's radiance. What a
// light gives the surface is in that light's RSM (raycast_lib.glsl), bounces are in the volume in front of it (bounces_lib.glsl),
// and what the picture shows is taken from there. (A. Kaplanyan, "Light Propagation Volumes in CryEngine 3", SIGGRAPH course
// 2009, and the paper's §V sum the volume's harmonics along the one mirrored ray. Orders 0 to 2 of what arrives at a wall ring on
// the side that it does not come from: that gave unlit walls a third of the lit ones' radiance, in other colours.) Lights,
// emissive surfaces and the world as mirrored are direct light, as in Cycles, and not in here.
//
// A ray drawn by the visible normals (E. Heitz 2018) weighs F G2/G1, whatever the roughness.

#include "lib/view_lib.glsl"
#include "lib/bsdf_lib.glsl"
#include "lib/sequence_lib.glsl"
#define RAY_BOUNCES 1
#include "engines/rsm/raycast_lib.glsl"
#include "engines/lpv/bounces_lib.glsl"

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 uv = gl_FragCoord.xy * view.inverse_resolution;
    float depth = texelFetch(gbuf_depth, pixel, 0).r;
    indirect_glossy = vec4(0.0);
    if (depth <= 0.0) {
        return;
    }
    Lobe lobe = lobe_unpack(texelFetch(gbuf_specular, pixel, 0), texelFetch(gbuf_lobe, pixel, 0));
    if (!lobe_reflects(lobe)) {
        return;
    }
    vec3 position_ws = position_ws_from_depth(uv, depth);
    vec4 normals = texelFetch(gbuf_normal, pixel, 0);
    vec3 n = octahedral_decode(normals.xy);
    vec3 ng = octahedral_decode(normals.zw);
    vec3 v = view_direction_ws(uv);
    mat3 frame = frame_from_normal(n);
    vec3 v_local = v * frame;
    v_local.z = max(v_local.z, 1e-4); // shading normals can face away from the eye
    float alpha = max(sqr(lobe.roughness), ALPHA_MIN);
    // Each pixel turns the sequence by its own number (R. Cranley and T. Patterson, 1976).
    uint seed = hash_u32(uvec2(pixel + view.pixel_offset));
    vec2 turn = unit_shift(seed);
    vec3 sum = vec3(0.0);
    for (int i = 0; i < glossy_rays; ++i) {
        vec2 u = fract(sobol_2d(view.subframe * uint(glossy_rays) + uint(i), 40u) + turn);
        vec3 h = ggx_sample_visible_normal(v_local, alpha, u);
        vec3 l_local = reflect(-v_local, h);
        vec3 l = frame * l_local;
        if (l_local.z <= 0.0 || dot(l, ng) <= 0.0) {
            continue;
        }
        float g2_g1 = ggx_visible_weight(v_local.z, l_local.z, alpha);
        bool hit;
        float distance;
        vec3 radiance = rsm_ray(position_ws, l, ng, u.x, hit, distance);
#if HAS_MEDIUM
        radiance *= medium_transmittance(position_ws, l, distance);
#endif
        sum += fresnel(lobe, saturate(dot(v_local, h))) * g2_g1 * radiance;
    }
    vec3 gain = multiscatter_gain(brdf_energy, brdf_average, lobe, saturate(abs(dot(n, v))));
    indirect_glossy = vec4(gain * sum / float(glossy_rays), 1.0);
}
