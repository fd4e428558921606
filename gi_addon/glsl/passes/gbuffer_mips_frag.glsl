// A block's representative pixel: the nearest surface in even blocks of a checkerboard, the farthest in odd ones.
// The paper builds averaging mipmaps (Figure 4); a mean of two surfaces is neither. The grid of blocks moves with the
// sub-frames, so that nothing of it is seen in their mean.

#include "lib/view_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "passes/gather_grid.glsl"

void main()
{
    ivec2 view_block_offset = gather_grid_offset();
    ivec2 block = ivec2(gl_FragCoord.xy);
    ivec2 size = textureSize(gbuf_depth, 0);
    bool nearest = ((block.x + block.y) & 1) == 0;
    float best = 0.0;
    ivec2 pick = ivec2(0);
    for (int y = 0; y < GATHER_SCALE; ++y) {
        for (int x = 0; x < GATHER_SCALE; ++x) {
            // Start from the block's middle, so that a flat block picks that.
            ivec2 p = (ivec2(x, y) + GATHER_SCALE / 2) % GATHER_SCALE;
            ivec2 pixel = block * GATHER_SCALE + p - view_block_offset;
            if (any(lessThan(pixel, ivec2(0))) || any(greaterThanEqual(pixel, size))) {
                continue;
            }
            float depth = texelFetch(gbuf_depth, pixel, 0).r;
            if (depth <= 0.0) {
                continue;
            }
            // Within 1 % of the best so far is the same surface: the middle stays.
            bool better = nearest ? depth < best * 0.99 : depth > best * 1.01;
            if (best <= 0.0 || better) {
                best = depth;
                pick = p;
            }
        }
    }
    low_depth = best;
    low_normal = texelFetch(gbuf_normal, clamp(block * GATHER_SCALE + pick - view_block_offset, ivec2(0), size - 1), 0);
    low_pixel = (vec2(pick) + 0.5) / float(GATHER_SCALE);
}
