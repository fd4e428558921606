// One more bounce in the voxels: light that a cell's surfaces gather from all others by cones, times their albedo. Added to what
// the lights bring (inject_comp.glsl), round by round: L_k = L_1 + ρ G L_(k−1). G averages and ρ ≤ 1: it can't grow.

#include "lib/sequence_lib.glsl"
#include "engines/vct/cone_lib.glsl"

layout(local_size_x = 64) in;
layout(binding = 12) uniform sampler2D light_now;
layout(binding = 13) uniform sampler2D back_now;

// E/π, in units, at a point of a sheet with normal `n`: N cones of equal weight, as in diffuse_lib.glsl, turned from sheet to sheet.
vec3 gathered(Grid grid, vec3 p, vec3 n, float leaving, uint turn)
{
    mat3 frame = frame_from_normal(n);
    float spread = cone_spread(1.0 / float(cone_count));
    vec3 sum = vec3(0.0);
    for (int i = 0; i < cone_count; ++i) {
        vec3 d = frame * cone_direction(turn + uint(i));
        Cone cone = Cone(p + LIFT * n, d, spread, 1e30, leaving);
        sum += trace_cone(light_now, back_now, voxel_sheets, voxel_rows, voxel_kinds, grid, cone).radiance;
    }
    return sum / (float(cone_count) * radiance_unit);
}

void main()
{
    uint number = invoked_number();
    ivec3 cell;
    uint kinds;
    if (!first_of_cell(voxel_places, voxel_rows, voxel_kinds, grid_size, 0, number, cell, kinds)) {
        return;
    }
    vec3 albedo = sheet_albedo(voxel_sheets, number).rgb;
    Grid grid = Grid(grid_low, grid_cell, vec3(grid_size), grid_levels);
    uint turn = hash_u32(uvec3(cell));
    uint own = number;
    for (int part = 0; part < 6; ++part) {
        if ((kinds >> part & 1u) == 1u) {
            Sheet sheet = sheet_at(voxel_sheets, own, part);
            vec3 n = sheet_normal(sheet, part);
            vec2 middle = vec2(0.0);
            for (int square = 0; square < 16; ++square) {
                middle += (sheet.squares >> square & 1u) == 1u ? square_middle(square) : vec2(0.0);
            }
            float share = squares_share(sheet.squares);
            vec3 p = vec3(cell) + 0.5 + sheet_point(sheet, part, middle / (16.0 * share));
            vec3 front = albedo * gathered(grid, p, n, 1.0, turn);
            vec3 back = albedo * gathered(grid, p, -n, -1.0, turn);
            imageStore(voxel_bounce, store_texel(own), vec4(front, 1.0));
            imageStore(voxel_bounce_back, store_texel(own), vec4(back, 1.0));
            ++own;
        }
    }
}
