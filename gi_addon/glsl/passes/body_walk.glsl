// Light that walks through a body below its surface, in the voxels: from one of its sheets to another. The walk of the shared pass
// (passes/subsurface_frag.glsl), between the sheets of the grid in place of what picture and lights' maps show: free paths of mean
// ℓ, any turn with the share α, and where it is deep inside, the largest empty sphere at once.
//
// A walk leaves where it crosses a sheet of the body towards its front. It starts on a sheet and goes in by its front, so that it
// cannot meet what it starts from, however near. A sheet that two walks' ends are apart by less than this from, in cells, is one
// place (a cell has one radiance a side): light leaves where it enters.

#include "passes/voxel_cell.glsl"
#include "lib/subsurface_lib.glsl"
#include "lib/body_lib.glsl"
#include "lib/bsdf_lib.glsl"

const int WALK_STEPS = 256;     // what is under way after these is lost
const int WALK_CELLS = 256;     // on one step's way
const float WALK_SHORT = 0.02;  // cells
const float WALK_END = 1e-3;    // of the light

struct Walk {
    vec3 weight;  // share of the light that comes out, 0 where none does
    vec3 at;      // where it comes out, cells
    uint number;  // of the sheet there
    int part;
};

bool scatters_below(usampler2D bodies, uint number) { return (texelFetch(bodies, store_texel(number), 0).y >> 16u) > 0u; }

// Height of a point over a sheet's front, cells, and how it grows along a direction.
float sheet_height(Sheet sheet, int part, vec3 from_middle)
{
    return ((part & 1) == 0 ? 1.0 : -1.0) * (dot(sheet.slant, from_middle) - sheet.height);
}

float sheet_rise(Sheet sheet, int part, vec3 direction)
{
    return ((part & 1) == 0 ? 1.0 : -1.0) * dot(sheet.slant, direction);
}

// Whether a straight way of length `reach` leaves the body; then where. A sheet's plane is taken as it goes through the cell: what
// has slipped between the planes of two neighbouring cells leaves as it comes to the second.
bool leaves_body(usampler2D sheets, usampler2D rows, sampler3D kinds, usampler2D bodies, Grid grid, vec3 start, vec3 direction,
                 float reach, inout Walk walk)
{
    vec3 d = mix(direction, vec3(1e-6), lessThan(abs(direction), vec3(1e-6)));
    vec3 inverse = 1.0 / d;
    vec3 forward = step(0.0, d);
    ivec3 size = ivec3(grid.size);
    float t = 0.0;
    float first = 1e30;
    for (int i = 0; i < WALK_CELLS; ++i) {
        vec3 p = start + d * t;
        if (t >= reach || first < 1e30 || any(lessThan(p, vec3(0.0))) || any(greaterThanEqual(p, grid.size))) {
            break;
        }
        ivec3 cell = ivec3(floor(p));
        vec4 texel = texelFetch(kinds, cell, 0);
        uint found = kinds_of(texel);
        float width = found >= 64u ? float(1u << (found - 64u)) : 1.0;
        vec3 out_at = (floor(p / width) * width + forward * width - p) * inverse;
        float t_out = t + max(min(out_at.x, min(out_at.y, out_at.z)), 0.0);
        uint number = found < 64u ? first_number(rows, texel, cell, size, 0) : 0u;
        vec3 from = start - vec3(cell) - 0.5;
        float end = min(t_out, reach);
        for (int part = 0; part < 6; ++part) {
            if (found < 64u && (found >> part & 1u) == 1u) {
                uint own = number++;
                if (!scatters_below(bodies, own)) {
                    continue;
                }
                Sheet sheet = sheet_at(sheets, own, part);
                float rise = sheet_rise(sheet, part, d);
                float height = sheet_height(sheet, part, from);
                if (rise > 0.0 && height + rise * end > 0.0) {
                    float at = clamp(-height / rise, t, end);
                    if (at < first && covers(sheet, across_axis(from + d * at, part >> 1))) {
                        first = at;
                        walk.number = own;
                        walk.part = part;
                    }
                }
            }
        }
        t = t_out + 1e-4;
    }
    walk.at = start + d * min(first, reach);
    return first < 1e30;
}

// Radius of a sphere around a point that no sheet of the body meets, cells.
float empty_around(usampler2D sheets, usampler2D rows, sampler3D kinds, usampler2D bodies, Grid grid, vec3 p)
{
    ivec3 size = ivec3(grid.size);
    ivec3 cell = clamp(ivec3(floor(p)), ivec3(0), size - 1);
    vec4 texel = texelFetch(kinds, cell, 0);
    uint found = kinds_of(texel);
    float width = found >= 64u ? float(1u << (found - 64u)) : 1.0;
    vec3 inside = p - floor(p / width) * width;
    inside = min(inside, width - inside);
    float radius = min(inside.x, min(inside.y, inside.z));
    uint number = found < 64u ? first_number(rows, texel, cell, size, 0) : 0u;
    for (int part = 0; part < 6; ++part) {
        if (found < 64u && (found >> part & 1u) == 1u && scatters_below(bodies, number++)) {
            Sheet sheet = sheet_at(sheets, number - 1u, part);
            radius = min(radius, -sheet_height(sheet, part, p - vec3(cell) - 0.5) / length(sheet.slant));
        }
    }
    return radius;
}

// A walk of mean free path `path` (cells) that goes in at `start` (cells) along `direction`.
Walk walk_below(usampler2D sheets, usampler2D rows, sampler3D kinds, usampler2D bodies, Grid grid, vec3 start, vec3 direction,
                float path, vec3 alpha, inout uint state)
{
    Walk walk = Walk(vec3(1.0), start, 0u, 0);
    vec3 decay = vec3(diffuse_decay(alpha.r), diffuse_decay(alpha.g), diffuse_decay(alpha.b));
    bool left = false;
    for (int i = 0; i < WALK_STEPS; ++i) {
        if (left || max3(walk.weight) < WALK_END) {
            break;
        }
        left = leaves_body(sheets, rows, kinds, bodies, grid, walk.at, direction, -path * log(1.0 - draw(state)), walk);
        if (!left) {
            walk.weight *= alpha;
            float radius = empty_around(sheets, rows, kinds, bodies, grid, walk.at);
            if (radius > DEEP * path) {
                walk.at += draw_direction(state) * radius;
                walk.weight *= share_across_sphere(decay, radius / path);
            }
            direction = draw_direction(state);
        }
    }
    walk.weight = left ? walk.weight : vec3(0.0);
    return walk;
}

// How light goes in that comes evenly from all sides, or what is seen from all sides goes in backwards: `frame` is the surface's,
// `u` chooses where it comes from.
vec3 way_in(Body body, mat3 frame, vec2 u, inout uint state)
{
    vec3 v = warp_cosine_hemisphere(u);
    v = normalize(vec3(v.xy, max(v.z, 1e-3)));
    vec2 facet = vec2(draw(state), draw(state));
    vec3 d = refract(-v, ggx_sample_visible_normal(v, max(sqr(body.rough), ALPHA_MIN), facet), body.inverse);
    return frame * vec3(d.xy, min(d.z, -1e-3));
}
