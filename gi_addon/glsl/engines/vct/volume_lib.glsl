// Light that leaves the voxels, by direction, and what they block: one 3D atlas of six parts.
//
// A part holds what is seen of each cell by rays that meet it along one axis from one side: alpha is the optical depth of
// crossing the cell along that axis, τ/OPAQUE; the colour is radiance × alpha. Depths add up along a ray and interpolate
// without losing any: ∫ τ over a linear blend of cells is their sum, however a ray is stepped through it. Opacities do not:
// half of two half-opaque neighbours lets light through a wall that was whole (the usual 1 − (1 − α)^(step/voxel)).
// The sides are normals' directions +x … −z: part (side, axis) lies at (side, 0, axis) of 2 × 1 × 3.

#include "lib/math_lib.glsl"

// Optical depth of a whole surface: it lets e^−8 = 0.03 % pass, and half floats hold radiance × 1 without rounding it.
const float OPAQUE = 8.0;

struct Grid {
    vec3 low;      // corner, m
    float cell;    // width of a cell, m
    vec3 size;     // cells
    float levels;  // mips above the cells
};

ivec3 part_texel(ivec3 cell, ivec3 size, int axis, int side)
{
    return ivec3(cell.x + side * size.x, cell.y, cell.z + axis * size.z);
}

// One part at `uvw` in [0, 1]³ of the grid, filtered. Half a texel of the coarser level stays between neighbouring parts.
vec4 part_at(sampler3D atlas, Grid grid, vec3 uvw, float lod, int axis, bool negative)
{
    vec3 margin = 0.5 * exp2(ceil(lod)) / grid.size;
    uvw = clamp(uvw, margin, 1.0 - margin);
    return textureLod(atlas, vec3((uvw.x + (negative ? 1.0 : 0.0)) / 2.0, uvw.y, (uvw.z + float(axis)) / 3.0), lod);
}

// Alpha of a cell of level `level` along each axis, from how much of its faces its surfaces cover. A plane cuts a column of
// cells along the axis it faces most in three cells at most, and their coverages add up to 1: so the depth of a whole
// surface is dealt out by share, along all axes by the same factor, and any ray through the plane meets OPAQUE in all
// (∫ A_k |d_k| summed over the axes is Σ |n_k d_k| / |n·d| ≥ 1). Surfaces that fill less block what they cover:
// Σ τ = −ln(1 − min(Σ A, 1)).
vec3 cell_alpha(sampler3D coverage, ivec3 cell, int level)
{
    vec3 here = texelFetch(coverage, cell, level).rgb;
    ivec3 size = textureSize(coverage, level);
    int axis = here.x >= here.y && here.x >= here.z ? 0 : here.y >= here.z ? 1 : 2;
    if (here[axis] <= 0.0) {
        return vec3(0.0);
    }
    ivec3 along = ivec3(equal(ivec3(0, 1, 2), ivec3(axis)));
    ivec3 before = cell - along;
    ivec3 after = cell + along;
    float sum = here[axis];
    sum += before[axis] >= 0 ? texelFetch(coverage, before, level)[axis] : 0.0;
    sum += after[axis] < size[axis] ? texelFetch(coverage, after, level)[axis] : 0.0;
    return min(here * (-log(max(1.0 - sum, exp(-OPAQUE))) / (sum * OPAQUE)), vec3(1.0));
}

// What a ray along `direction` meets at a point in cells: source radiance in rgb, and in alpha the optical depth per
// length of one cell of that level. A sheet across axis k has depth τ_k for a ray along k and τ_k |d_k| per unit length
// for any other, so that the whole of it is τ_k at every angle.
//
// A slanted sheet is seen from its front or its back as a whole, though along one axis or two a ray may pass it
// from the other side: what leaves that side is another ray's. So the axes weigh by τ_k ∓ N_k sign(d_k), with N the
// surfaces' mean normal as a depth: 2 τ_k or 0 for a sheet, τ_k where fronts face apart.
vec4 medium_at(sampler3D atlas, sampler3D facing, Grid grid, vec3 p, vec3 direction, float lod)
{
    vec3 uvw = p / grid.size;
    vec3 w = abs(direction);
    // Rays along +k see the sides that face −k.
    vec4 x = part_at(atlas, grid, uvw, lod, 0, direction.x > 0.0);
    vec4 y = part_at(atlas, grid, uvw, lod, 1, direction.y > 0.0);
    vec4 z = part_at(atlas, grid, uvw, lod, 2, direction.z > 0.0);
    vec3 alpha = vec3(x.a, y.a, z.a);
    float depth = dot(w, alpha);
    if (depth <= 0.0) {
        return vec4(0.0);
    }
    vec3 towards = -direction * textureLod(facing, uvw, lod).rgb * alpha;
    float side = dot(towards, vec3(1.0)) >= 0.0 ? 1.0 : -1.0;
    vec3 share = max(w * alpha + side * towards, vec3(0.0));
    vec3 unit = share / max(alpha, vec3(1e-9)); // the parts hold radiance × alpha
    float total = dot(share, vec3(1.0));
    vec3 light = unit.x * x.rgb + unit.y * y.rgb + unit.z * z.rgb;
    return vec4(total > 0.0 ? light / total : vec3(0.0), depth * OPAQUE);
}
