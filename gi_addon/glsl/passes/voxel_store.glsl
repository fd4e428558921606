// Where the voxels' sheets are kept (passes/voxels.py). A cell knows the kinds of its sheets, a bit for each of six, and how many
// sheets are before its own in its row of cells along x; a row knows how many are before it. All sheets of all rows of the cells
// come first, then those of the coarser levels. A sheet's number is its place in all textures of sheets.

// A cell's face is known by squares, so many along each side: a sheet has a bit for each, u fastest. As many as half a word holds.
const int SQUARES = 4;
const float SQUARE = 1.0 / float(SQUARES); // width, cells

// (u, v) of a square's middle, in cells from the cell's middle.
vec2 square_middle(int square) { return (vec2(square % SQUARES, square / SQUARES) + 0.5) * SQUARE - 0.5; }

const uint STORE_WIDTH = 4096u; // passes/voxels.py: STORE_WIDTH

ivec2 store_texel(uint number) { return ivec2(number % STORE_WIDTH, number / STORE_WIDTH); }

// How many rows are before those of `level`: each level has a quarter of those of the finer one.
uint rows_before(ivec3 size, int level)
{
    ivec3 here = size >> level;
    return uint((size.y * size.z - here.y * here.z) / 3 * 4);
}

// The number of the row of a cell of `level` in a grid of `size` cells.
uint row_of(ivec3 cell, ivec3 size, int level)
{
    return rows_before(size, level) + uint(cell.z * (size.y >> level) + cell.y);
}

// Which of a cell's sheets, of those that it has, is that of `part`.
uint sheets_before(uint kinds, int part) { return uint(bitCount(kinds & ((1u << part) - 1u))); }

// A cell as a word of 32 bits: kinds, opacity, sheets before its own in its row.
uint word_kinds(uint word) { return word & 255u; }
uint word_sheets(uint word) { return word >> 16u; }

// Where a sheet lies: its cell and its part. Cells are below 512.
uint pack_place(ivec3 cell, int part) { return uint(cell.x | cell.y << 9 | cell.z << 18 | part << 27); }
ivec3 place_cell(uint place) { return ivec3(uvec3(place, place >> 9u, place >> 18u) & 511u); }
int place_part(uint place) { return int(place >> 27u); }
