// What refracting surfaces show: a ray refracted where it enters and where it leaves, then cast in the RSMs (the paper's
// §IV-B, with both interfaces after C. Wyman, "An Approximate Image-Space Approach for Interactive Refraction", SIGGRAPH
// 2005: the way inside is as long as the object is deep along the view ray).

#include "lib/view_lib.glsl"
#include "lib/bsdf_lib.glsl"
#include "lib/sequence_lib.glsl"
#define RAY_SEES_EMISSION 1
#include "engines/rsm/raycast_lib.glsl"

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 uv = gl_FragCoord.xy * view.inverse_resolution;
    float depth = texelFetch(translucent_depth, pixel, 0).r;
    vec2 medium = texelFetch(translucent_medium, pixel, 0).rg;
    transmission_indirect = vec4(0.0);
    if (depth <= 0.0 || medium.y > 0.5) {
        return;
    }
    vec4 normals = texelFetch(translucent_normal, pixel, 0);
    vec3 n = octahedral_decode(normals.xy);
    vec3 ng = octahedral_decode(normals.zw);
    vec3 eye = view_direction_ws(uv);
    mat3 frame = frame_from_normal(n);
    vec3 v = eye * frame;
    v = normalize(vec3(v.xy, max(v.z, 1e-3)));
    float alpha = max(sqr(texelFetch(translucent_color, pixel, 0).a), ALPHA_MIN);
    uint seed = hash_u32(uvec2(pixel + view.pixel_offset));
    vec2 u = fract(sobol_2d(view.subframe, 41u) + vec2(unit_float(seed), unit_float(hash_u32(seed))));
    vec3 h = ggx_sample_visible_normal(v, alpha, u);
    vec3 direction = refract(-eye, frame * h, 1.0 / medium.x);
    if (dot(direction, direction) < 0.5 || dot(direction, ng) >= 0.0) {
        return; // totally reflected, or below the surface: no light this way
    }
    vec3 position_ws = position_ws_from_depth(uv, depth);
    vec3 leaving = -ng;
    float back = texelFetch(translucent_back_depth, pixel, 0).r;
    float thickness = (back - depth) * length(ray_direction_ws(uv));
    if (thickness > 1e-4 * depth) {
        position_ws += direction * thickness;
        vec3 s = project_ws(position_ws);
        ivec2 there = clamp(ivec2(s.xy * view.resolution), ivec2(0), ivec2(view.resolution) - 1);
        there = texelFetch(translucent_back_depth, there, 0).r > 0.0 ? there : pixel;
        // Normals face the eye: the way out is against them.
        vec4 far_normals = texelFetch(translucent_back_normal, there, 0);
        vec3 out_n = -octahedral_decode(far_normals.xy);
        leaving = -octahedral_decode(far_normals.zw);
        vec3 outside = refract(direction, dot(direction, out_n) > 0.0 ? -out_n : out_n, medium.x);
        direction = dot(outside, outside) > 0.5 ? outside : direction;
    }
    bool hit;
    float distance;
    float choice = unit_float(hash_u32(seed + view.subframe * 2654435761u));
    vec3 radiance = rsm_ray(position_ws, direction, leaving, choice, hit, distance);
    if (hit) {
#if HAS_MEDIUM
        radiance *= medium_transmittance(position_ws, direction, distance);
#endif
        transmission_indirect = vec4(radiance * texelFetch(gbuf_transmission, pixel, 0).rgb, 1.0);
    }
}
