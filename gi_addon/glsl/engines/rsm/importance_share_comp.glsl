// The chance of each block of RSM texels to hold a virtual light, in W: all blocks of a light have its flux together.
//
// Of a light's virtual lights a share β is drawn by flux alone, the others by flux × importance (importance_mean_comp.glsl):
// W_i = β F_i + (1 − β) F_i I_i ΣF/ΣFI, sums over the light's blocks. The first (T. Hesterberg, "Weighted Average Importance
// Sampling and Defensive Mixture Distributions", Technometrics 37(2), 1995) bounds what a sample stands for by 1/β of what flux alone
// gives, whatever the few receivers did not see, or has moved since. Samples are divided by their chance: right in the mean.

#include "engines/rsm/rsm_lib.glsl"
#include "engines/rsm/blocks_lib.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

const float DEFENSIVE_SHARE = 0.5;

void main()
{
    ivec2 block = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = imageSize(rsm_importance);
    if (any(greaterThanEqual(block, size))) {
        return;
    }
    int light = block_light(block);
    float all = 0.0;
    float worth = 0.0;
    for (int i = 0; i < size.x * size.y; ++i) {
        ivec2 other = ivec2(i % size.x, i / size.x);
        float flux = block_light(other) == light ? texelFetch(rsm_flux, other, BLOCK_LEVEL).r : 0.0;
        all += flux;
        worth += flux * importance[i];
    }
    float flux = texelFetch(rsm_flux, block, BLOCK_LEVEL).r;
    float drawn = worth > 0.0 ? importance[block.y * size.x + block.x] * all / worth : 1.0;
    imageStore(rsm_importance, block, vec4(flux * mix(drawn, 1.0, DEFENSIVE_SHARE)));
}
