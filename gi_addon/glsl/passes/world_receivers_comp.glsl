// Points that the camera sees, from rays through the grid of cells: the last free place before a surface.

#include "lib/view_lib.glsl"
#include "lib/occupancy_lib.glsl"
#include "lib/sequence_lib.glsl"

layout(local_size_x = 64) in;

void main()
{
    int index = int(gl_GlobalInvocationID.x);
    if (index >= GUIDE_RECEIVERS) {
        return;
    }
    vec2 uv = sobol_2d(uint(index), 31u);
    vec3 origin = ray_origin_ws(uv);
    vec3 direction = normalize(ray_direction_ws(uv));
    float distance_ = cells_distance(origin, direction);
    // Half a cell back: a ray that starts on the border of a solid cell would take it for its own.
    vec3 point = origin + direction * max(distance_ - 0.5 * cell_size, 0.0);
    world_receivers[index] = vec4(point, distance_ > 0.0 ? 1.0 : 0.0);
}
