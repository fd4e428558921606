// Looking up the volume at a surface. Included where `lpv_volume` and, if there is one, `lpv_walls` are declared.
//
// The volume holds radiance by direction of travel, coefficients L_lm. Irradiance on a surface of normal n counts light that
// travels against n with its cosine: E(n) = ∫ L(ω) max(−ω·n, 0) dω = π Σ_lm share(l) L_lm Y_lm(−n), the cosine lobe's
// coefficients over π being share(l) Y_lm. So E/π, what a white Lambert surface reflects, is the plain sum.

#include "engines/lpv/geometry_lib.glsl"

struct VolumeSample {
    vec3 sh[SH_COUNT];
    float weight; // of the eight cells, how much stands on the open side of the walls
};

// The i-th of the eight cells around grid point `at` and its trilinear weight, 0 outside of the grid.
float corner_weight(int i, vec3 at, out ivec3 cell)
{
    vec3 base = floor(at - 0.5);
    vec3 f = at - 0.5 - base;
    ivec3 corner = ivec3(i & 1, (i >> 1) & 1, i >> 2);
    cell = ivec3(base) + corner;
    vec3 t = mix(1.0 - f, f, vec3(corner));
    return inside_grid(cell, grid_size) ? t.x * t.y * t.z : 0.0;
}

// The eight cells around grid point `at`, trilinear; a cell behind the tangent plane of `surface` (a grid point, unit normal
// `n`) does not count, nor one behind a wall that stands between `at` and its layer, in its own column or in the one of `at`.
VolumeSample volume_sample(vec3 at, vec3 surface, vec3 n)
{
    VolumeSample s;
    for (int c = 0; c < SH_COUNT; ++c) {
        s.sh[c] = vec3(0.0);
    }
    s.weight = 0.0;
    for (int i = 0; i < 8; ++i) {
        ivec3 cell;
        float weight = corner_weight(i, at, cell);
        if (weight <= 0.0) {
            continue;
        }
        // From the plane to half a cell in front of it, so that no cell appears at once.
        weight *= saturate(2.0 * dot(vec3(cell) + 0.5 - surface, n));
#if HAS_LPV_WALLS
        weight *= open_way(at, cell);
#endif
        if (weight > 0.0) {
            for (int c = 0; c < SH_COUNT; ++c) {
                s.sh[c] += weight * texelFetch(lpv_volume, volume_texel(cell, c), 0).rgb;
            }
            s.weight += weight;
        }
    }
    float scale = s.weight > 0.0 ? 1.0 / s.weight : 0.0;
    for (int c = 0; c < SH_COUNT; ++c) {
        s.sh[c] *= scale;
    }
    return s;
}

// Σ L_lm weights_lm at grid point `at` of the air, and how much of the eight cells around is not behind a wall.
vec4 air_sample(vec3 at, float weights[SH_COUNT])
{
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 8; ++i) {
        ivec3 cell;
        float weight = corner_weight(i, at, cell);
        if (weight <= 0.0) {
            continue;
        }
#if HAS_LPV_WALLS
        weight *= open_way(at, cell);
#endif
        if (weight > 0.0) {
            vec3 value = vec3(0.0);
            for (int c = 0; c < SH_COUNT; ++c) {
                value += weights[c] * texelFetch(lpv_volume, volume_texel(cell, c), 0).rgb;
            }
            sum += weight * vec4(value, 1.0);
        }
    }
    return sum;
}

// Σ L_lm weights_lm at a point of the air, in the finest grid around it (volume_light).
vec3 volume_along(vec3 position_ws, float weights[SH_COUNT])
{
    vec3 sum = vec3(0.0);
    float rest = 1.0;
    for (int k = LPV_GRIDS - 1; k >= 0; --k) {
        use_grid(k);
        vec3 at = (position_ws - grid_origin) / grid_cell;
        float share = k == 0 ? 1.0 : grid_share(at);
        if (rest * share > 0.0) {
            vec4 s = air_sample(at, weights);
            if (s.a > 0.0) {
                sum += rest * share * s.rgb / s.a;
                rest *= 1.0 - share;
            }
        }
    }
    return max(sum, vec3(0.0)); // harmonics of order 2 go below 0 as in volume_irradiance
}

// Half a cell in front of a surface at grid point `surface` seen from `eye` (unit vector towards it); cells behind it count
// nothing, so it need not be farther off for walls at an angle. What the eye sees is on the open side
// of all walls, which a point on an edge would not tell: it is moved to the eye so far that walls, whose places are rounded to
// 1/255, are passed by lines of sight 5° and more off them.
VolumeSample volume_in_front(vec3 surface, vec3 ng, vec3 eye)
{
    return volume_sample(surface + ng * 0.5 + eye * 0.05, surface, ng); // 1/255 / sin 5° = .045
}

// E/π on a surface of unit normal n. Harmonics of order 2 of light from a side go below 0 behind it by a few per cent.
vec3 volume_irradiance(VolumeSample s, vec3 n)
{
    float y[SH_COUNT];
    sh_basis(-n, y);
    vec3 sum = vec3(0.0);
    for (int c = 0; c < SH_COUNT; ++c) {
        sum += s.sh[c] * (sh_cosine_share(c) * y[c]);
    }
    return max(sum, vec3(0.0));
}

// E/π on a surface at `position_ws` of geometric normal `ng` and shading normal `n`, seen from `eye`: of the finest grid around
// it, and of the next ones as far as it is in that one's rim, or no cell of it is on the open side of the walls.
vec3 volume_light(vec3 position_ws, vec3 ng, vec3 eye, vec3 n)
{
    vec3 sum = vec3(0.0);
    float rest = 1.0;
    for (int k = LPV_GRIDS - 1; k >= 0; --k) {
        use_grid(k);
        vec3 at = (position_ws - grid_origin) / grid_cell;
        float share = k == 0 ? 1.0 : grid_share(at);
        if (rest * share > 0.0) {
            VolumeSample s = volume_in_front(at, ng, eye);
            if (s.weight > 0.0) {
                sum += rest * share * volume_irradiance(s, n);
                rest *= 1.0 - share;
            }
        }
    }
    return sum;
}
