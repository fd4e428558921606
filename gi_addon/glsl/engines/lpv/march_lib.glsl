// A ray through the grid, from cell to cell. Included after geometry_lib. `MARCH_STEPS` bounds the faces it can pass:
// nx + ny + nz.

// The share of a ray from grid point `from` along `direction` (unit) that meets no wall within `reach` cells.
float open_share(vec3 from, vec3 direction, float reach)
{
    float open_ = 1.0;
    ivec3 cell = ivec3(floor(from));
    vec3 slope = max(abs(direction), vec3(1e-6));
    bvec3 up = greaterThanEqual(direction, vec3(0.0));
    ivec3 step_ = ivec3(up.x ? 1 : -1, up.y ? 1 : -1, up.z ? 1 : -1);
    // Distance along the ray to the next face of each axis.
    vec3 next = (vec3(cell) + vec3(up.x ? 1.0 : 0.0, up.y ? 1.0 : 0.0, up.z ? 1.0 : 0.0) - from) * vec3(step_) / slope;
    bool alive = inside_grid(cell, grid_size);
    for (int i = 0; i < MARCH_STEPS; ++i) {
        if (!alive) {
            continue;
        }
        int axis = next.x <= next.y ? (next.x <= next.z ? 0 : 2) : (next.y <= next.z ? 1 : 2);
        if (next[axis] > reach) {
            alive = false;
            continue;
        }
        ivec3 to = cell;
        to[axis] += step_[axis];
        if (!inside_grid(to, grid_size)) {
            alive = false;
            continue;
        }
        open_ *= 1.0 - lpv_walls[face_index(up[axis] ? to : cell, axis, grid_size)].x;
        alive = open_ > 0.004; // below a display's step
        cell = to;
        next[axis] += 1.0 / slope[axis];
    }
    return open_;
}
