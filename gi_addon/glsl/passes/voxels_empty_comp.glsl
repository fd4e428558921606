// Which blocks of cells are empty, and how large the largest empty block around a cell is: upwards a level holds what any of
// its eight cells does; downwards an empty cell learns of the level above it. In r: 1 … 63 a bit for each of the six kinds of
// sheet, 64 + k nothing within the block of 2^k cells of that level, all over 255.

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;
layout(binding = 4, rg8) uniform image3D finer;
layout(binding = 5, rg8) uniform image3D coarser;

uint kinds_of(vec4 texel) { return uint(texel.r * 255.0 + 0.5); }

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(cell, size))) {
        return;
    }
    if (upwards == 1) {
        uint kinds = 0u;
        for (int k = 0; k < 8; ++k) {
            kinds |= kinds_of(imageLoad(finer, 2 * cell + ivec3(k & 1, (k >> 1) & 1, k >> 2)));
        }
        imageStore(coarser, cell, vec4(float(kinds) / 255.0, 0.0, 0.0, 0.0));
        return;
    }
    if (kinds_of(imageLoad(finer, cell)) == 0u) {
        uint above = kinds_of(imageLoad(coarser, cell / 2));
        imageStore(finer, cell, vec4(float(topmost == 1 || above < 64u ? 64u : above + 1u) / 255.0, 0.0, 0.0, 0.0));
    }
}
