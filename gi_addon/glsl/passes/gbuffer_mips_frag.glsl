// A block's representative pixel: the nearest surface in even blocks of a checkerboard, the farthest in odd ones.
// The paper builds averaging mipmaps (Figure 4); a mean of two surfaces is neither. The grid of blocks moves with the
// sub-frames, so that nothing of it is seen in their mean.

#include "lib/view_lib.glsl"
#include "lib/math_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "passes/gather_grid.glsl"

// The n-th number of a block's 0 … GATHER_SCALE − 1, from its middle outwards.
ivec2 outwards(ivec2 n)
{
    return GATHER_SCALE / 2 + (n + 1) / 2 * (1 - 2 * (n & 1));
}

void main()
{
    ivec2 view_block_offset = gather_grid_offset();
    ivec2 block = ivec2(gl_FragCoord.xy);
    ivec2 size = textureSize(gbuf_depth, 0);
    bool nearest = ((block.x + block.y) & 1) == 0;
    float best = 0.0;
    vec3 best_ws = vec3(0.0);
    vec3 best_ng = vec3(0.0);
    ivec2 pick = ivec2(0);
    for (int y = 0; y < GATHER_SCALE; ++y) {
        for (int x = 0; x < GATHER_SCALE; ++x) {
            // Outwards from the block's middle, so that a flat block picks that, and others what is near it.
            ivec2 p = outwards(ivec2(x, y));
            ivec2 pixel = block * GATHER_SCALE + p - view_block_offset;
            if (any(lessThan(pixel, ivec2(0))) || any(greaterThanEqual(pixel, size))) {
                continue;
            }
            float depth = texelFetch(gbuf_depth, pixel, 0).r;
            if (depth <= 0.0) {
                continue;
            }
            vec3 position_ws = position_ws_from_depth((vec2(pixel) + 0.5) * view.inverse_resolution, depth);
            // On the plane of the best so far by interpolate.glsl's measure is the same surface: the middle stays, slanted or not,
            // since that is where interpolation takes the block's light to be.
            bool same = abs(dot(position_ws - best_ws, best_ng)) <= 0.5 * float(GATHER_SCALE) * pixel_width(depth);
            if (best <= 0.0 || (!same && (nearest ? depth < best : depth > best))) {
                best = depth;
                best_ws = position_ws;
                best_ng = octahedral_decode(texelFetch(gbuf_normal, pixel, 0).zw);
                pick = p;
            }
        }
    }
    low_depth = best;
    low_normal = texelFetch(gbuf_normal, clamp(block * GATHER_SCALE + pick - view_block_offset, ivec2(0), size - 1), 0);
    low_pixel = (vec2(pick) + 0.5) / float(GATHER_SCALE);
}
