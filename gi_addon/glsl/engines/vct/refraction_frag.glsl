// What refracting surfaces show: a cone along the ray refracted where it enters and where it leaves, as wide as the surface is
// rough (paper §V-E, Figure 9e). Translucent surfaces scatter what arrives at their far side: a hemisphere of cones there.
//
// A refracted direction turns |1 − 1/η| times as far as the half vector, a mirrored one twice: half of the cone of
// glossy_frag.glsl times that.

#include "lib/view_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "lib/bsdf_lib.glsl"
#include "lib/refraction_lib.glsl"
#include "engines/vct/seen_lib.glsl"

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float depth = texelFetch(translucent_depth, pixel, 0).r;
    transmission_indirect = vec4(0.0);
    if (depth <= 0.0) {
        return;
    }
    vec3 tint = texelFetch(gbuf_transmission, pixel, 0).rgb;
    vec2 medium = texelFetch(translucent_medium, pixel, 0).rg;
    vec4 normals = texelFetch(translucent_normal, pixel, 0);
    vec3 ng = octahedral_decode(normals.zw);
    if (medium.y > 0.5) {
        vec2 uv = gl_FragCoord.xy * view.inverse_resolution;
        Gathered behind = gather_cones(pixel, position_ws_from_depth(uv, depth), -octahedral_decode(normals.xy), -ng);
        transmission_indirect = vec4(behind.radiance * tint, 1.0);
        return;
    }
    vec2 u = view.subframes > 1u ? sobol_2d(view.subframe, 44u) : vec2(0.0);
    RefractedRay ray = refracted_ray(pixel, depth, u, 1e-4 * depth);
    if (!ray.passes) {
        return;
    }
    float alpha = max(sqr(texelFetch(translucent_color, pixel, 0).a), ALPHA_MIN);
    Grid grid = voxel_grid();
    float spread = min(sqrt(2.0 / cone_sets) * alpha * abs(1.0 - 1.0 / medium.x), 1.0);
    // Clear glass is not in the voxels. Tinted glass is, by what it takes; that is in `tint` already, so the cone leaves it: by
    // its far side's front, or by a sheet's back.
    vec3 start = (ray.position_ws - grid.low) / grid.cell + LIFT * ray.direction;
    float side = surface_side(voxel_sheets, voxel_rows, voxel_kinds, grid, start, ray.direction);
    ConeResult result = trace_seen(grid, Cone(start, ray.direction, spread, 1e30, side));
    // A cone that leaves the scene knows nothing of what is there.
    if (result.transmittance < 0.5) {
        transmission_indirect = vec4(result.radiance / (1.0 - result.transmittance) * tint, 1.0);
    }
}
