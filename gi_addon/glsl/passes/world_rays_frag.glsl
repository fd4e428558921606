// Diffuse light of the world by rays through the cells: that of many directions, less that of the few with shadow maps, as
// the radiance a white Lambert surface would reflect, W/(m²·sr). Both sample one integral over the cells' visibility, so
// the expectation is zero.

#include "lib/view_lib.glsl"
#include "lib/math_lib.glsl"
#include "lib/occupancy_lib.glsl"
#if HAS_MEDIUM
#include "lib/medium_lib.glsl"
#endif

void main()
{
    float depth = texelFetch(gbuf_depth, ivec2(gl_FragCoord.xy), 0).r;
    world_difference = vec4(0.0);
    if (depth <= 0.0) {
        return;
    }
    vec3 position_ws = position_ws_from_depth(gl_FragCoord.xy * view.inverse_resolution, depth);
    vec4 normals = texelFetch(gbuf_normal, ivec2(gl_FragCoord.xy), 0);
    vec3 n = octahedral_decode(normals.xy);
    vec3 ng = octahedral_decode(normals.zw);
    vec3 start_ws = cells_clear(position_ws, ng);
    vec3 tangent = normalize(cross(ng, abs(ng.z) < 0.9 ? vec3(0.0, 0.0, 1.0) : vec3(1.0, 0.0, 0.0))) * cell_size;
    vec3 bitangent = cross(ng, tangent);
    vec3 sum = vec3(0.0);
    for (int i = 0; i < ray_count; ++i) {
        WorldRay ray = world_rays[i];
        float cos_l = dot(n, ray.direction_ws);
        if (cos_l > 0.0 && dot(ng, ray.direction_ws) > 0.0 &&
            cells_open(start_ws + tangent * ray.shift_x + bitangent * ray.shift_y, ray.direction_ws)) {
            vec3 arriving = ray.emission;
#if HAS_MEDIUM
            arriving *= medium_transmittance(position_ws, ray.direction_ws, 1e30);
#endif
            sum += cos_l * arriving;
        }
    }
    world_difference = vec4(sum * INV_PI, 1.0);
}
