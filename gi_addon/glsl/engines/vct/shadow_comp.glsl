// Shadows by a cone to each light (paper §V-C): its angle is that of the patch that the light's point of this sub-frame
// stands for: a set of axes over that patch, so that the penumbra is there at one sub-frame.

#include "lib/view_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "lib/light_lib.glsl"
#include "engines/vct/cone_lib.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(shadow_cones).xy))) {
        return;
    }
    float depth = texelFetch(gbuf_depth, pixel, 0).r;
    vec3 position_ws = position_ws_from_depth((vec2(pixel) + 0.5) * view.inverse_resolution, depth);
    vec4 normals = texelFetch(gbuf_normal, pixel, 0);
    vec3 n = octahedral_decode(normals.xy);
    vec3 ng = octahedral_decode(normals.zw);
    Grid grid = Grid(grid_low, grid_cell, vec3(grid_size), grid_levels);
    vec3 p = (position_ws - grid.low) / grid.cell;
    float side = surface_side(voxel_sheets, voxel_rows, voxel_kinds, grid, p, ng);
    uint turn = hash_u32(uvec3(pixel, view.subframe));
    for (int i = 0; i < light_count; ++i) {
        Light light = lights[i];
        vec3 l;
        float angle;
        vec3 arriving = light_arriving(light, position_ws, l, angle);
        float visible = 1.0;
        if (depth > 0.0 && light.views > 0 && dot(n, l) > 0.0 && max3(arriving) > 0.0) {
            float reach = light_is_directional(light) ? 1e30 : distance(light.position_ws, position_ws) / grid.cell;
            reach = max(reach - LIFT, 0.0); // not into what the light lies on
            mat3 frame = frame_from_normal(l);
            visible = 0.0;
            for (int k = 0; k < cone_count; ++k) {
                vec3 d = cone_direction(turn + uint(k));
                Cone cone = Cone(p + LIFT * ng, normalize(l + frame * vec3(d.xy, 0.0) * tan(min(angle, 0.785))), // 45°
                                 0.0, reach, side);
                visible += trace_open(voxel_sheets, voxel_rows, voxel_kinds, grid, cone) / float(cone_count);
            }
        }
        imageStore(shadow_cones, ivec3(pixel, i), vec4(visible));
    }
}
