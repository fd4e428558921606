// Radiance that leaves each cell's surfaces, by direction: what the lights' reflective shadow maps show of them, and what
// they emit (paper Figure 4c, Voxel Radiance Injection).
//
// The paper scatters RSM texels into cells: their number per cell depends on both resolutions. Here each cell asks. Rays
// from the light through points of the cell end where the map says: inside the cell (lit, and this is what it
// reflects), before it (blocked), or behind it (no surface on this ray). So
//     L = Σ_lit B/π · w(n) / Σ_lit w(n)  ×  lit / (lit + blocked),      w(n) = max(n·side, 0),
// with B the radiosity of the texel, albedo × irradiance × N·L: no resolution is in it, and a cell half in shadow gives
// half of its light.

#include "engines/vct/volume_lib.glsl"
#if HAS_RSM_DEPTH
#include "engines/rsm/rsm_lib.glsl"
#endif

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

#if HAS_VOXEL_BOUNCE
layout(binding = 12) uniform sampler3D bounce_now;
layout(binding = 13) uniform sampler3D bounce_back_now;
#endif

// Points of a cell: M. Roberts' R3 sequence, multiples of the powers of 1/1.2207… (root of x⁴ = x + 1).
const int POINTS = 16;
const vec3 R3 = vec3(0.8191725134, 0.6710436067, 0.5497004779);
// A surface this far outside, in cells, is rounding; one up to a whole cell outside speaks for the cell if none is inside
// (cells that a surface only grazes are missed by all rays), by a weight that any inside overrules.
const float ROUNDING = 0.51;
const float NEAR_BY = 1.0;
const float NEAR_BY_WEIGHT = 1e-3;

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(cell, grid_size))) {
        return;
    }
    bool empty = texelFetch(voxel_albedo, cell, 0).a == 0.0;
    if (empty && first_time == 0) {
        return; // as it was
    }
    vec3 back = vec3(0.0);
    vec3 leaving[6];
    for (int f = 0; f < 6; ++f) {
        leaving[f] = vec3(0.0);
    }
#if HAS_RSM_DEPTH
    if (!empty) {
        vec3 low = grid_low + vec3(cell) * grid_cell;
        vec3 center = low + 0.5 * grid_cell;
        vec3 sum[6];
        float weight[6];
        for (int f = 0; f < 6; ++f) {
            sum[f] = vec3(0.0);
            weight[f] = 0.0;
        }
        vec4 back_sum = vec4(0.0);
        // The cell's fronts as a vector over the area they could have at most; −1 … 1 against a normal.
        vec3 coverage = texelFetch(voxel_coverage, cell, 0).rgb;
        vec3 fronts = texelFetch(voxel_facing, cell, 0).rgb * coverage;
        float inside = 0.0;  // rays that end here
        float open_ = 0.0;   // rays that pass
        float beside = 0.0;  // rays that end near by
        for (int index = 0; index < view_count; ++index) {
            LightView v = rsm_views[index];
            // No point of the cell, a ball of radius √3/2 cells, is in a view whose span its middle lies farther outside of.
            vec3 middle = light_view_project(v, center);
            float radius = 0.867 * grid_cell;
            float away = v.perspective > 0.5 ? middle.z - radius : 1.0;
            float margin = radius / (away * min(length(v.axis_x), length(v.axis_y))) * (1.0 + max3(abs(vec3(middle.xy, 0.0))));
            bool outside = v.perspective > 0.5 && middle.z + radius <= 0.0;
            outside = outside || (away > 0.0 && max3(abs(vec3(middle.xy, 0.0))) > 1.0 + margin);
            for (int i = 0; i < (outside ? 0 : POINTS); ++i) {
                vec3 p = low + fract(0.5 + float(i) * R3) * grid_cell;
                vec3 at = light_view_project(v, p);
                if (any(greaterThan(abs(at.xy), vec2(1.0))) || (v.perspective > 0.5 && at.z <= 0.0)) {
                    continue; // another view of the light has this point, or none: then it is dark
                }
                ivec2 texel = ivec2(v.rect.xy + (at.xy / v.guard * 0.5 + 0.5) * v.rect.zw);
                RsmTexel t = rsm_texel(index, texel);
                if (t.area <= 0.0) {
                    open_ += 1.0;
                    continue;
                }
                // Where this very ray meets the texel's plane.
                vec3 from = v.perspective > 0.5 ? v.origin_ws : p - v.axis_z * at.z;
                vec3 ray = p - from;
                float facing = dot(ray, t.normal_ws);
                vec3 hit = t.position_ws;
                if (abs(facing) > GRAZING_COS * length(ray)) {
                    hit = from + ray * (dot(t.position_ws - from, t.normal_ws) / facing);
                }
                vec3 offset = abs(hit - center) / grid_cell;
                float out_by = max3(offset);
                if (out_by > NEAR_BY) {
                    open_ += dot(hit - center, ray) > 0.0 ? 1.0 : 0.0;
                    continue;
                }
                bool here = out_by <= ROUNDING;
                inside += here ? 1.0 : 0.0;
                beside += here ? 0.0 : 1.0;
                float w = here ? 1.0 : NEAR_BY_WEIGHT;
                vec3 radiance = t.flux / (t.area * PI);
                // A sheet's back is lit where all its fronts face away (−1); where surfaces face apart (0) it is some
                // front that is lit.
                float facing_light = dot(t.normal_ws, fronts) / max(dot(abs(t.normal_ws), coverage), 1e-6);
                if (facing_light < -0.5) {
                    back_sum += vec4(radiance, 1.0) * w;
                } else {
                    for (int f = 0; f < 6; ++f) {
                        float side = (f & 1) == 0 ? t.normal_ws[f >> 1] : -t.normal_ws[f >> 1];
                        sum[f] += w * max(side, 0.0) * radiance;
                        weight[f] += w * max(side, 0.0);
                    }
                }
            }
            bool last = index + 1 == view_count || rsm_views[index + 1].light != v.light;
            if (last) {
                // Points on the border of two views are in both.
                float blocked = max(float(POINTS) - inside - open_ - beside, 0.0);
                float lit = inside > 0.0 ? inside : beside;
                float share = lit > 0.0 ? lit / (lit + blocked) : 0.0;
                for (int f = 0; f < 6; ++f) {
                    leaving[f] += weight[f] > 0.0 ? sum[f] / weight[f] * share : vec3(0.0);
                    sum[f] = vec3(0.0);
                    weight[f] = 0.0;
                }
                back += back_sum.a > 0.0 ? back_sum.rgb / back_sum.a * share : vec3(0.0);
                back_sum = vec4(0.0);
                inside = open_ = beside = 0.0;
            }
        }
    }
#endif
#if HAS_VOXEL_EMISSION
    vec3 emission = texelFetch(voxel_emission, cell, 0).rgb; // by both sides of a surface
    back += emission;
    for (int f = 0; f < 6; ++f) {
        leaving[f] += emission;
    }
#endif
#if HAS_VOXEL_BOUNCE
    if (add_bounce == 1 && !empty) {
        back += texelFetch(bounce_back_now, cell, 0).rgb;
        for (int f = 0; f < 6; ++f) {
            leaving[f] += texelFetch(bounce_now, part_texel(cell, grid_size, f >> 1, f & 1), 0).rgb;
        }
    }
#endif
    vec3 alpha = texelFetch(voxel_opacity, cell, 0).rgb;
    vec3 facing = texelFetch(voxel_facing, cell, 0).rgb;
    for (int f = 0; f < 6; ++f) {
        int axis = f >> 1;
        int side = f & 1;
        float front = alpha[axis] * (0.5 + (side == 0 ? 0.5 : -0.5) * facing[axis]);
        imageStore(voxel_radiance, part_texel(cell, grid_size, axis, side), vec4(leaving[f] * front, front));
    }
    float depth = alpha.x + alpha.y + alpha.z;
    imageStore(voxel_back, cell, vec4(back * depth, depth));
}
