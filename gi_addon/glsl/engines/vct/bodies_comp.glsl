// Light that enters a body below its surface and leaves it elsewhere, between the sheets of the voxels: radiance injection's last step
// (M. Chiang, P. Kutz and B. Burley, SIGGRAPH 2016, as in passes/subsurface_frag.glsl).
//
// A sheet's reflected radiance was L = ρ E/π, as if all light left where it enters. Of the share σ of it that scatters below the
// surface the walk is taken that the picture takes, from the sheet inwards: with w the light that it keeps until it leaves at y,
//     L(x) ← (1 − σ) L(x) + σ ⟨w L(y)/A(y)⟩,
// since L_s(x) = σρ/A ⟨w E(y)⟩/π and ρ ∝ A, the albedo of the half space, at both ends. Evenly lit wax of a small free path keeps
// its L: ⟨w⟩ = A. What a thin one lets through it lacks, and its other side has. Emission does not enter.

#include "engines/vct/walk_lib.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;
layout(binding = 12) uniform sampler3D light_now; // vct.radiance, or vct.walked when that is due

const vec3 CHANNEL[3] = vec3[3](vec3(3.0, 0.0, 0.0), vec3(0.0, 3.0, 0.0), vec3(0.0, 0.0, 3.0));

// Radiance that a sheet reflects, in units.
vec3 reflected(ivec3 cell, int part)
{
    vec4 light = texelFetch(light_now, part_texel(cell, grid_size, part >> 1, part & 1), 0);
    vec3 radiance = light.a > 0.0 ? light.rgb / light.a : vec3(0.0);
#if HAS_VOXEL_EMISSION
    radiance -= texelFetch(voxel_emission, cell, 0).rgb * emission_scale;
#endif
    return radiance;
}

void main()
{
    ivec3 at = ivec3(gl_GlobalInvocationID); // z: part and cell
    int part = at.z / grid_size.z;
    ivec3 cell = ivec3(at.xy, at.z - part * grid_size.z);
    if (any(greaterThanEqual(at, ivec3(grid_size.xy, 6 * grid_size.z)))) {
        return;
    }
    uint kinds = kinds_of(texelFetch(voxel_kinds, cell, 0));
    Body body = unpack_body(texelFetch(voxel_bodies, cell, 0));
    if (kinds >= 64u || (kinds & body.parts & (1u << part)) == 0u) {
        return;
    }
    ivec3 texel = part_texel(cell, grid_size, part >> 1, part & 1);
    vec4 light = texelFetch(light_now, texel, 0);
    if (walk_count == 0) {
        imageStore(voxel_radiance, texel, light);
        return;
    }
    Grid grid = Grid(grid_low, grid_cell, vec3(grid_size), grid_levels);
    Sheet sheet = sheet_at(voxel_sheets, cell, grid_size, part);
    mat3 frame = frame_from_normal(sheet_normal(sheet, part));
    vec3 own = reflected(cell, part);
    vec3 alpha = single_scattering_albedo(max(body.albedo, vec3(1e-3)));
    bool together = max3(body.path) - min3(body.path) <= 1e-3 * max3(body.path);
    int count = bitCount(sheet.squares);
    uint seed = hash_u32(uvec3(texel));
    vec2 turn = unit_shift(seed);
    vec3 sum = vec3(0.0);
    for (int k = 0; k < walk_count; ++k) {
        int channel = k % 3;
        uint index = walk_first + uint(k);
        uint state = hash_u32(uvec2(seed, index));
        vec3 taken = together ? vec3(1.0) : CHANNEL[channel];
        if (body.path[channel] < WALK_SHORT) {
            sum += taken * own;
            continue;
        }
        int wanted = int(index) % count;
        int square = 0;
        for (int i = 0; i < 16; ++i) {
            bool covered = (sheet.squares >> i & 1u) == 1u;
            square = covered && wanted == 0 ? i : square;
            wanted -= covered ? 1 : 0;
        }
        vec2 uv = square_middle(square) + 0.25 * (vec2(draw(state), draw(state)) - 0.5);
        vec3 start = vec3(cell) + 0.5 + sheet_point(sheet, part, uv);
        vec3 direction = way_in(body, frame, fract(r2_sequence(index) + turn), state);
        Walk walk = walk_below(voxel_sheets, voxel_kinds, voxel_bodies, grid, start, direction, body.path[channel], alpha, state);
        if (max3(walk.weight) > 0.0) {
            vec3 there = max(unpack_body(texelFetch(voxel_bodies, walk.cell, 0)).albedo, vec3(1e-3));
            sum += taken * walk.weight * reflected(walk.cell, walk.part) / there;
        }
    }
    light.rgb += body.share * (sum / float(walk_count) - own) * light.a;
    imageStore(voxel_walked, texel, light);
}
