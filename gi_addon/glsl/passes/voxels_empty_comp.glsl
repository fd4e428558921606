// Which blocks of cells are empty, and how large the largest empty block around a cell is: upwards a level holds what any of
// its eight cells does; downwards an empty cell learns of the level above it. In a cell's kinds: 1 … 63 a bit for each of the six
// kinds of sheet, 64 + k nothing within the block of 2^k cells of that level.

#include "passes/voxel_sums.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;
layout(binding = 4, r32ui) uniform uimage3D finer;
layout(binding = 5, r32ui) uniform uimage3D coarser;

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(cell, size))) {
        return;
    }
    if (step_ == STEP_CLEAR) {
        imageStore(finer, cell, uvec4(0u));
    } else if (step_ == STEP_UP) {
        uint kinds = 0u;
        for (int k = 0; k < 8; ++k) {
            ivec3 below = 2 * cell + ivec3(k & 1, (k >> 1) & 1, k >> 2);
            uint found = imageLoad(finer, below).r;
            if (level == 0) {
                found = (found & SOME_OPAQUE) != 0u ? found & 63u : 0u;
                imageStore(finer, below, uvec4(found));
            }
            kinds |= found;
        }
        imageStore(coarser, cell, uvec4(kinds));
    } else if (imageLoad(finer, cell).r == 0u) {
        uint above = word_kinds(imageLoad(coarser, cell / 2).r);
        imageStore(finer, cell, uvec4(topmost == 1 || above < 64u ? 64u : above + 1u));
    }
}
