// Harmonics of the radiance in each cell, ∫ L Y dω, by the ordinates' quadrature, and the flux that its walls absorb, over h².

#include "engines/lpv/transport_lib.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    if (!inside_grid(cell, grid_size)) {
        return;
    }
    vec3 sum[SH_COUNT];
    for (int c = 0; c < SH_COUNT; ++c) {
        sum[c] = batch_first == 0 ? vec3(0.0) : imageLoad(lpv_volume, volume_texel(cell, c)).rgb;
    }
#if HAS_LPV_ABSORBED
    vec3 absorbed = batch_first == 0 ? vec3(0.0) : imageLoad(lpv_absorbed, volume_texel(cell, 0)).rgb;
    // A rim's light goes on whole (rim_comp.glsl), and ends in the grid around.
    bool absorbs = walled(cell) && !in_rim(cell, grid_size, grid_rim);
#endif
    for (int i = 0; i < batch_count; ++i) {
        vec4 carried = imageLoad(lpv_radiance, volume_texel(cell, i));
        vec3 value = carried.rgb;
        vec4 ordinate = ordinates[batch_first + i];
        float y[SH_COUNT];
        sh_basis(ordinate.xyz, y);
        for (int c = 0; c < SH_COUNT; ++c) {
            sum[c] += value * (ordinate.w * y[c]);
        }
#if HAS_LPV_ABSORBED
        if (absorbs) {
            vec3 covered;
            absorbed += value * (ordinate.w * way_through(cell, ordinate.xyz, covered).taken);
        }
#endif
    }
#if HAS_LPV_ABSORBED
    imageStore(lpv_absorbed, volume_texel(cell, 0), vec4(absorbed, 0.0));
#endif
    for (int c = 0; c < SH_COUNT; ++c) {
        imageStore(lpv_volume, volume_texel(cell, c), vec4(sum[c], 0.0));
    }
}
