// Bounced light of a surface that a ray has met: albedo × E/π, E from the volume in front of it. What no light's map shows is a
// wall of the geometry volume, which knows its plane and its albedo. Included after raycast_lib.glsl, where `lpv_volume`,
// `lpv_walls` and `lpv_albedo` are declared; it defines raycast_lib's `ray_bounces`.

#include "engines/lpv/lookup_lib.glsl"

// A surface of the fine cells stands somewhere in the column of a wall: one cell to either side, and one for the corner.
const int WALL_FACES = 6;

// The first wall on the way of a ray near grid point `at`: a point and the normal against the ray, and its albedo; false where
// there is none.
bool wall_near(vec3 at, vec3 direction, out vec3 place, out vec3 n, out vec3 albedo)
{
    vec3 from = at - 1.5 * direction;
    vec3 slope = max(abs(direction), vec3(1e-6));
    vec3 up = step(0.0, direction);
    vec3 cell = floor(from);
    vec3 next = (cell + up - from) * (2.0 * up - 1.0) / slope;
    bool found = false;
    place = at;
    n = -direction;
    albedo = vec3(0.0);
    for (int i = 0; i < WALL_FACES; ++i) {
        int axis = next.x <= next.y ? (next.x <= next.z ? 0 : 2) : (next.y <= next.z ? 1 : 2);
        float step_ = up[axis] > 0.5 ? 1.0 : -1.0;
        vec3 upper = cell;
        upper[axis] += max(step_, 0.0);
        cell[axis] += step_;
        next[axis] += 1.0 / slope[axis];
        if (found || !inside_grid(ivec3(upper), grid_size) || upper[axis] < 1.0) {
            continue;
        }
        int face = face_index(ivec3(upper), axis);
        vec4 wall = lpv_walls[face];
        if (wall.x > 0.0) {
            found = true;
            n = normalize(wall_normal(wall, axis));
            n = dot(n, direction) > 0.0 ? -n : n;
            place = upper + 0.5;
            place[axis] += wall.y - 1.0;
            albedo = uintBitsToFloat(uvec3(lpv_albedo[face * 3], lpv_albedo[face * 3 + 1], lpv_albedo[face * 3 + 2]));
        }
    }
    return found;
}

vec3 ray_bounces(vec3 position_ws, vec3 normal_ws, vec3 albedo, vec3 direction, float u)
{
    if (albedo.r >= 0.0) {
        return albedo * volume_light(position_ws, normal_ws, -direction, normal_ws);
    }
    // The finest grid that has the point well inside.
    int k = LPV_GRIDS - 1;
    for (int i = 0; i < LPV_GRIDS; ++i) {
        use_grid(k);
        k -= k > 0 && grid_share((position_ws - grid_origin) / grid_cell) < 0.5 ? 1 : 0;
    }
    vec3 at = (position_ws - grid_origin) / grid_cell;
    vec3 n, place;
    if (!wall_near(at, direction, place, n, albedo)) {
        return vec3(0.0);
    }
    at -= n * dot(at - place, n);
    return albedo * volume_irradiance(volume_in_front(at, n, -direction), n);
}
