// The volume's sources of the next round: the lights' own first bounce, and what the walls reflect of all light so far.

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
    imageStore(lpv_bounced, at, vec4(texelFetch(lpv_source, at, 0).rgb + reflected / (fixed_scale * grid_cell * grid_cell), 0.0));
}
