// One more bounce in the voxels: light that a cell's surfaces gather from all others by cones, times their albedo. Added to what
// the lights bring (inject_comp.glsl), round by round: L_k = L_1 + ρ G L_(k−1). G averages and ρ ≤ 1: it can't grow.

#include "engines/vct/cone_lib.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;
layout(binding = 12) uniform sampler3D light_now;
layout(binding = 13) uniform sampler3D back_now;

const float GOLDEN_ANGLE = 2.39996322972865; // π (3 − √5)

// E/π at a cell's surfaces of normal `n`: N cones of equal weight, as in diffuse_lib.glsl.
vec3 gathered(Grid grid, vec3 center, vec3 n, float leaving)
{
    // From the cell's middle: half a cell less to the surface than any point of it may need.
    float above = surface_reach(n);
    mat3 frame = frame_from_normal(n);
    float sin2 = 1.0 / float(cone_count);
    float spread = sqrt(sin2 / max(1.0 - sin2, 1e-4));
    vec3 sum = vec3(0.0);
    for (int i = 0; i < cone_count; ++i) {
        float r2 = (float(i) + 0.5) / float(cone_count);
        float phi = GOLDEN_ANGLE * float(i);
        vec3 d = frame * vec3(sqrt(r2) * vec2(cos(phi), sin(phi)), sqrt(1.0 - r2));
        Cone cone = Cone(center + n * above, d, spread, above, 1e30, n, Departure(above, leaving));
        sum += trace_cone(light_now, back_now, voxel_opacity, grid, cone, 0.0).radiance;
    }
    return sum / float(cone_count);
}

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(cell, grid_size))) {
        return;
    }
    vec4 albedo = texelFetch(voxel_albedo, cell, 0);
    vec3 coverage = texelFetch(voxel_coverage, cell, 0).rgb;
    bool empty = albedo.a == 0.0 || max3(coverage) <= 0.0;
    if (empty && first_time == 0) {
        return;
    }
    vec3 facing = texelFetch(voxel_facing, cell, 0).rgb;
    vec3 fronts = safe_normalize(facing * coverage);
    // Surfaces that face one way are a sheet with a normal; others are gathered for side by side.
    bool sheet = dot(abs(facing), coverage) > 0.9 * dot(vec3(1.0), coverage);
    Grid grid = Grid(grid_low, grid_cell, vec3(grid_size), grid_levels);
    vec3 center = vec3(cell) + 0.5;
    vec3 front = vec3(0.0);
    vec3 back = vec3(0.0);
    if (sheet && !empty) {
        front = albedo.rgb * gathered(grid, center, fronts, 1.0);
        back = albedo.rgb * gathered(grid, center, -fronts, -1.0);
    }
    for (int f = 0; f < 6; ++f) {
        int axis = f >> 1;
        float sign_ = (f & 1) == 0 ? 1.0 : -1.0;
        vec3 light = front;
        if (!sheet && !empty) {
            vec3 n = vec3(equal(ivec3(0, 1, 2), ivec3(axis))) * sign_;
            bool seen = coverage[axis] * (1.0 + sign_ * facing[axis]) > 0.1;
            light = seen ? albedo.rgb * gathered(grid, center, n, 1.0) : vec3(0.0);
        }
        imageStore(voxel_bounce, part_texel(cell, grid_size, axis, f & 1), vec4(light, 1.0));
    }
    imageStore(voxel_bounce_back, cell, vec4(back, 1.0));
}
