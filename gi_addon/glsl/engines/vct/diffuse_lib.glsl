// Light on a surface by a set of cones. Included where the volumes, the grid, `cone_count` and `cone_sets` are declared, after
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
    float nearness;   // mean of 1/distance of the surfaces that it comes from, 1/m
};

// The cone that leaves a surface at `position_ws` along `direction`, `reach` m far.
Cone surface_cone(Grid grid, vec3 position_ws, vec3 ng, vec3 direction, float spread, float reach)
{
    vec3 p = (position_ws - grid.low) / grid.cell;
    return Cone(p + LIFT * ng, direction, spread, reach / grid.cell, surface_side(voxel_sheets, voxel_kinds, grid, p, ng));
}

// Where this pixel's run of cones starts among those of all sub-frames. `turned`: 2 × 2 neighbours have runs one after
// another, and the tent of passes/smooth_blocks_frag.glsl weighs the four alike wherever it stands.
uint cone_run(bool turned)
{
    uvec2 place = uvec2(gl_FragCoord.xy) & 1u;
    uint run = turned ? place.x + 2u * place.y : 0u;
    return (run * uint(cone_sets) + view.subframe) * uint(cone_count);
}

float set_spread() { return cone_spread(1.0 / (float(cone_count) * cone_sets)); }

Gathered gather_cones(vec3 position_ws, vec3 n, vec3 ng)
{
    Gathered g = Gathered(vec3(0.0), vec4(0.0), 0.0);
    Grid grid = voxel_grid();
    mat3 frame = frame_from_normal(n);
    float spread = set_spread();
    Cone cone = surface_cone(grid, position_ws, ng, n, spread, 1e30);
    uint run = cone_run(true);
    for (int i = 0; i < cone_count; ++i) {
        vec3 local = cone_direction(run + uint(i));
        cone.direction = frame * local;
        if (dot(cone.direction, ng) <= 0.0) {
            continue; // into the triangle
        }
        ConeResult result = trace_cone(voxel_radiance, voxel_back, voxel_sheets, voxel_kinds, grid, cone);
        g.radiance += result.radiance;
        g.nearness += 1.0 / max(result.first.t, LIFT);
        g.direction += vec4(cone.direction, 1.0) * (luminance(result.radiance) / max(local.z, spread));
    }
    g.radiance /= float(cone_count);
    g.nearness /= float(cone_count) * grid.cell;
    return g;
}
