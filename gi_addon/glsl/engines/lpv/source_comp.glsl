// Injected sums as intensity over the cell's face, Q/h² in W/(m²·sr): the unit of radiance, the same at any scale of scene.

#include "engines/lpv/lpv_lib.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

void main()
{
    ivec3 at = ivec3(gl_GlobalInvocationID); // z: cell and coefficient
    if (any(greaterThanEqual(at, grid_size * ivec3(1, 1, SH_COUNT)))) {
        return;
    }
    int coefficient = at.z / grid_size.z;
    ivec3 cell = ivec3(at.xy, at.z - coefficient * grid_size.z);
    int base = (cell_index(cell, grid_size) * SH_COUNT + coefficient) * 3;
    vec3 value = vec3(lpv_flux[base], lpv_flux[base + 1], lpv_flux[base + 2]) / (fixed_scale * grid_cell * grid_cell);
    if (first_group == 0) {
        value += imageLoad(lpv_source, volume_texel(at, 0)).rgb;
    }
    imageStore(lpv_source, volume_texel(at, 0), vec4(value, 0.0));
}
