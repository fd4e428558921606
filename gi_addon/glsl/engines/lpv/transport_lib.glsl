// What light along an ordinate meets in a cell with walls. Included where `lpv_walls` is declared.

#include "engines/lpv/geometry_lib.glsl"

#if HAS_LPV_WALLS
struct Way {
    float section; // the cell's cross-section: flux over it is radiance
    float passed;  // of the radiance, what open faces ahead pass on
    float taken;   // of the radiance, what walls take
};

// The walls around a cell: low and high side of each axis. At the grid's border is none.
void cell_walls(ivec3 cell, out vec4 walls[6])
{
    for (int i = 0; i < 6; ++i) {
        ivec3 upper = cell;
        upper[i >> 1] += i & 1;
        bool there = upper[i >> 1] > 0 && upper[i >> 1] < grid_size[i >> 1];
        walls[i] = there ? lpv_walls[face_index(upper, i >> 1)] : vec4(0.0);
    }
}

float step_absorption(float leaving, float meeting, float out_, float in_)
{
    if (leaving <= 1e-6 || meeting <= leaving) {
        return 1.0;
    }
    float q = leaving / meeting;
    float r = out_ / in_;
    float n = q / r;
    if (n > 1.0 && r < 1.0) {
        return saturate((1.0 - q) * (pow(1.0 + r, n) - 1.0) / (q * (1.0 - r)));
    }
    if (n < 1.0 && r > 1.0) {
        float m = 1.0 / n;
        float lost = (r - 1.0) * (1.0 - pow(r / (1.0 + r), m - 1.0));
        return saturate((m - r) * (m - lost) / (m * (m - 1.0 - lost)));
    }
    return 1.0;
}

Way way_through(vec4 walls[6], vec3 w)
{
    vec3 share = abs(w);
    float whole = share.x + share.y + share.z;
    float behind = whole;
    float ahead = whole;
    float open_ahead = whole;
    float blocked = 0.0;
    float absorbing = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        bool up = w[axis] >= 0.0;
        for (int side = 0; side < 2; ++side) {
            vec4 wall = walls[2 * axis + side];
            if (wall.x <= 0.0) {
                continue;
            }
            bool back = up == (side == 0);
            vec3 parts = w * wall_normal(wall, axis) * (side == 0 ? 1.0 : -1.0);
            float leaving = dot(max(parts, vec3(0.0)), vec3(1.0));
            float meeting = -dot(min(parts, vec3(0.0)), vec3(1.0));
            if (back) {
                behind -= share[axis] * wall.x * (leaving > 1e-6 ? min(meeting / leaving, 1.0) : 1.0);
            } else {
                open_ahead -= share[axis] * wall.x;
                ahead -= leaving >= meeting ? share[axis] * wall.x : 0.0;
                float out_ = dot(share, vec3(greaterThan(parts, vec3(0.0))));
                float in_ = dot(share, vec3(lessThan(parts, vec3(0.0))));
                blocked += share[axis] * wall.x;
                absorbing += share[axis] * wall.x * step_absorption(leaving, meeting, out_, in_);
            }
        }
    }
    Way way;
    way.section = min(behind, ahead);
    // A cell whose every face is a wall that the light leaves, or none of them one it could come from, has no cross-section.
    way.section = way.section > 1e-3 * whole ? way.section : whole;
    way.taken = max(way.section - open_ahead, 0.0);
    if (open_ahead > 1e-3 * whole && blocked > 0.0) {
        way.taken *= absorbing / blocked;
    }
    way.passed = open_ahead > 0.0 ? (way.section - way.taken) / open_ahead : 0.0;
    return way;
}
#endif
