// One more bounce in the voxels: light that a cell's surfaces gather from all others by cones, times their albedo. Added to what
// the lights bring (inject_comp.glsl), round by round: L_k = L_1 + ρ G L_(k−1). G averages and ρ ≤ 1: it can't grow.

#include "lib/sequence_lib.glsl"
#include "engines/vct/cone_lib.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;
layout(binding = 12) uniform sampler3D light_now;

// E/π, in units, at a point of a sheet with normal `n`: N cones of equal weight, as in diffuse_lib.glsl, turned from sheet to sheet.
vec3 gathered(Grid grid, vec3 p, vec3 n, float leaving, uint turn)
{
    mat3 frame = frame_from_normal(n);
    float spread = cone_spread(1.0 / float(cone_count));
    vec3 sum = vec3(0.0);
    for (int i = 0; i < cone_count; ++i) {
        vec3 d = frame * cone_direction(turn + uint(i));
        Cone cone = Cone(p + LIFT * n, d, spread, 1e30, leaving);
        sum += trace_cone(light_now, voxel_sheets, voxel_extents, voxel_kinds, grid, cone).radiance;
    }
    return sum / (float(cone_count) * radiance_unit);
}

// The middle of what a sheet covers, in cells from the cell's middle.
vec3 sheet_middle(Sheet sheet, int part)
{
    vec2 middle = vec2(0.0);
    for (int square = 0; square < 16; ++square) {
        middle += (sheet.squares >> square & 1u) == 1u ? square_middle(square) : vec2(0.0);
    }
    return sheet_point(sheet, part, middle / float(bitCount(sheet.squares)));
}

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(cell, grid_size))) {
        return;
    }
    uint kinds = kinds_of(texelFetch(voxel_kinds, cell, 0));
    bool empty = kinds >= 64u;
    if (empty && first_time == 0) {
        return;
    }
    vec3 albedo = texelFetch(voxel_albedo, cell, 0).rgb;
    Grid grid = Grid(grid_low, grid_cell, vec3(grid_size), grid_levels);
    uint turn = hash_u32(uvec3(cell));
    for (int part = 0; part < 6; ++part) {
        int opposite = part ^ 1;
        bool has_front = !empty && (kinds >> part & 1u) == 1u;
        bool has_back = !empty && (kinds >> opposite & 1u) == 1u;
        vec3 light = vec3(0.0);
        if (has_front || has_back) {
            Sheet none = Sheet(vec3(0.0), 0.0, 0u);
            Sheet sheet = has_front ? sheet_at(voxel_sheets, cell, grid_size, part) : none;
            Sheet behind = has_back ? sheet_at(voxel_sheets, cell, grid_size, opposite) : none;
            vec2 shown = shown_shares(sheet, behind, part);
            vec3 middle = vec3(cell) + 0.5;
            if (shown.x > 0.0) {
                light += shown.x * gathered(grid, middle + sheet_middle(sheet, part), sheet_normal(sheet, part), 1.0, turn);
            }
            if (shown.y > 0.0) {
                vec3 n = -sheet_normal(behind, opposite);
                light += shown.y * gathered(grid, middle + sheet_middle(behind, opposite), n, -1.0, turn);
            }
            light *= albedo / (shown.x + shown.y);
        }
        imageStore(voxel_bounce, part_texel(cell, grid_size, part >> 1, part & 1), vec4(light, 1.0));
    }
}
