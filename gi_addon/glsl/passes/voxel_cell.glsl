// What a cell of the voxels holds: a sheet of surface for each of the six sides that its surfaces face most (passes/voxels.py), a
// plane, x_k + slope · (u, v) = height about the cell's middle, along axis k with u and v the next axes round, which of 4 × 4
// squares of the face it covers, and how far it reaches over it. Sheets are kept one after another (passes/voxel_store.glsl).

#include "passes/voxel_store.glsl"
#include "lib/math_lib.glsl"

struct Grid {
    vec3 low;      // corner, m
    float cell;    // width of a cell, m
    vec3 size;     // cells
    float levels;  // mips above the cells
};

struct Sheet {
    vec3 slant;     // 1 along the axis, the slopes along the others
    float height;   // over the cell's middle, cells
    uint squares;   // a bit for each that is covered
    vec4 far;       // how far it reaches over the face, down u and v from its far sides, up from its near ones, cells
};

vec3 axis_vector(int axis) { return vec3(equal(ivec3(axis), ivec3(0, 1, 2))); }

// (u, v) of a vector.
vec2 across_axis(vec3 v, int axis) { return axis == 0 ? v.yz : axis == 1 ? v.zx : v.xy; }

// The vector whose part along the axis is x, and whose others are (u, v).
vec3 along_axis(float x, vec2 uv, int axis)
{
    return axis == 0 ? vec3(x, uv) : axis == 1 ? vec3(uv.y, x, uv.x) : vec3(uv, x);
}

// Kinds of sheets in a cell: 1 … 63 a bit each, or 64 + level of the largest empty block.
uint kinds_of(vec4 texel) { return uint(texel.r * 255.0 + 0.5); }

// The number of the first sheet of a cell of `level`, by what it holds, in a grid of `size` cells.
uint first_number(usampler2D rows, vec4 texel, ivec3 cell, ivec3 size, int level)
{
    uvec2 before = uvec2(texel.ba * 255.0 + 0.5);
    return texelFetch(rows, store_texel(row_of(cell, size, level)), 0).r + (before.x | before.y << 8u);
}

// The sheet of `part` by its number.
Sheet sheet_at(usampler2D sheets, uint number, int part)
{
    uvec3 texel = texelFetch(sheets, store_texel(number), 0).xyz;
    vec2 slopes = unpackUnorm2x16(texel.x) * 2.0 - 1.0;
    return Sheet(along_axis(1.0, slopes, part >> 1), unpackUnorm2x16(texel.y).x * 3.0 - 1.5, texel.y >> 16u, unpackUnorm4x8(texel.z));
}

// Of the cell with the sheet: mean share of light that its surfaces reflect; how much of it is diffuse.
vec4 sheet_albedo(usampler2D sheets, uint number) { return unpackUnorm4x8(texelFetch(sheets, store_texel(number), 0).w); }

// A sheet's front normal.
vec3 sheet_normal(Sheet sheet, int part) { return normalize(sheet.slant) * ((part & 1) == 0 ? 1.0 : -1.0); }

// Middle of square `square` on the sheet, in cells from the cell's middle.
vec3 sheet_point(Sheet sheet, int part, vec2 uv)
{
    return along_axis(sheet.height - dot(across_axis(sheet.slant, part >> 1), uv), uv, part >> 1);
}

float squares_share(uint squares) { return float(bitCount(squares)) / float(SQUARES * SQUARES); }

// Whether the sheet covers the square at (u, v), in cells from the cell's middle.
bool covers(Sheet sheet, vec2 uv)
{
    ivec2 square = clamp(ivec2(floor((uv + 0.5) * float(SQUARES))), ivec2(0), ivec2(SQUARES - 1));
    return (sheet.squares >> (square.x + SQUARES * square.y) & 1u) == 1u;
}
