// What the voxels hold, and what light leaves them, by side.
//
// A cell has a sheet of surface for each of the six sides that its surfaces face most (passes/voxels.py): a plane,
// x_k + slope · (u, v) = height about the cell's middle, along axis k with u and v the next axes round, and which of 4 × 4
// squares of the face it covers.
//
// Light is kept in an atlas of six parts, sheets' sides +x … −z; part (side, axis) lies at (side, 0, axis) of 2 × 1 × 3.
// Alpha is the share of the face that the sheet covers, rgb radiance × alpha, in units of `radiance_unit`. Light that leaves sheets by their backs (a sheet
// without thickness, lit from behind) is in a volume of its own.

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
};

ivec3 part_texel(ivec3 cell, ivec3 size, int axis, int side)
{
    return ivec3(cell.x + side * size.x, cell.y, cell.z + axis * size.z);
}

vec3 axis_vector(int axis) { return vec3(equal(ivec3(axis), ivec3(0, 1, 2))); }

// (u, v) of a vector.
vec2 across_axis(vec3 v, int axis) { return axis == 0 ? v.yz : axis == 1 ? v.zx : v.xy; }

// The vector whose part along the axis is x, and whose others are (u, v).
vec3 along_axis(float x, vec2 uv, int axis)
{
    return axis == 0 ? vec3(x, uv) : axis == 1 ? vec3(uv.y, x, uv.x) : vec3(uv, x);
}

Sheet sheet_at(sampler3D sheets, ivec3 cell, ivec3 size, int part)
{
    vec4 texel = texelFetch(sheets, part_texel(cell, size, part >> 1, part & 1), 0);
    return Sheet(along_axis(1.0, texel.xy * 2.0 - 1.0, part >> 1), texel.z * 3.0 - 1.5, uint(texel.w * 65535.0 + 0.5));
}

// A sheet's front normal.
vec3 sheet_normal(Sheet sheet, int part) { return normalize(sheet.slant) * ((part & 1) == 0 ? 1.0 : -1.0); }

// Middle of square `square` on the sheet, in cells from the cell's middle.
vec3 sheet_point(Sheet sheet, int part, vec2 uv)
{
    return along_axis(sheet.height - dot(across_axis(sheet.slant, part >> 1), uv), uv, part >> 1);
}

vec2 square_middle(int square) { return (vec2(square & 3, square >> 2) + 0.5) * 0.25 - 0.5; }

float squares_share(uint squares) { return float(bitCount(squares)) / 16.0; }

// Kinds of sheets in a cell: 1 … 63 a bit each, or 64 + level of the largest empty block.
uint kinds_of(vec4 texel) { return uint(texel.r * 255.0 + 0.5); }

// One part at `uvw` in [0, 1]³ of the grid, filtered within level `lod`. Half a texel stays between neighbouring parts.
vec4 part_at(sampler3D atlas, Grid grid, vec3 uvw, float lod, int part)
{
    vec3 margin = 0.5 * exp2(lod) / grid.size;
    uvw = clamp(uvw, margin, 1.0 - margin);
    return textureLod(atlas, vec3((uvw.x + float(part & 1)) / 2.0, uvw.y, (uvw.z + float(part >> 1)) / 3.0), lod);
}
