// What refracting surfaces show: a cone along the ray refracted where it enters and where it leaves (C. Wyman, "An Approximate
// Image-Space Approach for Interactive Refraction", SIGGRAPH 2005: the way inside is as long as the object is deep along the
// view ray), as wide as the surface is rough (paper §V-E, Figure 9e). Translucent surfaces scatter what arrives at
// their far side: a hemisphere of cones there.
//
// A refracted direction turns |1 − 1/η| times as far as the half vector, a mirrored one twice: half of the cone of
// glossy_frag.glsl times that.

#include "lib/view_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "lib/bsdf_lib.glsl"
#include "engines/vct/seen_lib.glsl"

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 uv = gl_FragCoord.xy * view.inverse_resolution;
    float depth = texelFetch(translucent_depth, pixel, 0).r;
    transmission_indirect = vec4(0.0);
    if (depth <= 0.0) {
        return;
    }
    vec3 tint = texelFetch(gbuf_transmission, pixel, 0).rgb;
    vec2 medium = texelFetch(translucent_medium, pixel, 0).rg;
    vec4 normals = texelFetch(translucent_normal, pixel, 0);
    vec3 n = octahedral_decode(normals.xy);
    vec3 ng = octahedral_decode(normals.zw);
    vec3 position_ws = position_ws_from_depth(uv, depth);
    if (medium.y > 0.5) {
        Gathered behind = gather_cones(position_ws, -n, -ng);
        transmission_indirect = vec4(behind.radiance * tint, 1.0);
        return;
    }
    vec3 eye = view_direction_ws(uv);
    mat3 frame = frame_from_normal(n);
    vec3 v = eye * frame;
    v = normalize(vec3(v.xy, max(v.z, 1e-3)));
    float alpha = max(sqr(texelFetch(translucent_color, pixel, 0).a), ALPHA_MIN);
    vec2 u = view.subframes > 1u ? sobol_2d(view.subframe, 44u) : vec2(0.0);
    vec3 h = frame * ggx_sample_visible_normal(v, alpha, u);
    vec3 direction = refract(-eye, h, 1.0 / medium.x);
    if (dot(direction, direction) < 0.5 || dot(direction, ng) >= 0.0) {
        return; // totally reflected, or below the surface: no light this way
    }
    float back = texelFetch(translucent_back_depth, pixel, 0).r;
    float thickness = (back - depth) * length(ray_direction_ws(uv));
    if (thickness > 1e-4 * depth) {
        position_ws += direction * thickness;
        vec3 s = project_ws(position_ws);
        ivec2 there = clamp(ivec2(s.xy * view.resolution), ivec2(0), ivec2(view.resolution) - 1);
        there = texelFetch(translucent_back_depth, there, 0).r > 0.0 ? there : pixel;
        // Normals face the eye: the way out is against them.
        vec3 out_n = -octahedral_decode(texelFetch(translucent_back_normal, there, 0).xy);
        vec3 outside = refract(direction, dot(direction, out_n) > 0.0 ? -out_n : out_n, medium.x);
        direction = dot(outside, outside) > 0.5 ? outside : direction;
    }
    Grid grid = voxel_grid();
    float spread = min(sqrt(2.0 / cone_sets) * alpha * abs(1.0 - 1.0 / medium.x), 1.0);
    // Clear glass is not in the voxels. Tinted glass is, by what it takes; that is in `tint` already, so the cone leaves it.
    vec3 start = (position_ws - grid.low) / grid.cell + LIFT * direction;
    float side = thickness > 1e-4 * depth ? 1.0 : -1.0; // out of the far side's front, or of a sheet's back
    ConeResult result = trace_seen(grid, Cone(start, direction, spread, 1e30, side));
    // A cone that leaves the scene knows nothing of what is there.
    if (result.transmittance < 0.5) {
        transmission_indirect = vec4(result.radiance / (1.0 - result.transmittance) * tint, 1.0);
    }
}
