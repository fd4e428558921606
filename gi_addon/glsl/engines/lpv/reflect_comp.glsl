// A bounce: what the walls reflect of the light that came to an end at them, summed into cells as the RSMs' texels are
// (inject_comp.glsl). (Kaplanyan and Dachsbacher 2010, §3.5, bounce light in the propagation itself; here it goes from wall to
// wall.)
//
// A cell's walls share what the cell has absorbed (propagate_comp.glsl) by κ E(n), and each reflects its albedo of it. So the
// flux of a bounce is that of the one before times the albedo, however a wall's steps lie: their area, and E in front of them,
// are right to some per cent only (a sphere's 1.01 times each in 32 cells).

#include "engines/lpv/geometry_lib.glsl"
#include "lib/sequence_lib.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

// Normal of face i of a cell (low and high side of each axis), turned to the cell.
vec3 facing(vec4 wall, int i) { return normalize(wall_normal(wall, i >> 1)) * ((i & 1) == 1 ? -1.0 : 1.0); }

void main()
{
    ivec3 from = ivec3(gl_GlobalInvocationID);
    if (!inside_grid(from, grid_size)) {
        return;
    }
    vec3 ended = imageLoad(lpv_absorbed, volume_texel(from, 0)).rgb;
    if (max3(ended) <= 0.0) {
        return;
    }
    float share[6];
    float whole = 0.0;
    for (int i = 0; i < 6; ++i) {
        ivec3 upper = from;
        upper[i >> 1] += i & 1;
        share[i] = 0.0;
        if (upper[i >> 1] > 0 && inside_grid(upper, grid_size)) {
            vec4 wall = lpv_walls[face_index(upper, i >> 1)];
            if (wall.x > 0.0) {
                float y[SH_COUNT];
                sh_basis(-facing(wall, i), y);
                vec3 irradiance = vec3(0.0);
                for (int c = 0; c < SH_COUNT; ++c) {
                    irradiance += imageLoad(lpv_volume, volume_texel(from, c)).rgb * (PI * sh_cosine_share(c) * y[c]);
                }
                // What ends at a wall that by its harmonics has no light is shared by area.
                share[i] = wall.x * max(vector_mean(irradiance), 1e-6 * vector_mean(ended));
                whole += share[i];
            }
        }
    }
    for (int i = 0; i < 6; ++i) {
        int axis = i >> 1;
        ivec3 upper = from;
        upper[axis] += i & 1;
        int face = face_index(upper, axis);
        if (share[i] <= 0.0) {
            continue;
        }
        vec4 wall = lpv_walls[face];
        vec3 n = facing(wall, i);
        vec3 albedo = uintBitsToFloat(uvec3(lpv_albedo[face * 3], lpv_albedo[face * 3 + 1], lpv_albedo[face * 3 + 2]));
        vec3 place = vec3(upper) + 0.5;
        place[axis] += wall.y - 1.0;
        ivec3 cell = cell_in_front(place, n, grid_size);
        vec3 flux = albedo * ended * (share[i] / whole * grid_cell * grid_cell);
        float y[SH_COUNT];
        sh_basis(n, y);
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
