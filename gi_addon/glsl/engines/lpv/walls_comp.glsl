// The geometry volume's faces from what was drawn (geometry_frag.glsl).
//
// What covers a part of a column blocks that part of the light. A surface that closes the whole column within this face and
// the two next to it along the axis is a wall: it stands between those cells whose centres it separates, and blocks all light
// there and none elsewhere. By parts, a wall at an angle to the grid, whose points fall into two faces, would let light
// through twice in part.

#include "engines/lpv/geometry_lib.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

const int WORDS = 5;
const uint ALL_POINTS = (1u << (LPV_POINTS * LPV_POINTS)) - 1u;
// How far a wall may leave its plane within a cell, in cells: a sphere of 6 cells' radius does.
const float BEND = 0.08;
const uint MIDDLE_POINT = 1u << (LPV_POINTS * LPV_POINTS / 2);

uint points(ivec3 cell, int axis)
{
    return inside_grid(cell, grid_size) ? lpv_faces[(cell_index(cell, grid_size) * 3 + axis) * WORDS] : 0u;
}

// Whether a wall covers all of this slab's points that its own plane has in it: then it ends nowhere here, but goes on in the
// slabs and columns around. The plane goes through the mean of the points covered.
bool goes_on(uint here, vec4 wall)
{
    float along = sqrt(max(1.0 - dot(wall.zw, wall.zw), 0.0));
    vec2 middle = vec2(0.0);
    for (int i = 0; i < LPV_POINTS * LPV_POINTS; ++i) {
        middle += float((here >> i) & 1u) * vec2(i % LPV_POINTS, i / LPV_POINTS);
    }
    middle /= float(max(bitCount(here), 1));
    bool whole = true;
    bool any_inside = false;
    float low = along;
    float high = 0.0;
    for (int i = 0; i < LPV_POINTS * LPV_POINTS; ++i) {
        // Distance along the normal from the ends of the slab.
        float height = wall.y * along - dot(wall.zw, vec2(i % LPV_POINTS, i / LPV_POINTS) - middle) / float(LPV_POINTS);
        bool inside = min(height, along - height) > BEND;
        whole = whole && (!inside || ((here >> i) & 1u) != 0u);
        any_inside = any_inside || inside;
        low = min(low, height);
        high = max(high, height);
    }
    // Of a wall that has no point in the slab's inside nothing is known, unless it crosses the slab from end to end between points. One
    // that lies in the slab's end and stops there (a plate's edge) blocks by what it covers, which changes evenly as it moves.
    return whole && (any_inside || high - low >= along);
}

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    if (!inside_grid(cell, grid_size)) {
        return;
    }
    for (int axis = 0; axis < 3; ++axis) {
        int face = face_index(cell, axis);
        int drawn = (cell_index(cell, grid_size) * 3 + axis) * WORDS;
        ivec3 along = ivec3(0);
        along[axis] = 1;
        uint here = points(cell, axis);
        uint count = lpv_faces[drawn + 1];
        vec3 mean = vec3(lpv_faces[drawn + 2], lpv_faces[drawn + 3], lpv_faces[drawn + 4]) /
                    (255.0 * float(max(count, 1u)));
        bool closed = (here | points(cell - along, axis) | points(cell + along, axis)) == ALL_POINTS ||
                      goes_on(here, vec4(1.0, mean.x, 2.0 * mean.yz - 1.0));
        float blocked = closed ? float((here & MIDDLE_POINT) != 0u)
                               : float(bitCount(here)) / float(LPV_POINTS * LPV_POINTS);
#if HAS_LPV_ALBEDO
        for (int k = 0; k < 3; ++k) {
            // From the sums to their mean, as a float in the same word.
            lpv_albedo[face * 3 + k] = floatBitsToUint(float(lpv_albedo[face * 3 + k]) / (LPV_ALBEDO_UNITS * float(max(count, 1u))));
        }
#endif
        lpv_walls[face] = vec4(blocked, mean.x, 2.0 * mean.yz - 1.0);
    }
}
