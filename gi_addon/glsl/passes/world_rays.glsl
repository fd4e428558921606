// Diffuse light of the world by rays through the cells: that of many directions, less that of the few with shadow maps, as
// the radiance a white Lambert surface would reflect, W/(m²·sr). Both are the same integral over the cells' visibility,
// so the expectation is zero. Included where `world_rays` and the cells are declared.

#include "lib/math_lib.glsl"
#include "lib/occupancy_lib.glsl"
#if HAS_MEDIUM
#include "lib/medium_lib.glsl"
#endif

vec3 world_rays_difference(vec3 position_ws, vec3 n, vec3 ng)
{
    vec3 start_ws = cells_clear(position_ws, ng);
    vec3 sum = vec3(0.0);
    for (int i = 0; i < WORLD_RAYS; ++i) {
        vec3 l = world_rays[i].direction_ws;
        float cos_l = dot(n, l);
        if (cos_l > 0.0 && dot(ng, l) > 0.0 && cells_open(start_ws, l)) {
            vec3 arriving = world_rays[i].emission;
#if HAS_MEDIUM
            arriving *= medium_transmittance(position_ws, l, 1e30);
#endif
            sum += cos_l * arriving;
        }
    }
    return sum * INV_PI;
}
