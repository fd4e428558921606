// One column of cells under a triangle: clips the triangle to each cell and, with VOXEL_MARK, notes that it has such a sheet; else
// adds its area there, and its material by that area, to the sheet's and the cell's sums. They are integers: the order does not
// matter.

#include "surface/surface_point.glsl"
#include "passes/voxel_sums.glsl"
#if VOXEL_BODIES
#include "lib/body_lib.glsl"
#endif

layout(binding = 4, r32ui) uniform uimage3D cells_now;
layout(binding = 6, r32ui) readonly uniform uimage2D rows_now;

flat in vec3 triangle_a;
flat in vec3 triangle_b;
flat in vec3 triangle_c;
flat in int triangle_axis;
flat in vec3 triangle_normal_ws;

const int MOST = 9; // corners of a triangle cut by six planes

// Sutherland and Hodgman: keeps the part of a convex polygon where dot(plane.xyz, p) + plane.w ≥ 0.
void clip_polygon(inout vec3 polygon[MOST], inout int count, vec4 plane)
{
    vec3 kept[MOST];
    int n = 0;
    for (int i = 0; i < MOST; ++i) {
        if (i >= count) {
            break;
        }
        vec3 from = polygon[i];
        vec3 to = polygon[i + 1 < count ? i + 1 : 0];
        float d_from = dot(plane.xyz, from) + plane.w;
        float d_to = dot(plane.xyz, to) + plane.w;
        if (d_from >= 0.0) {
            kept[min(n, MOST - 1)] = from;
            ++n;
        }
        if ((d_from >= 0.0) != (d_to >= 0.0)) {
            kept[min(n, MOST - 1)] = mix(from, to, d_from / (d_from - d_to));
            ++n;
        }
    }
    count = min(n, MOST);
    polygon = kept;
}

// Area of the polygon's shadow along z.
float seen_area(vec3 polygon[MOST], int count)
{
    vec3 sum = vec3(0.0);
    for (int i = 1; i < MOST - 1; ++i) {
        if (i + 1 < count) {
            sum += cross(polygon[i] - polygon[0], polygon[i + 1] - polygon[0]);
        }
    }
    return 0.5 * abs(sum.z);
}

void add(uint at, float value) { atomicAdd(voxel_sums[at], uint(int(round(value)))); }

// Which of the 4 × 4 squares of the cell's face the polygon covers any of: a bit each, u fastest. Two convex shapes are apart
// if a side of either parts them. Rounding alone, TOUCH, covers nothing.
const float TOUCH = 1e-3;

uint squares_covered(vec3 polygon[MOST], int count, vec2 corner)
{
    vec2 low = vec2(1e30);
    vec2 high = vec2(-1e30);
    vec3 sum = vec3(0.0);
    for (int i = 0; i < MOST; ++i) {
        if (i < count) {
            low = min(low, polygon[i].xy);
            high = max(high, polygon[i].xy);
            sum += cross(polygon[i] - polygon[0], polygon[i + 1 < count ? i + 1 : 0] - polygon[0]);
        }
    }
    uint bits = 0u;
    for (int square = 0; square < 16; ++square) {
        vec2 middle = corner + 0.5 + square_middle(square);
        bool apart = any(greaterThan(low, middle + 0.125 - TOUCH)) || any(lessThan(high, middle - 0.125 + TOUCH));
        for (int i = 0; i < MOST; ++i) {
            if (i < count) {
                vec2 from = polygon[i].xy;
                vec2 edge = polygon[i + 1 < count ? i + 1 : 0].xy - from;
                // Inwards, whichever way the corners go round.
                vec2 inner = sum.z < 0.0 ? vec2(edge.y, -edge.x) : vec2(-edge.y, edge.x);
                float reach = (0.125 - TOUCH) * (abs(inner.x) + abs(inner.y));
                apart = apart || dot(inner, middle - from) < -reach;
            }
        }
        bits |= apart ? 0u : 1u << square;
    }
    // Less than rounding: where it is.
    ivec2 at = clamp(ivec2((0.5 * (low + high) - corner) * 4.0), ivec2(0), ivec2(3));
    return bits != 0u ? bits : 1u << (at.x + 4 * at.y);
}

// How far the polygon reaches over the cell's face: from its far sides to where it begins along u and v, and from its near
// ones to where it ends.
vec4 covered_extent(vec3 polygon[MOST], int count, vec2 corner)
{
    vec2 low = vec2(1.0);
    vec2 high = vec2(0.0);
    for (int i = 0; i < MOST; ++i) {
        if (i < count) {
            low = min(low, polygon[i].xy - corner);
            high = max(high, polygon[i].xy - corner);
        }
    }
    return clamp(vec4(1.0 - low, high), 0.0, 1.0);
}

void main()
{
    vec3 front = dot(vary_normal_ws, triangle_normal_ws) < 0.0 ? -triangle_normal_ws : triangle_normal_ws;
    SurfacePoint point = surface_point(front);
    Closure c = surface_closure(point);
    float opacity = surface_opacity(c);
    vec3 albedo = c.diffuse;
    float diffuse = luminance(c.diffuse);
#if SURFACE_TABLES > 0
    albedo += lobe_albedo_average(brdf_average, brdf_energy, closure_lobe(c));
#endif
    diffuse /= max(luminance(albedo), 1e-6);
    albedo = saturate(albedo); // more than all light reflected would not settle

    // The triangle inside this column.
    vec2 column = floor(gl_FragCoord.xy);
    vec3 polygon[MOST];
    polygon[0] = triangle_a;
    polygon[1] = triangle_b;
    polygon[2] = triangle_c;
    int count = 3;
    clip_polygon(polygon, count, vec4(1.0, 0.0, 0.0, -column.x));
    clip_polygon(polygon, count, vec4(-1.0, 0.0, 0.0, column.x + 1.0));
    clip_polygon(polygon, count, vec4(0.0, 1.0, 0.0, -column.y));
    clip_polygon(polygon, count, vec4(0.0, -1.0, 0.0, column.y + 1.0));
    if (count == 0) {
        discard;
    }
    float low = 1e30;
    float high = -1e30;
    for (int i = 0; i < MOST; ++i) {
        if (i < count) {
            low = min(low, polygon[i].z);
            high = max(high, polygon[i].z);
        }
    }
    vec3 facing = abs(front);
    float along = triangle_axis == 0 ? facing.x : triangle_axis == 1 ? facing.y : facing.z;
    vec3 across = triangle_axis == 0 ? front.yzx : triangle_axis == 1 ? front.zxy : front;
    int side = across.z < 0.0 ? 1 : 0;
    // A triangle leans by no more than one cell a cell along each of the other two axes: three layers, and one more for
    // a range that ends on a border.
    for (int k = 0; k < 4; ++k) {
        float layer = floor(low) + float(k);
        if (layer > high) {
            break;
        }
        vec3 turned_cell = vec3(column, layer);
        ivec3 cell = ivec3(triangle_axis == 0 ? turned_cell.zxy : triangle_axis == 1 ? turned_cell.yzx : turned_cell);
        if (any(lessThan(cell, ivec3(0))) || any(greaterThanEqual(cell, grid_size))) {
            continue;
        }
#if VOXEL_MARK
        // Where even a whole face of it would round to nothing, nothing is there.
        imageAtomicOr(cells_now, cell, 1u << (2 * triangle_axis + side) | (opacity * float(VOXEL_UNITS) >= 0.5 ? SOME_OPAQUE : 0u));
#else
        uint word = imageLoad(cells_now, cell).r;
        uint kinds = word_kinds(word);
        uint number = imageLoad(rows_now, store_texel(row_of(cell, grid_size, 0))).r + word_sheets(word);
        uint own = number + sheets_before(kinds, 2 * triangle_axis + side);
        if (kinds >= 64u || own < chunk.x || own >= chunk.x + chunk.y) {
            continue;
        }
        vec3 part[MOST] = polygon;
        int corners = count;
        clip_polygon(part, corners, vec4(0.0, 0.0, 1.0, -layer));
        clip_polygon(part, corners, vec4(0.0, 0.0, -1.0, layer + 1.0));
        float seen = seen_area(part, corners);
        // A cell that is only touched is still taken: one unit.
        float weight = max(round(seen / along * float(VOXEL_UNITS)), 1.0);
        if (number >= chunk.x) {
            uint at = (number - chunk.x) * uint(VOXEL_WORDS);
            add(at + SUM_AREA, weight);
            add(at + SUM_OPAQUE, weight * opacity);
            add(at + SUM_ALBEDO, weight * albedo.r);
            add(at + SUM_ALBEDO + 1u, weight * albedo.g);
            add(at + SUM_ALBEDO + 2u, weight * albedo.b);
            add(at + SUM_DIFFUSE, weight * diffuse);
#if VOXEL_EMISSION
            float scale = weight / (float(VOXEL_UNITS) * emission_unit);
            add(at + SUM_EMISSION, c.emission.r * scale);
            add(at + SUM_EMISSION + 1u, c.emission.g * scale);
            add(at + SUM_EMISSION + 2u, c.emission.b * scale);
#endif
        }
        // The plane as a height over the cell's middle: along the axis, x + slope · (u, v) = height.
        uint at = (own - chunk.x) * uint(VOXEL_WORDS);
        vec2 slope = across.xy / across.z;
        float height = triangle_a.z - layer - 0.5 + dot(slope, triangle_a.xy - column - 0.5);
        // A part so small that sums round is still a plane: to a thousandth.
        float share = max(round(seen * float(VOXEL_UNITS) * opacity), 1024.0);
        add(at + SUM_SHARE, share);
        add(at + SUM_PLANE, share * slope.x);
        add(at + SUM_PLANE + 1u, share * slope.y);
        add(at + SUM_PLANE + 2u, share * clamp(height, -1.5, 1.5));
        // What of the face lies within: the largest of its ends, either way from the cell's sides, and of no more than rounds.
        vec4 extent = covered_extent(part, corners, column);
        for (int i = 0; i < 4; ++i) {
            atomicMax(voxel_sums[at + SUM_EXTENT + uint(i)], uint(ceil(extent[i] * EXTENT_UNITS)));
        }
        atomicOr(voxel_sums[at + SUM_SQUARES], squares_covered(part, corners, column));
#if VOXEL_LAMPS
        if (max3(c.emission) > 0.0) {
            add(at + SUM_LAMPS, seen * float(VOXEL_UNITS));
        }
#endif
#if VOXEL_BODIES
        float scattered = luminance(c.subsurface);
        if (scattered > 0.0) {
            uint body = at + uint(SUM_BODY);
            vec3 path = min(c.subsurface_radius / (scattered * grid_cell), vec3(LONGEST_PATH)) / LONGEST_PATH;
            vec3 entry = c.subsurface_entry / scattered;
            vec3 own_albedo = saturate(c.diffuse * (entry.z / max(luminance(c.diffuse), 1e-6))); // without what layers above take
            add(body, share);
            for (int i = 0; i < 3; ++i) {
                add(body + 1u + uint(i), share * path[i]);
                add(body + 5u + uint(i), share * own_albedo[i]);
            }
            add(body + 4u, share * min(scattered / max(luminance(albedo), 1e-6), 1.0));
            add(body + 8u, share * saturate(entry.x));
            add(body + 9u, share / max(entry.y, 1.0));
        }
#endif
#endif
    }
}
