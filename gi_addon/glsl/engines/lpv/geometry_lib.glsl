// The geometry volume: what stands between the centres of neighbouring cells. Included where `lpv_faces` is declared.
//
// It is the occlusion volume of Kaplanyan and Dachsbacher (2010, §3.4), moved by half a cell as theirs, kept per face and not
// as harmonics: a full wall then blocks all of the light, not .75 of it. Face f of axis a stands for the column of one cell's
// cross-section from centre to centre; 16 points of that cross-section are tested by rasterising the scene along the axis.
// Per face: bits of the points that are covered, by surfaces that face up (low 16) or down (high 16) the axis; how many
// fragments; the sum of their places between the centres; the sums of their normals' other two components, turned up the
// axis. Sums are in 1/255 of the range.

#include "engines/lpv/lpv_lib.glsl"

const int FACE_WORDS = 5;

// The face below `cell` along `axis`; cells of the first layer have no neighbour there, and theirs is never asked for.
int face_index(ivec3 cell, int axis, ivec3 size) { return (cell_index(cell, size) * 3 + axis) * FACE_WORDS; }

float face_coverage(int face)
{
    uint bits = lpv_faces[face];
    return float(bitCount((bits | (bits >> 16)) & 0xFFFFu)) / 16.0;
}

// Mean normal of what covers the face, turned up the axis; not of unit length.
vec3 face_normal(int face, int axis)
{
    vec2 mean = vec2(lpv_faces[face + 3], lpv_faces[face + 4]) / (127.5 * float(max(lpv_faces[face + 1], 1u))) - 1.0;
    float along = sqrt(max(1.0 - dot(mean, mean), 0.0));
    return axis == 0 ? vec3(along, mean) : axis == 1 ? vec3(mean.y, along, mean.x) : vec3(mean, along);
}

// Mean place of what covers the face, in cells above the lower cell's centre.
float face_place(int face)
{
    return float(lpv_faces[face + 2]) / (255.0 * float(max(lpv_faces[face + 1], 1u)));
}
