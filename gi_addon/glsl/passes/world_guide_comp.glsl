// How many of the visible points see a bin of the sky: each tests a direction of its own in the bin.

#include "lib/math_lib.glsl"
#include "lib/occupancy_lib.glsl"
#include "lib/sequence_lib.glsl"

layout(local_size_x = 64) in;

void main()
{
    int index = int(gl_GlobalInvocationID.x);
    int bin = int(gl_GlobalInvocationID.y);
    vec4 receiver = world_receivers[index];
    vec2 within = sobol_2d(uint(index), uint(bin) + 977u);
    float elevation = (float(bin / GUIDE_COLUMNS) + within.y) / float(GUIDE_ROWS) * PI - 0.5 * PI;
    // Blender's equirectangular convention, gi_addon/world_map.py.
    float azimuth = 2.0 * PI * (0.5 - (float(bin % GUIDE_COLUMNS) + within.x) / float(GUIDE_COLUMNS));
    vec3 direction = vec3(cos(elevation) * cos(azimuth), cos(elevation) * sin(azimuth), sin(elevation));
    if (receiver.w > 0.5 && cells_distance(receiver.xyz, direction) < 0.0) {
        atomicAdd(world_guide[bin], 1u);
    }
}
