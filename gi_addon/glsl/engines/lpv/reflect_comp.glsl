// A bounce: what the walls reflect of the light in the volume, summed into cells as the RSMs' texels are (inject_comp.glsl).
// (Kaplanyan and Dachsbacher 2010, §3.5, bounce light in the propagation itself; here it goes from wall to wall.)
//
// A wall that blocks the share κ of a column of axis a is κ h² across the axis and κ h²/|n_a| of area; over the faces of all
// three axes that would count it |n|₁ times, which `lpv_albedo` has been divided by. So a wall reflects albedo × E(n) × its own
// area on each side, and no bounce can bring back more than the albedo.

#include "engines/lpv/geometry_lib.glsl"
#include "lib/sequence_lib.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

void main()
{
    ivec3 upper = ivec3(gl_GlobalInvocationID);
    if (!inside_grid(upper, grid_size)) {
        return;
    }
    for (int i = 0; i < 6; ++i) {
        int axis = i >> 1;
        int face = face_index(upper, axis);
        vec4 wall = lpv_walls[face];
        vec3 albedo = uintBitsToFloat(uvec3(lpv_albedo[face * 3], lpv_albedo[face * 3 + 1], lpv_albedo[face * 3 + 2]));
        if (wall.x <= 0.0 || upper[axis] == 0 || max3(albedo) <= 0.0) {
            continue;
        }
        vec3 n = normalize(wall_normal(wall, axis)) * ((i & 1) == 1 ? -1.0 : 1.0);
        vec3 place = vec3(upper) + 0.5;
        place[axis] += wall.y - 1.0;
        ivec3 cell = cell_in_front(place, n, grid_size);
        float y[SH_COUNT];
        sh_basis(n, y);
        vec3 irradiance = vec3(0.0);
        for (int c = 0; c < SH_COUNT; ++c) {
            // Y(−n): order 1 changes sign.
            vec3 light = imageLoad(lpv_volume, volume_texel(cell, c)).rgb;
            irradiance += light * (PI * sh_cosine_share(c) * (c >= 1 && c <= 3 ? -y[c] : y[c]));
        }
        vec3 flux = albedo * max(irradiance, vec3(0.0)) * (wall.x * grid_cell * grid_cell);
        int base = cell_index(cell, grid_size) * SH_COUNT * 3;
        float dither = unit_float(hash_u32(uvec2(face, i)));
        for (int c = 0; c < SH_COUNT; ++c) {
            vec3 units = floor(flux * (sh_cosine_share(c) * y[c] * fixed_scale) + dither);
            for (int k = 0; k < 3; ++k) {
                if (units[k] != 0.0) {
                    atomicAdd(lpv_reflected[base + c * 3 + k], int(units[k]));
                }
            }
        }
    }
}
