// Light on a surface by a set of cones. Included where `voxel_radiance`, the grid and `cone_count` are declared, after
// view_lib and sequence_lib.
//
// N cones of weight π/N each: directions on N rings of equal area of the unit disc, lifted to the hemisphere, are
// cosine-distributed (Malley's method), and weights sum to π. Each cone is as wide as its share: a cone of half angle θ has
// projected solid angle π sin²θ = π/N. Their places turn and shift with the sub-frames, so that all of these
// together are one finer set, and each may be narrower.

#include "engines/vct/cone_lib.glsl"

Grid voxel_grid() { return Grid(grid_low, grid_cell, vec3(grid_size), grid_levels); }

const float GOLDEN_ANGLE = 2.39996322972865; // π (3 − √5)

struct Gathered {
    vec3 radiance;    // E/π, W/(m²·sr)
    vec4 direction;   // Σ luminance × direction; Σ luminance, per direction
};

// The tangent of a cone's half angle, one of `count` in each of `cone_sets` sub-frames.
float cone_spread(int count)
{
    float sin_half = inversesqrt(float(count) * cone_sets);
    return sin_half * inversesqrt(max(1.0 - sin_half * sin_half, 1e-4));
}

float cone_phase() { return view.subframes > 1u ? sobol_2d(view.subframe, 41u).x : 0.0; }

// Direction `i` of `count` about +z. Where the result is interpolated, neighbours turn their sets apart by sixteenths: what one
// set misses is no streak.
vec3 cone_direction(int i, int count, bool turned)
{
    vec2 shift = view.subframes > 1u ? sobol_2d(view.subframe, 40u) : vec2(0.5);
    uvec2 place = uvec2(gl_FragCoord.xy) & 3u;
    float r2 = (float(i) + shift.x) / float(count);
    float phi = GOLDEN_ANGLE * float(i) + TAU * (shift.y + (turned ? float(place.x + 4u * place.y) / 16.0 : 0.0));
    return vec3(sqrt(r2) * vec2(cos(phi), sin(phi)), sqrt(1.0 - r2));
}

// The cone from a surface at `position_ws` along `direction`, `reach` m far.
Cone surface_cone(Grid grid, vec3 position_ws, vec3 ng, vec3 direction, float spread, float reach)
{
    vec3 p = (position_ws - grid.low) / grid.cell;
    Departure from = cone_departure(voxel_facing, p, ng);
    return Cone(p + ng * from.above, direction, spread, from.above, reach / grid.cell, ng, from);
}

Gathered gather_cones(vec3 position_ws, vec3 n, vec3 ng)
{
    Gathered g = Gathered(vec3(0.0), vec4(0.0));
    Grid grid = voxel_grid();
    mat3 frame = frame_from_normal(n);
    float spread = cone_spread(cone_count);
    Cone cone = surface_cone(grid, position_ws, ng, n, spread, 1e30);
    float phase = cone_phase();
    for (int i = 0; i < cone_count; ++i) {
        vec3 local = cone_direction(i, cone_count, true);
        cone.direction = frame * local;
        if (dot(cone.direction, ng) <= 0.0) {
            continue; // into the triangle
        }
        ConeResult result = trace_cone(voxel_radiance, voxel_back, voxel_opacity, grid, cone, phase);
        g.radiance += result.radiance;
        g.direction += vec4(cone.direction, 1.0) * (luminance(result.radiance) / max(local.z, spread));
    }
    g.radiance /= float(cone_count);
    return g;
}
