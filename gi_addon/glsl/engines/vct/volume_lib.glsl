// What the voxels hold, and what light leaves them, by side.
//
// A cell has a sheet of surface for each of the six sides that its surfaces face most (passes/voxels.py): a plane,
// x_k + slope · (u, v) = height about the cell's middle, along axis k with u and v the next axes round, and which of 4 × 4
// squares of the face it covers.
//
// Light is kept in an atlas of six parts, what the cell shows to the sides +x … −z; part (side, axis) lies at (side, 0, axis) of
// 2 × 1 × 3. Alpha is the share of the face that is covered, rgb radiance × alpha, in units of `radiance_unit`. To a side show the
// front of the sheet that faces it and the back of the one that faces away, where that is the nearer of them: of a wall thinner
// than a cell the fronts, of a sheet without thickness its front and its back.

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

// Shares of the cell's face that show, to the side of part `part`, the front of that part's sheet and the back of the opposite
// part's. Sheets that are not there have no squares.
vec2 shown_shares(Sheet front, Sheet opposite, int part)
{
    int axis = part >> 1;
    float sign_ = (part & 1) == 0 ? 1.0 : -1.0;
    ivec2 count = ivec2(0);
    for (int square = 0; square < 16; ++square) {
        vec2 uv = square_middle(square);
        float ahead = sign_ * (sheet_point(front, part, uv)[axis] - sheet_point(opposite, part, uv)[axis]);
        bool has_front = (front.squares >> square & 1u) == 1u;
        bool has_back = (opposite.squares >> square & 1u) == 1u;
        bool front_shows = has_front && (!has_back || ahead >= 0.0);
        count += ivec2(front_shows, has_back && !front_shows);
    }
    return vec2(count) / 16.0;
}

// Kinds of sheets in a cell: 1 … 63 a bit each, or 64 + level of the largest empty block.
uint kinds_of(vec4 texel) { return uint(texel.r * 255.0 + 0.5); }

// One part at `uvw` in [0, 1]³ of the grid, filtered within level `lod`. Half a texel stays between neighbouring parts.
vec4 part_at(sampler3D atlas, Grid grid, vec3 uvw, float lod, int part)
{
    vec3 margin = 0.5 * exp2(lod) / grid.size;
    uvw = clamp(uvw, margin, 1.0 - margin);
    return textureLod(atlas, vec3((uvw.x + float(part & 1)) / 2.0, uvw.y, (uvw.z + float(part >> 1)) / 3.0), lod);
}
