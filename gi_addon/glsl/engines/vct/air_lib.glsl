// Whether light gets to a point of the air, by a cone through the voxels. Included where the volumes and the grid are
// declared, after light_lib.

#include "engines/vct/cone_lib.glsl"

float voxel_visibility(Light light, vec3 position_ws)
{
    if (light.views <= 0) {
        return 1.0; // casts no shadow
    }
    Grid grid = Grid(grid_low, grid_cell, vec3(grid_size), grid_levels);
    vec3 start = (position_ws - grid.low) / grid.cell;
    vec3 l;
    float angle;
    light_arriving(light, position_ws, l, angle);
    float reach = light_is_directional(light) ? 1e30 : distance(light.position_ws, position_ws) / grid.cell - LIFT;
    return trace_open(voxel_sheets, voxel_rows, voxel_kinds, grid, Cone(start, l, 0.0, reach, 0.0));
}
