// Ambient occlusion by cones (paper §V-D): the cosine-weighted share of directions in which nothing lies within
// ao_distance, Cycles' meaning.

#include "lib/view_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "engines/vct/diffuse_lib.glsl"

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float depth = texelFetch(gbuf_depth, pixel, 0).r;
    ao = vec2(0.0); // Cycles' pass is black where nothing is
    if (depth <= 0.0) {
        return;
    }
    vec3 position_ws = position_ws_from_depth(gl_FragCoord.xy * view.inverse_resolution, depth);
    vec4 normals = texelFetch(gbuf_normal, pixel, 0);
    vec3 n = octahedral_decode(normals.xy);
    vec3 ng = octahedral_decode(normals.zw);
    mat3 frame = frame_from_normal(n);
    Grid grid = voxel_grid();
    Cone cone = surface_cone(grid, position_ws, ng, n, 0.0, ao_distance);
    uint run = cone_run(ivec2(0));
    float open_ = 0.0;
    for (int i = 0; i < cone_count; ++i) {
        cone.direction = frame * cone_direction(run + uint(i));
        if (dot(cone.direction, ng) > 0.0) {
            open_ += trace_open(voxel_sheets, voxel_rows, voxel_kinds, grid, cone);
        }
    }
    ao = vec2(open_ / float(cone_count), 1.0);
}
