// Σ_i f_ij over the blocks of one light: what its map sends to each receiver, W.

#include "engines/rsm/rsm_lib.glsl"
#include "engines/rsm/blocks_lib.glsl"

layout(local_size_x = 64) in;

void main()
{
    int k = int(gl_GlobalInvocationID.x);
    if (k >= light_count * RECEIVERS) {
        return;
    }
    ivec2 size = textureSize(rsm_flux, BLOCK_LEVEL);
    float sum = 0.0;
    for (int i = 0; i < size.x * size.y; ++i) {
        if (block_light(ivec2(i % size.x, i / size.x)) == k / RECEIVERS) {
            sum += importance_sent[i * RECEIVERS + k % RECEIVERS];
        }
    }
    importance_total[k] = sum;
}
