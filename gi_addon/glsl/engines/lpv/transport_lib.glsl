// What light along an ordinate ω meets in a cell with walls. Included where `lpv_walls` is declared.
//
// Walls stand between cells: one at an angle to the grid is a flight of steps, faces of up to three axes, and each face stands
// for the area A = 1/|n|₁ of the wall. With n turned to the cell's side, P = Σ max(ω_a n_a, 0) and M = Σ max(−ω_a n_a, 0) over
// the axes, the wall sends A (P − M) of light where that is positive (ω·n ≥ 0), and takes A (M − P) where it is negative; its
// steps are A P in the ordinate's back and A M in its way.
//
// Light that leaves the wall (P ≥ M). Steps in the way let nothing through and take nothing, and of those in the back the share
// M/P is no gap in what arrives, but air between the steps. Neither counts as cross-section, so that the cell's radiance is its
// flux over the rest:
//     L = F/K,  F = Σ_a |ω_a| (1 − κ_a) L_a + Q/h²,  K = the smaller of Σ_behind and Σ_ahead of |ω_a| (1 − κ_a [as above]).
// What goes on is L, or less where the open faces would pass more than F. An isotropic field in front of a wall of any direction
// then stays one.
//
// Light that meets the wall (M > P). Steps in the back are air, and those in the way would take L (K − open faces ahead). That is
// too much at grazing light: the treads' own steps in the back never give back what a beam over the slope would bring. Let the
// ordinate's axes be x (into the steps) and y (off the treads), r = ω_y/ω_x, treads n = n_y/n_x cells long, q = n r = P/M. A
// uniform beam L = 1 must lose ω_x − n ω_y per step.
// - n > 1, r < 1: along a tread the lowest cells have L₁ a^(k−1), k = 1 … n, a = 1/(1 + r), and their step takes
//   (ω_x − ω_y) L₁ a^(n−1). The cells' mean is 1 where their step takes of that only
//       g = (1 − q) ((1 + r)ⁿ − 1) / (q (1 − r)).
// - n < 1, r > 1, in m = 1/n cells before each step: the first cell has only what comes along x and passes it all, and the
//   next ones have 1 − (r − 1) b^(k−2)/(1 + r), b = r/(1 + r), k = 2 … m. With s = (r − 1)(1 − b^(m−1)) their mean is 1 − s/m, and
//   they take ω_x (m − 1 − s):
//       g = (m − r)(m − s) / (m (m − 1 − s)).
// - Otherwise L = 1 in all cells, and they take just that: g = 1.
// What is not taken goes on over the step. Without g the surroundings of a lit patch in a sphere have .82 to .93 of their light
// within 60°, and what lies opposite the more; with it the mean radiance that a grazing beam has in front of a wall is the beam's.
// With several axes x and y are sums over those that meet the wall, and those that leave it.

#include "engines/lpv/geometry_lib.glsl"

// g above, of light with `meeting` > `leaving` (M and P); `parts` is ω_a n_a.
float step_share(float leaving, float meeting, vec3 parts, vec3 share)
{
    if (leaving <= 1e-4 * meeting) {
        return 1.0;
    }
    float q = leaving / meeting;
    float r = dot(share, vec3(greaterThan(parts, vec3(0.0)))) / dot(share, vec3(lessThan(parts, vec3(0.0))));
    float n = q / r;
    if (n > 1.0 && r < 1.0) {
        return (1.0 - q) * (pow(1.0 + r, n) - 1.0) / (q * (1.0 - r));
    }
    if (n < 1.0 && r > 1.0) {
        float m = 1.0 / n;
        float s = (r - 1.0) * (1.0 - pow(r / (1.0 + r), m - 1.0));
        return (m - r) * (m - s) / (m * (m - 1.0 - s));
    }
    return 1.0;
}

struct Way {
    float section; // K: flux over it is radiance
    float passed;  // what each open face ahead passes on, per radiance
    float taken;   // what the walls take, per radiance
};

#if HAS_LPV_WALLS
// Whether any wall stands at a cell's faces.
bool walled(ivec3 cell)
{
    float covered = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        ivec3 next = cell;
        next[axis] += 1;
        covered += cell[axis] > 0 ? lpv_walls[face_index(cell, axis)].x : 0.0;
        covered += next[axis] < grid_size[axis] ? lpv_walls[face_index(next, axis)].x : 0.0;
    }
    return covered > 0.0;
}

// Σ |ω_a| over the faces behind and ahead that are cross-section, over the open ones ahead; over those in the way, and of that what
// they take.
struct Faces {
    float behind;
    float ahead;
    float open_ahead;
    float in_way;
    float taking;
};

// Add a wall across `axis` that blocks the share `blocked` of |ω|₁, on the cell's high or low side.
void add_wall(inout Faces faces, vec4 wall, int axis, bool high, float blocked, vec3 w)
{
    vec3 parts = w * wall_normal(wall, axis) * (high ? -1.0 : 1.0);
    float leaving = dot(max(parts, vec3(0.0)), vec3(1.0));
    float meeting = -dot(min(parts, vec3(0.0)), vec3(1.0));
    if ((w[axis] >= 0.0) != high) {
        faces.behind -= blocked * (leaving > 1e-6 ? min(meeting / leaving, 1.0) : 1.0);
        return;
    }
    faces.open_ahead -= blocked;
    faces.in_way += blocked;
    faces.ahead -= leaving >= meeting ? blocked : 0.0;
    faces.taking += blocked * (leaving >= meeting ? 1.0 : step_share(leaving, meeting, parts, abs(w)));
}

// The way of light along w through a cell; `covered` is how much of each axis' face in the back walls cover.
Way way_through(ivec3 cell, vec3 w, out vec3 covered)
{
    vec3 share = abs(w);
    float whole = share.x + share.y + share.z;
    Faces faces = Faces(whole, whole, whole, 0.0, 0.0);
    covered = vec3(0.0);
    for (int axis = 0; axis < 3; ++axis) {
        bool up = w[axis] >= 0.0;
        ivec3 next = cell;
        next[axis] += 1;
        vec4 low = cell[axis] > 0 ? lpv_walls[face_index(cell, axis)] : vec4(0.0);
        vec4 high = next[axis] < grid_size[axis] ? lpv_walls[face_index(next, axis)] : vec4(0.0);
        covered[axis] = up ? low.x : high.x;
        if (low.x > 0.0) {
            add_wall(faces, low, axis, false, share[axis] * low.x, w);
        }
        if (high.x > 0.0) {
            add_wall(faces, high, axis, true, share[axis] * high.x, w);
        }
    }
    Way way;
    way.section = min(faces.behind, faces.ahead);
    // A cell whose every face is a wall that the light leaves, or none of them one it could come from, has no cross-section.
    way.section = way.section > 1e-3 * whole ? way.section : whole;
    way.taken = max(way.section - faces.open_ahead, 0.0);
    // In a dead end all of it ends.
    way.taken *= faces.in_way > 0.0 && faces.open_ahead > 1e-3 * whole ? faces.taking / faces.in_way : 1.0;
    way.passed = faces.open_ahead > 0.0 ? (way.section - way.taken) / faces.open_ahead : 0.0;
    return way;
}
#endif
