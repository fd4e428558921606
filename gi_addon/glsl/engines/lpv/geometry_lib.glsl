// The geometry volume: what stands between the centres of neighbouring cells. Included where `lpv_walls` is declared.
//
// It is the occlusion volume of Kaplanyan and Dachsbacher (2010, §3.4), moved by half a cell as theirs, kept per face and not
// as harmonics: a full wall then blocks all of the light, not .75 of it. Face (cell, axis) stands for the column from the
// centre of the cell below along the axis to that of the cell itself. A wall is (share of the column that is blocked, place,
// two components of the normal): the place in cells above the lower centre; the normal's components along the next two axes,
// turned up the axis.

#include "engines/lpv/lpv_lib.glsl"

// Albedos are summed in whole units and never rounded up: no bounce has more than the albedo. 2²⁰ fragments a face fit.
const float LPV_ALBEDO_UNITS = 4095.0;

// The face below `cell` along `axis`; the first layer's are never asked for.
int face_index(ivec3 cell, int axis) { return (grid_first + cell_index(cell, grid_size)) * 3 + axis; }

// Normal of a wall, turned up the axis.
vec3 wall_normal(vec4 wall, int axis)
{
    float along = sqrt(max(1.0 - dot(wall.zw, wall.zw), 0.0));
    return axis == 0 ? vec3(along, wall.zw) : axis == 1 ? vec3(wall.w, along, wall.z) : vec3(wall.zw, along);
}

#if HAS_LPV_WALLS
// Share of the way from `at` to the centre of `cell` that no wall blocks, as far as the face between the layers `upper` − 1 and
// `upper` along `axis` tells in the column through `column`.
float open_between(vec3 at, ivec3 cell, ivec3 column, int axis, int upper)
{
    column[axis] = upper;
    if (!inside_grid(column, grid_size) || upper == 0) {
        return 1.0;
    }
    vec4 wall = lpv_walls[face_index(column, axis)];
    if (wall.x <= 0.0) {
        return 1.0;
    }
    vec3 place = vec3(column) + 0.5;
    place[axis] += wall.y - 1.0;
    vec3 n = wall_normal(wall, axis);
    return dot(at - place, n) * dot(vec3(cell) + 0.5 - place, n) < 0.0 ? 1.0 - wall.x : 1.0;
}

// Share of the way from grid point `at` to the centre of one of the eight cells around it that no wall blocks, neither in the
// cell's own column nor in that of `at`.
float open_way(vec3 at, ivec3 cell)
{
    ivec3 upper = ivec3(floor(at - 0.5)) + 1;
    float share = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
        share *= min(open_between(at, cell, cell, axis, upper[axis]),
                     open_between(at, cell, ivec3(floor(at)), axis, upper[axis]));
    }
    return share;
}
#endif

// The cell that light leaving a surface starts in: the first in front of grid point `surface` (unit normal `n`), a quarter of its
// width along n away on average, unless that cell's centre is behind another wall, in a corner: then, of the eight cells around,
// the one with most of the way open. Farther off, a room's light would come from walls that much nearer to each other: by half a
// width, the middle of a sphere of 15 cells' radius had 1.09 of its light.
ivec3 cell_in_front(vec3 surface, vec3 n, ivec3 size)
{
    vec3 at = surface + n * (0.5 * half_cell_shift(n));
    at = dot(floor(at) + 0.5 - surface, n) > 0.0 ? at : surface + n * half_cell_shift(n);
    ivec3 cell = ivec3(floor(at));
#if HAS_LPV_WALLS
    if (open_way(at, cell) < 0.5) {
        vec3 base = floor(at - 0.5);
        vec3 f = at - 0.5 - base;
        float most = 0.0;
        ivec3 nearest = cell;
        for (int i = 0; i < 8; ++i) {
            ivec3 corner = ivec3(i & 1, (i >> 1) & 1, i >> 2);
            ivec3 other = ivec3(base) + corner;
            vec3 t = mix(1.0 - f, f, vec3(corner));
            float weight = t.x * t.y * t.z * open_way(at, other);
            if (dot(vec3(other) + 0.5 - surface, n) > 0.0 && weight > most) {
                most = weight;
                nearest = other;
            }
        }
        cell = nearest;
    }
#endif
    return clamp(cell, ivec3(0), size - 1);
}
