// What light leaves the sheets of the voxels (passes/voxel_cell.glsl): kept by sheet, of the cells and of each mip. Its alpha is the share
// of the face that the sheet covers, rgb radiance × alpha, in units of `radiance_unit`. What leaves sheets by their backs is kept the
// same way. A cell without the sheet has no light: 0.

#include "passes/voxel_cell.glsl"

// Light of `part` of the cells of `level` around `p` (cells of the finest), which lies in cell `within` of that level along the part's
// axis: filtered across it.
vec4 light_at(sampler2D light, usampler2D rows, sampler3D kinds, Grid grid, int level, vec3 p, int within, int part)
{
    ivec3 size = ivec3(grid.size);
    int axis = part >> 1;
    vec2 uv = across_axis(p * exp2(float(-level)), axis) - 0.5;
    vec2 share = fract(uv);
    vec4 sum = vec4(0.0);
    for (int k = 0; k < 4; ++k) {
        ivec2 step_ = ivec2(k & 1, k >> 1);
        ivec2 at = ivec2(floor(uv)) + step_;
        ivec3 cell = axis == 0 ? ivec3(within, at) : axis == 1 ? ivec3(at.y, within, at.x) : ivec3(at, within);
        cell = clamp(cell, ivec3(0), (size >> level) - 1);
        vec4 texel = texelFetch(kinds, cell, level);
        uint found = kinds_of(texel);
        if (found < 64u && (found >> part & 1u) == 1u) {
            uint number = first_number(rows, texel, cell, size, level) + sheets_before(found, part);
            vec2 weight = mix(1.0 - share, share, vec2(step_));
            sum += texelFetch(light, store_texel(number), 0) * (weight.x * weight.y);
        }
    }
    return sum;
}

// In a compute shader whose invocations are the sheets: the number of this one's.
#define invoked_number() (gl_GlobalInvocationID.y * STORE_WIDTH + gl_GlobalInvocationID.x)

// Whether `number`, counted within `level`, is the first sheet of a cell of it; then its number among all, the cell and its kinds.
bool first_of_cell(usampler2D places, usampler2D rows, sampler3D kinds_, ivec3 size, int level, inout uint number, out ivec3 cell,
                   out uint kinds)
{
    ivec3 here = size >> level;
    uint first_row = rows_before(size, level);
    uint first = texelFetch(rows, store_texel(first_row), 0).r;
    uint end = texelFetch(rows, store_texel(first_row + uint(here.y * here.z)), 0).r;
    number += first;
    cell = ivec3(0);
    kinds = 0u;
    if (number >= end) {
        return false;
    }
    uint place = texelFetch(places, store_texel(number), 0).r;
    cell = place_cell(place);
    kinds = kinds_of(texelFetch(kinds_, cell, level));
    return sheets_before(kinds, place_part(place)) == 0u;
}
