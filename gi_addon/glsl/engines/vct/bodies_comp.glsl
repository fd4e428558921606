// Light that enters a body below its surface and leaves it elsewhere, between the sheets of the voxels: radiance injection's last step
// (M. Chiang, P. Kutz and B. Burley, SIGGRAPH 2016, as in passes/subsurface_frag.glsl).
//
// A sheet's reflected radiance was L = ρ E/π, as if all light left where it enters. Of the share σ of it that scatters below the
// surface the walk is taken that the picture takes, from the sheet inwards: with w the light that it keeps until it leaves at y,
//     L(x) ← (1 − σ) L(x) + σ ⟨w L(y)/A(y)⟩,
// since L_s(x) = σρ/A ⟨w E(y)⟩/π and ρ ∝ A, the albedo of the half space, at both ends. Evenly lit wax of a small free path keeps
// its L: ⟨w⟩ = A. What a thin one lets through it lacks, and its other side has. Emission does not enter.

#include "passes/body_walk.glsl"

layout(local_size_x = WALK_LANES) in;
layout(binding = 12) uniform sampler2D light_now; // vct.radiance, or vct.walked when that is due

shared vec3 found_by[WALK_LANES];

// Radiance that a sheet reflects, in units.
vec3 reflected(uint number)
{
    vec4 light = texelFetch(light_now, store_texel(number), 0);
    vec3 radiance = light.a > 0.0 ? light.rgb / light.a : vec3(0.0);
#if HAS_VOXEL_EMISSION
    radiance -= texelFetch(voxel_emission, store_texel(number), 0).rgb * emission_scale;
#endif
    return radiance;
}

// Square `which` of those that a sheet covers.
int covered_square(Sheet sheet, int which)
{
    int square = 0;
    for (int i = 0; i < 16; ++i) {
        bool covered = (sheet.squares >> i & 1u) == 1u;
        square = covered && which == 0 ? i : square;
        which -= covered ? 1 : 0;
    }
    return square;
}

// What walk `which` from a sheet finds.
vec3 walked(uint number, ivec3 cell, int part, Body body, vec3 own, int which)
{
    uint index = walk_first + uint(which);
    uint seed = hash_u32(pack_place(cell, part));
    uint state = hash_u32(uvec2(seed, index));
    bool together = max3(body.path) - min3(body.path) <= 1e-3 * max3(body.path);
    int channel = which % 3;
    vec3 taken = vec3(1.0);
    if (!together) {
        // A third of the walks is a channel's, or one more.
        taken = vec3(equal(ivec3(channel), ivec3(0, 1, 2))) * (float(walk_count) / float((walk_count + 2 - channel) / 3));
    }
    float path = body.path[channel];
    if (path < WALK_SHORT) {
        return taken * own;
    }
    Sheet sheet = sheet_at(voxel_sheets, number, part);
    int square = covered_square(sheet, int(index) % bitCount(sheet.squares));
    vec2 uv = square_middle(square) + SQUARE * (vec2(draw(state), draw(state)) - 0.5);
    vec3 start = vec3(cell) + 0.5 + sheet_point(sheet, part, uv);
    vec3 direction = way_in(body, frame_from_normal(sheet_normal(sheet, part)), fract(r2_sequence(index) + unit_shift(seed)), state);
    Grid grid = Grid(grid_low, grid_cell, vec3(grid_size), grid_levels);
    vec3 alpha = single_scattering_albedo(max(body.albedo, vec3(1e-3)));
    Walk walk = walk_below(voxel_sheets, voxel_rows, voxel_kinds, voxel_bodies, grid, start, direction, path, alpha, state);
    if (max3(walk.weight) <= 0.0) {
        return vec3(0.0);
    }
    vec3 there = max(unpack_body(texelFetch(voxel_bodies, store_texel(walk.number), 0)).albedo, vec3(1e-3));
    return taken * walk.weight * reflected(walk.number) / there;
}

void main()
{
    uint lane = gl_LocalInvocationID.x;
    // Sheets of the cells: as many as before the first row of the next level.
    uint count = texelFetch(voxel_rows, store_texel(rows_before(grid_size, 1)), 0).r;
    for (uint number = gl_WorkGroupID.x; number < count; number += gl_NumWorkGroups.x) {
        Body body = unpack_body(texelFetch(voxel_bodies, store_texel(number), 0));
        if (body.share <= 0.0) {
            continue;
        }
        ivec2 texel = store_texel(number);
        if (walk_count == 0) {
            if (lane == 0u) {
                imageStore(voxel_radiance, texel, texelFetch(light_now, texel, 0));
            }
            continue;
        }
        uint place = texelFetch(voxel_places, texel, 0).r;
        vec3 own = reflected(number);
        vec3 sum = vec3(0.0);
        for (int i = int(lane); i < walk_count; i += WALK_LANES) {
            sum += walked(number, place_cell(place), place_part(place), body, own, i);
        }
        found_by[lane] = sum;
        barrier();
        if (lane == 0u) {
            // In this order: the same bits each time.
            for (int i = 1; i < WALK_LANES; ++i) {
                sum += found_by[i];
            }
            vec4 light = texelFetch(light_now, texel, 0);
            light.rgb += body.share * (sum / float(walk_count) - own) * light.a;
            imageStore(voxel_walked, texel, light);
        }
        barrier();
    }
}
