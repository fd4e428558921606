// Indirect light at each block's representative pixel, by cones.

#include "lib/view_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "passes/gather_grid.glsl"
#include "engines/vct/diffuse_lib.glsl"

void main()
{
    ivec2 block = ivec2(gl_FragCoord.xy);
    float depth = texelFetch(low_depth, block, 0).r;
    raw_indirect = vec4(0.0);
    raw_direction = vec4(0.0);
    if (depth <= 0.0) {
        return;
    }
    vec2 uv = (vec2(gather_grid_pixel(block, texelFetch(low_pixel, block, 0).rg)) + 0.5) * view.inverse_resolution;
    vec4 normals = texelFetch(low_normal, block, 0);
    Gathered g = gather_cones(position_ws_from_depth(uv, depth), octahedral_decode(normals.xy),
                              octahedral_decode(normals.zw));
    raw_indirect = vec4(g.radiance, g.distance_);
    raw_direction = g.direction;
}
