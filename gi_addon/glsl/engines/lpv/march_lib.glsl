// A ray through the grid, from cell to cell. Included after geometry_lib. `MARCH_STEPS` bounds the faces it can pass:
// nx + ny + nz. `MARCH_LIGHT` asks for the light of the walls it meets, from `lpv_volume`.
//
// Of the light that a wall reflects, the cell in front of it has the sharpest picture: there it fills a hemisphere evenly,
// farther away a few directions, which harmonics of order 2 blur. Radiance along a ray being constant, the ray looks there.

#if MARCH_LIGHT
// What cell `cell` sends along unit vector `w`.
vec3 cell_radiance(ivec3 cell, vec3 w)
{
    float y[SH_COUNT];
    sh_basis(w, y);
    vec3 sum = vec3(0.0);
    for (int c = 0; c < SH_COUNT; ++c) {
        sum += y[c] * texelFetch(lpv_volume, cell + ivec3(0, 0, c * grid_size.z), 0).rgb;
    }
    return max(sum, vec3(0.0));
}
#endif

struct March {
    vec3 radiance;  // from the walls met, W/(m²·sr)
    float open_share; // of the ray that met none
};

// From grid point `from` along `direction` (unit) for at most `reach` cells.
March march_walls(vec3 from, vec3 direction, float reach)
{
    March m = March(vec3(0.0), 1.0);
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
#if HAS_LPV_WALLS
        float blocked = lpv_walls[face_index(up[axis] ? to : cell, axis, grid_size)].x;
        if (blocked > 0.0) {
#if MARCH_LIGHT
            m.radiance += m.open_share * blocked * cell_radiance(cell, -direction);
#endif
            m.open_share *= 1.0 - blocked;
            alive = m.open_share > 0.004; // below a display's step
        }
#endif
        cell = to;
        next[axis] += 1.0 / slope[axis];
    }
    return m;
}
