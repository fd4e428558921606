// A ray through the grids, from cell to cell. Included after geometry_lib. `MARCH_STEPS` bounds the faces it can pass:
// nx + ny + nz of all of them.

// The share of a ray that meets no wall within `reach` m. It starts in front of a surface at `surface_ws` of unit normal `n`, in
// the finest grid that has the surface inside, and goes on in the ones around.
float open_share(vec3 surface_ws, vec3 n, vec3 direction, float reach)
{
    float open_ = 1.0;
    int k = LPV_GRIDS - 1;
    vec3 from = vec3(0.0);
    for (int i = 0; i < LPV_GRIDS; ++i) {
        use_grid(k);
        from = (surface_ws - grid_origin) / grid_cell;
        k -= k > 0 && grid_share(from) <= 0.0 ? 1 : 0;
    }
    from += n * half_cell_shift(n);
    ivec3 cell = ivec3(floor(from));
    vec3 slope = max(abs(direction), vec3(1e-6));
    bvec3 up = greaterThanEqual(direction, vec3(0.0));
    vec3 ahead = vec3(up.x ? 1.0 : 0.0, up.y ? 1.0 : 0.0, up.z ? 1.0 : 0.0);
    ivec3 step_ = ivec3(up.x ? 1 : -1, up.y ? 1 : -1, up.z ? 1 : -1);
    // Distance along the ray to the next face of each axis.
    vec3 next = (vec3(cell) + ahead - from) * vec3(step_) / slope;
    float most = reach / grid_cell;
    bool alive = inside_grid(cell, grid_size);
    for (int i = 0; i < MARCH_STEPS; ++i) {
        if (!alive) {
            continue;
        }
        int axis = next.x <= next.y ? (next.x <= next.z ? 0 : 2) : (next.y <= next.z ? 1 : 2);
        if (next[axis] > most) {
            alive = false;
            continue;
        }
        ivec3 to = cell;
        to[axis] += step_[axis];
        if (!inside_grid(to, grid_size)) {
#if LPV_GRIDS > 1
            if (k > 0) {
                // The same ray in the grid around, from where it is: half as many cells.
                // It goes on from that one's cell on this side, whose face to the next is the border's.
                vec3 middle_ws = grid_origin + (vec3(cell) + 0.5) * grid_cell;
                vec3 from_ws = grid_origin + from * grid_cell;
                use_grid(--k);
                from = (from_ws - grid_origin) / grid_cell;
                cell = ivec3(floor((middle_ws - grid_origin) / grid_cell));
                next = (vec3(cell) + ahead - from) * vec3(step_) / slope;
                most = reach / grid_cell;
                alive = inside_grid(cell, grid_size);
                continue;
            }
#endif
            alive = false;
            continue;
        }
        open_ *= 1.0 - lpv_walls[face_index(up[axis] ? to : cell, axis)].x;
        alive = open_ > 0.004; // below a display's step
        cell = to;
        next[axis] += 1.0 / slope[axis];
    }
    return open_;
}
