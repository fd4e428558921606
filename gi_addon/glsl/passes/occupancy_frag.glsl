// Cells that surfaces pass through. The scene is drawn along each axis over one pixel a cell; a triangle counts in the
// view that it faces most, where its depth changes by less than a cell and a half within a pixel, so that no hole opens.

#if SURFACE_FULL
#include "surface/surface_point.glsl"
#else
in vec3 vary_position_ws;
#endif

layout(binding = 0, r8) writeonly uniform image3D occupied_cells;

void main()
{
    vec3 at = (vary_position_ws - cell_origin_ws) / cell_size;
    vec3 dx = dFdx(at);
    vec3 dy = dFdy(at);
    vec3 facing = abs(cross(dx, dy));
    float along = facing[dominant];
#if SURFACE_FULL
    // A surface that lets half of the light through or more does not count. It is seen from its front: a wall whose back is
    // cut away is a wall.
    vec3 ng = safe_normalize(cross(dFdx(vary_position_ws), dFdy(vary_position_ws)));
    vec3 front = dot(vary_normal_ws, ng) < 0.0 ? -ng : ng;
    if (surface_opacity(surface_closure(surface_point(front))) < 0.5) {
        discard;
    }
#endif
    if (along < max(facing.x, max(facing.y, facing.z))) {
        discard;
    }
    float reach = 0.5 * (abs(dx[dominant]) + abs(dy[dominant]));
    ivec3 cell = ivec3(floor(at));
    int low = int(floor(at[dominant] - reach));
    int high = int(floor(at[dominant] + reach));
    for (int k = 0; k < 4; ++k) {
        cell[dominant] = low + k;
        if (low + k <= high) {
            imageStore(occupied_cells, cell, vec4(1.0));
        }
    }
}
