// Light on a surface by a set of cones. Included where `voxel_radiance`, the grid and `cone_count` are declared, after
// view_lib and sequence_lib.
//
// N cones of weight π/N each: directions spread evenly over the unit disc, lifted to the hemisphere, are
// cosine-distributed (Malley's method), and weights sum to π. Each cone is as wide as its share: a cone of half angle θ has
// projected solid angle π sin²θ = π/N. All sub-frames' cones together are one finer set, and each may be narrower.

#include "engines/vct/cone_lib.glsl"

Grid voxel_grid() { return Grid(grid_low, grid_cell, vec3(grid_size), grid_levels); }

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

// Direction `i` of `count` about +z: the next points of the R2 sequence in each sub-frame. `turned`: 2 × 2 neighbours have runs one after another, and the tent of passes/smooth_blocks_frag.glsl weighs the
// four alike wherever it stands.
vec3 cone_direction(int i, int count, bool turned)
{
    uvec2 place = uvec2(gl_FragCoord.xy) & 1u;
    uint run = turned ? place.x + 2u * place.y : 0u;
    uint j = (run * uint(cone_sets) + view.subframe) * uint(count) + uint(i);
    vec2 u = r2_sequence(j);
    float phi = TAU * u.y;
    return vec3(sqrt(u.x) * vec2(cos(phi), sin(phi)), sqrt(1.0 - u.x));
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
