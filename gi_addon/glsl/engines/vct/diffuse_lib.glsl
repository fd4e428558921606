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
};

// The cone that leaves a surface at `position_ws` along `direction`, `reach` m far.
Cone surface_cone(Grid grid, vec3 position_ws, vec3 ng, vec3 direction, float spread, float reach)
{
    vec3 p = (position_ws - grid.low) / grid.cell;
    return Cone(p + LIFT * ng, direction, spread, reach / grid.cell, surface_side(voxel_sheets, voxel_rows, voxel_kinds, grid, p, ng));
}

// Points side by side have runs of cones one after another: every SIDE × SIDE of them all runs of one fine set.
const int SIDE = 5;

// Where the run of the point at `place` (in pixels or blocks) starts among the cones of all sub-frames.
uint cone_run(ivec2 place)
{
    ivec2 p = place - SIDE * ivec2(floor(vec2(place) / float(SIDE)));
    return (uint(p.x + SIDE * p.y) * uint(cone_sets) + view.subframe) * uint(cone_count);
}

float set_spread() { return cone_spread(1.0 / (float(cone_count) * cone_sets)); }

// What a cone's light adds to the directional sums: per direction, not per projected one.
vec4 directional(vec3 direction, vec3 n, vec3 radiance)
{
    return vec4(direction, 1.0) * (luminance(radiance) / max(dot(direction, n), set_spread()));
}

// E/π by the point's own cones alone.
Gathered gather_cones(ivec2 place, vec3 position_ws, vec3 n, vec3 ng)
{
    Gathered g = Gathered(vec3(0.0), vec4(0.0));
    Grid grid = voxel_grid();
    mat3 frame = frame_from_normal(n);
    Cone cone = surface_cone(grid, position_ws, ng, n, set_spread(), 1e30);
    uint run = cone_run(place);
    for (int i = 0; i < cone_count; ++i) {
        cone.direction = frame * cone_direction(run + uint(i));
        if (dot(cone.direction, ng) <= 0.0) {
            continue; // into the triangle
        }
        ConeResult result = trace_cone(voxel_radiance, voxel_back, voxel_sheets, voxel_rows, voxel_kinds, grid, cone);
        g.radiance += result.radiance / float(cone_count);
        g.direction += directional(cone.direction, n, result.radiance);
    }
    return g;
}
