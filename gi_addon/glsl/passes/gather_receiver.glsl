// The surface that a block of the low-resolution gather stands for. Included after view_lib, math_lib and sequence_lib, where the
// low-resolution G-buffer is declared.

#include "passes/gather_grid.glsl"
#include "passes/receiver.glsl"

Receiver gather_receiver(ivec2 block)
{
    ivec2 pixel = gather_grid_pixel(block, texelFetch(low_pixel, block, 0).rg);
    return receiver_of(pixel, texelFetch(low_depth, block, 0).r, texelFetch(low_normal, block, 0));
}
