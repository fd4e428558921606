// The rays' difference at each block's representative pixel.

#include "lib/view_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "passes/gather_grid.glsl"
#include "passes/world_rays.glsl"

void main()
{
    ivec2 block = ivec2(gl_FragCoord.xy);
    float depth = texelFetch(low_depth, block, 0).r;
    low_rays = vec4(0.0);
    if (depth > 0.0) {
        vec2 uv = (vec2(gather_grid_pixel(block, texelFetch(low_pixel, block, 0).rg)) + 0.5) * view.inverse_resolution;
        vec4 normals = texelFetch(low_normal, block, 0);
        low_rays = vec4(world_rays_difference(position_ws_from_depth(uv, depth), octahedral_decode(normals.xy),
                                              octahedral_decode(normals.zw)), 1.0);
    }
}
