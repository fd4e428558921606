// One row of cells: first how many sheets are before those of each cell, and how many the row has; later, when it is known how many
// are before the row, where each of its sheets lies.

#include "passes/voxel_store.glsl"

layout(local_size_x = 64) in;
layout(binding = 4, r32ui) uniform uimage3D cells_now;
layout(binding = 6, r32ui) uniform uimage2D rows_now;
layout(binding = 7, r32ui) writeonly uniform uimage2D places_now;

void main()
{
    ivec3 here = grid_size >> level;
    ivec3 cell = ivec3(0, gl_GlobalInvocationID.x % uint(here.y), gl_GlobalInvocationID.x / uint(here.y));
    if (cell.z >= here.z) {
        return;
    }
    ivec2 row = store_texel(row_of(cell, grid_size, level));
    uint before = step_ == STEP_COUNT ? 0u : imageLoad(rows_now, row).r;
    uint sheets = 0u;
    for (int x = 0; x < here.x; ++x) {
        cell.x = x;
        uint word = imageLoad(cells_now, cell).r;
        uint kinds = word_kinds(word);
        if (kinds >= 64u) {
            continue;
        }
        if (step_ == STEP_COUNT) {
            imageStore(cells_now, cell, uvec4(kinds | sheets << 16u));
        }
        for (int part = 0; part < 6; ++part) {
            if ((kinds >> part & 1u) == 1u) {
                if (step_ == STEP_PLACE && before + sheets < store_size) {
                    imageStore(places_now, store_texel(before + sheets), uvec4(pack_place(cell, part)));
                }
                ++sheets;
            }
        }
    }
    if (step_ == STEP_COUNT) {
        imageStore(rows_now, row, uvec4(sheets));
    }
}
