// What refracting surfaces show: a refracted ray per pixel, carried through the grid to the wall it meets (the paper's §V sums
// harmonics along the ray refracted once). Both interfaces are refracted at, the way inside being as long as the object is deep
// along the view ray (C. Wyman, "An Approximate Image-Space Approach for Interactive Refraction", SIGGRAPH 2005). Walls are as
// blurred as a cell; where the ray leaves the grid alpha stays 0, and the pixel shows what is straight behind.

#include "lib/view_lib.glsl"
#include "lib/bsdf_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "engines/lpv/geometry_lib.glsl"
#include "engines/lpv/march_lib.glsl"

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
    vec3 direction = refract(-eye, frame * ggx_sample_visible_normal(v, alpha, u), 1.0 / medium.x);
    if (dot(direction, direction) < 0.5 || dot(direction, ng) >= 0.0) {
        return; // totally reflected, or below the surface: no light this way
    }
    vec3 position_ws = position_ws_from_depth(uv, depth);
    float back = texelFetch(translucent_back_depth, pixel, 0).r;
    float thickness = (back - depth) * length(ray_direction_ws(uv));
    if (thickness > 1e-4 * depth) {
        position_ws += direction * thickness;
        vec3 s = project_ws(position_ws);
        ivec2 there = clamp(ivec2(s.xy * view.resolution), ivec2(0), ivec2(view.resolution) - 1);
        there = texelFetch(translucent_back_depth, there, 0).r > 0.0 ? there : pixel;
        vec3 out_n = -octahedral_decode(texelFetch(translucent_back_normal, there, 0).xy); // normals face the eye
        vec3 outside = refract(direction, dot(direction, out_n) > 0.0 ? -out_n : out_n, medium.x);
        direction = dot(outside, outside) > 0.5 ? outside : direction;
    }
    March m = march_walls((position_ws - grid_origin) / grid_cell, direction, 1e9);
    if (m.open_share < 0.5) {
        vec3 radiance = m.radiance / (1.0 - m.open_share); // all of the ray ends on what it met
        transmission_indirect = vec4(radiance * texelFetch(gbuf_transmission, pixel, 0).rgb, 1.0);
    }
}
