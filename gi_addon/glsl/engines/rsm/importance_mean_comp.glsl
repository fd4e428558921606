// What each watt of a block is worth to those who see it.
//
// Best for one receiver j is to draw blocks i by f_ij, their shares of all that it gets: then every sample sends it alike. Many
// receivers share the virtual lights: I_i = mean_j (f_ij / Σ_i f_ij) / F_i, each receiver counting alike, however dark: errors tell by
// what is there.

#include "engines/rsm/rsm_lib.glsl"
#include "engines/rsm/blocks_lib.glsl"

layout(local_size_x = 64) in;

void main()
{
    int i = int(gl_GlobalInvocationID.x);
    ivec2 size = textureSize(rsm_flux, BLOCK_LEVEL);
    if (i >= size.x * size.y) {
        return;
    }
    ivec2 block = ivec2(i % size.x, i / size.x);
    int light = block_light(block);
    float flux = texelFetch(rsm_flux, block, BLOCK_LEVEL).r;
    float mean = 0.0;
    // Points of the world and of emissive meshes are elsewhere in each sub-frame, and their blocks show something else.
    if (light >= 0 && rsm_lights[light].kind != LIGHT_WORLD && rsm_lights[light].kind != LIGHT_MESH && flux > 0.0) {
        for (int j = 0; j < RECEIVERS; ++j) {
            float total = importance_total[light * RECEIVERS + j];
            mean += total > 0.0 ? importance_sent[i * RECEIVERS + j] / total : 0.0;
        }
        mean /= float(RECEIVERS) * flux;
    }
    importance[i] = mean;
}
