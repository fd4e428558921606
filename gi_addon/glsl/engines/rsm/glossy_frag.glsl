// Glossy reflections: one ray per pixel and sub-frame into the material's lobe, by visible normals (E. Heitz, "Sampling the
// GGX Distribution of Visible Normals", JCGT 7(4), 2018): its share of the lobe is then F G2/G1. The sub-frames spread it.

#include "lib/view_lib.glsl"
#include "lib/bsdf_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "engines/rsm/raycast_lib.glsl"

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 uv = gl_FragCoord.xy * view.inverse_resolution;
    float depth = texelFetch(gbuf_depth, pixel, 0).r;
    indirect_glossy = vec4(0.0, 0.0, 0.0, 1.0);
    Lobe lobe = lobe_unpack(texelFetch(gbuf_specular, pixel, 0), texelFetch(gbuf_lobe, pixel, 0));
    if (depth <= 0.0 || !lobe_reflects(lobe)) {
        return;
    }
    vec3 position_ws = position_ws_from_depth(uv, depth);
    vec4 normals = texelFetch(gbuf_normal, pixel, 0);
    vec3 n = octahedral_decode(normals.xy);
    vec3 ng = octahedral_decode(normals.zw);
    mat3 frame = frame_from_normal(n);
    vec3 v = view_direction_ws(uv) * frame;
    v = normalize(vec3(v.xy, max(v.z, 1e-3)));
    float alpha = max(sqr(lobe.roughness), ALPHA_MIN);
    // Every pixel's points are the sequence's, turned by its own offset (R. Cranley and T. Patterson, 1976).
    uint seed = hash_u32(uvec2(pixel + view.pixel_offset));
    vec2 u = fract(sobol_2d(view.subframe, 40u) + unit_shift(seed));
    vec3 h = ggx_sample_visible_normal(v, alpha, u);
    vec3 l = reflect(-v, h);
    vec3 direction = frame * l;
    if (l.z <= 0.0 || dot(direction, ng) <= 0.0) {
        return;
    }
    vec3 share = fresnel(lobe, saturate(dot(v, h))) * ggx_visible_weight(v.z, l.z, alpha);
    share *= multiscatter_gain(brdf_energy, brdf_average, lobe, v.z);
    bool hit;
    float distance;
    vec3 radiance = rsm_ray(position_ws, direction, ng, unit_float(hash_u32(seed + view.subframe * 2654435761u)), hit, distance);
#if HAS_MEDIUM
    radiance *= medium_transmittance(position_ws, direction, distance);
#endif
    indirect_glossy = vec4(radiance * share, 1.0);
}
