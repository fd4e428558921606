// Light on a surface by a set of cones. Included where `voxel_radiance`, the grid and `cone_count` are declared, after
// view_lib and sequence_lib.
//
// N cones of weight π/N each: directions on N rings of equal area of the unit disc, lifted to the hemisphere, are
// cosine-distributed (Malley's method), and weights sum to π. Each cone is as wide as its share: a cone of half angle θ has
// projected solid angle π sin²θ = π/N. Their places turn and shift with the sub-frames, so that all of these
// together are one finer set, and each may be narrower.

#include "engines/vct/cone_lib.glsl"

const float GOLDEN_ANGLE = 2.39996322972865; // π (3 − √5)

struct Gathered {
    vec3 radiance;    // E/π, W/(m²·sr)
    vec4 direction;   // Σ luminance × direction; Σ luminance, per direction
    float open_;      // share of the hemisphere, by cosine, that nothing blocks within reach
};

Grid voxel_grid() { return Grid(grid_low, grid_cell, vec3(grid_size), grid_levels); }

// `reach` in m.
Gathered gather_cones(vec3 position_ws, vec3 n, vec3 ng, float reach, int count)
{
    Gathered g = Gathered(vec3(0.0), vec4(0.0), 0.0);
    Grid grid = voxel_grid();
    mat3 frame = frame_from_normal(n);
    vec3 start = (position_ws - grid.low) / grid.cell;
    Departure from = cone_departure(voxel_facing, start, ng);
    start += ng * from.above;
    vec2 shift = view.subframes > 1u ? sobol_2d(view.subframe, 40u) : vec2(0.5);
    float phase = view.subframes > 1u ? sobol_2d(view.subframe, 41u).x : 0.0;
    // Neighbours turn their sets apart, in steps that 4 × 4 of them fill: what one set misses is no streak.
    uvec2 place = uvec2(gl_FragCoord.xy) & 3u;
    shift.y += float(place.x + 4u * place.y) / 16.0;
    float sin_half = inversesqrt(float(count) * cone_sharpness);
    float spread = sin_half * inversesqrt(max(1.0 - sin_half * sin_half, 1e-4));
    for (int i = 0; i < count; ++i) {
        float r2 = (float(i) + shift.x) / float(count);
        float phi = GOLDEN_ANGLE * float(i) + TAU * shift.y;
        vec3 d = frame * vec3(sqrt(r2) * vec2(cos(phi), sin(phi)), sqrt(1.0 - r2));
        if (dot(d, ng) <= 0.0) {
            continue; // into the triangle
        }
        ConeResult cone = trace_cone(voxel_radiance, voxel_back, voxel_opacity, grid, start, d, spread, from.above,
                                     reach / grid.cell, ng, from.above, from.leaving, phase);
        g.radiance += cone.radiance;
        g.open_ += cone.transmittance;
        g.direction += vec4(d, 1.0) * (luminance(cone.radiance) / max(sqrt(1.0 - r2), sin_half));
    }
    g.radiance /= float(count);
    g.open_ /= float(count);
    return g;
}
