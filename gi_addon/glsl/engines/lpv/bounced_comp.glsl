// The volume's sources of the next round: the lights' own first bounce, and what the walls reflect and the air scatters of all
// light so far.

#include "engines/lpv/lpv_lib.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

void main()
{
    ivec3 at = ivec3(gl_GlobalInvocationID); // z: cell and coefficient
    if (any(greaterThanEqual(at, grid_size * ivec3(1, 1, SH_COUNT)))) {
        return;
    }
    int coefficient = at.z / grid_size.z;
    int base = (cell_index(ivec3(at.xy, at.z - coefficient * grid_size.z), grid_size) * SH_COUNT + coefficient) * 3;
    vec3 reflected = vec3(lpv_reflected[base], lpv_reflected[base + 1], lpv_reflected[base + 2]);
    vec3 sum = source_scale * texelFetch(lpv_source, volume_texel(at, 0), 0).rgb + reflected / (fixed_scale * grid_cell * grid_cell);
#if HAS_LPV_AIR
    // Q/h² = h³ σs ∫ p L dω / h².
    vec4 air = texelFetch(lpv_air, volume_texel(ivec3(at.xy, at.z - coefficient * grid_size.z), 1), 0);
    sum += air.rgb * (grid_cell * phase_share(coefficient, air.a)) * imageLoad(lpv_volume, volume_texel(at, 0)).rgb;
#endif
    imageStore(lpv_bounced, volume_texel(at, 0), vec4(sum, 0.0));
}
