// The geometry volume: what stands between the centres of neighbouring cells. Included where `lpv_walls` is declared.
//
// It is the occlusion volume of Kaplanyan and Dachsbacher (2010, §3.4), moved by half a cell as theirs, kept per face and not
// as harmonics: a full wall then blocks all of the light, not .75 of it. Face (cell, axis) stands for the column from the
// centre of the cell below along the axis to that of the cell itself. A wall is (share of the column that is blocked, place,
// two components of the normal): the place in cells above the lower centre; the normal's components along the next two axes,
// turned up the axis.

#include "engines/lpv/lpv_lib.glsl"

// The face below `cell` along `axis`; the first layer's are never asked for.
int face_index(ivec3 cell, int axis, ivec3 size) { return cell_index(cell, size) * 3 + axis; }

// Normal of a wall, turned up the axis.
vec3 wall_normal(vec4 wall, int axis)
{
    float along = sqrt(max(1.0 - dot(wall.zw, wall.zw), 0.0));
    return axis == 0 ? vec3(along, wall.zw) : axis == 1 ? vec3(wall.w, along, wall.z) : vec3(wall.zw, along);
}
