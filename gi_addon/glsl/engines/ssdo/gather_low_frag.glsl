// Light from the screen at each block's representative pixel.

#include "engines/ssdo/gather_lib.glsl"
#include "passes/gather_grid.glsl"

void main()
{
    ivec2 block = ivec2(gl_FragCoord.xy);
    float depth = texelFetch(low_depth, block, 0).r;
    raw_indirect = vec4(0.0);
    raw_direction = vec4(0.0);
    if (depth <= 0.0) {
        return;
    }
    ivec2 pixel = gather_grid_pixel(block, texelFetch(low_pixel, block, 0).rg);
    vec2 uv = (vec2(pixel) + 0.5) * view.inverse_resolution;
    vec4 normals = texelFetch(low_normal, block, 0);
    Gathered g = gather_screen(position_ws_from_depth(uv, depth), octahedral_decode(normals.xy), octahedral_decode(normals.zw),
                               view_direction_ws(uv), block);
    raw_indirect = vec4(g.radiance, 1.0);
    raw_direction = g.direction;
}
