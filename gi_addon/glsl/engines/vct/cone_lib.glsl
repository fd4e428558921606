// A cone through the voxels: C. Crassin et al., "Interactive Indirect Illumination Using Voxel Cone Tracing", Pacific
// Graphics 2011; paper §IV-D. Two things of the original are ours:
//
// What blocks a cone is what its axis meets, in the cells themselves, at every distance. A mip of opacities knows a wall to
// within its own width, so that all walls close in on a wide cone: with blocks, a Cornell box of 64 cells was 13 % too bright.
// Cones are drawn in stratified sets that turn from sub-frame to sub-frame and from block to block: what their axes miss, others
// see.
// What light the cone gathers is that of its footprint where the axis ends: the mip whose cells are half as wide. A disc of
// diameter D varies by D/4 a side; a cell of width s, blended with its neighbours, by s/2.
//
// Cells are walked through as J. Amanatides and A. Woo have it (Eurographics 1987), over the largest empty block around.

#include "engines/vct/volume_lib.glsl"

// Where a ray meets a sheet.
struct Meeting {
    float t;        // cells; 1e30 where there is none
    int part;
    bool front;
    ivec3 cell;
    vec3 normal;    // of the side that is met
    float opacity;
    uint number;    // of the sheet
};

const Meeting NOTHING_MET = Meeting(1e30, 0, true, ivec3(0), vec3(0.0), 0.0, 0u);

struct ConeResult {
    vec3 radiance;        // that arrives along the cone, W/(m²·sr)
    float transmittance;  // share of the cone that nothing blocks
    Meeting first;
};

// Below this nothing behind changes a picture: 1/1000.
const float CONE_END = 1e-3;
const int CONE_MOST_STEPS = 1024;
const int CONE_MOST_LAYERS = 16;

// A surface that bends with a radius of R cells leaves its mean plane by (½)²/2R within a cell, and by R − √(R² − 4) ≈ 2/R two
// cells on. For R = 2 cells that is 1/16: as much may be between the planes of neighbouring cells. For R = 8 it is ¼: so near a
// surface's own planes pass by a point on it, two cells around. Off the surface by what G-buffers round.
const float SEAM = 1.0 / 16.0;
const float OWN_REACH = 2.0;
const float OWN_HEIGHT = 0.25;
const float LIFT = 1.0 / 64.0;

// `start` in cells, `direction` a unit vector, `spread` the tangent of the half angle, `reach` how far it goes in cells. `leaving`
// is the side of the surface that it leaves: 1 its front, −1 its back, 0 none.
struct Cone {
    vec3 start;
    vec3 direction;
    float spread;
    float reach;
    float leaving;
};

// The tangent of the half angle of a cone whose projected solid angle is `share` of the hemisphere's π: sin²θ = share.
float cone_spread(float share) { return sqrt(share / max(1.0 - share, 1e-4)); }

// Direction `j` about +z: the R2 sequence, whose every run is even, on the disc.
vec3 cone_direction(uint j)
{
    vec2 u = r2_sequence(j);
    float phi = TAU * u.y;
    return vec3(sqrt(u.x) * vec2(cos(phi), sin(phi)), sqrt(1.0 - u.x));
}

// Which side of a surface in the grid a point on it with normal `n` lies on, by the sheet of its own cell.
float surface_side(usampler2D sheets, usampler2D rows, sampler3D kinds, Grid grid, vec3 p, vec3 n)
{
    ivec3 size = ivec3(grid.size);
    ivec3 cell = clamp(ivec3(floor(p - LIFT * n)), ivec3(0), size - 1);
    vec4 texel = texelFetch(kinds, cell, 0);
    uint found = kinds_of(texel);
    uint number = found < 64u ? first_number(rows, texel, cell, size, 0) : 0u;
    float side = 0.0;
    for (int part = 0; part < 6; ++part) {
        if (found < 64u && (found >> part & 1u) == 1u) {
            Sheet sheet = sheet_at(sheets, number++, part);
            float facing = dot(sheet_normal(sheet, part), n);
            float height = dot(sheet.slant, p - vec3(cell) - 0.5) - sheet.height;
            if (abs(height) <= OWN_HEIGHT && abs(facing) > 0.5) {
                side = max(side, facing > 0.0 ? 2.0 : 1.0);
            }
        }
    }
    return side == 1.0 ? -1.0 : 1.0;
}

// Leaves the grid, or has gone its way, here.
float cone_end(Cone cone, Grid grid)
{
    vec3 d = mix(cone.direction, vec3(1e-9), lessThan(abs(cone.direction), vec3(1e-9)));
    vec3 far = max(-cone.start / d, (grid.size - cone.start) / d);
    return min(min(far.x, min(far.y, far.z)), cone.reach);
}

// Enters the grid here: 0 where it starts within.
float cone_begin(Cone cone, Grid grid)
{
    vec3 d = mix(cone.direction, vec3(1e-9), lessThan(abs(cone.direction), vec3(1e-9)));
    vec3 near = min(-cone.start / d, (grid.size - cone.start) / d);
    return max(max(near.x, max(near.y, near.z)), 0.0);
}

// Whether a sheet reaches as far as (u, v), in cells from the cell's middle: to the seam, since by so much may the planes of
// neighbouring cells be apart.
bool reaches(Sheet sheet, vec2 uv) { return all(lessThanEqual(vec4(0.5 - uv, 0.5 + uv), sheet.far + SEAM)); }

// The first sheet in a cell, whose own start at `number`, that the ray meets between `t` and `t_out`.
Meeting first_sheet(usampler2D sheets, Cone cone, ivec3 cell, uint number, uint kinds, float t, float t_out)
{
    Meeting first = NOTHING_MET;
    vec3 from = cone.start - vec3(cell) - 0.5;
    // By what there is, not by part: cones side by side are in cells of other sides, and go through this in step.
    for (int k = 0; k < 6; ++k) {
        if (kinds == 0u) {
            break;
        }
        int part = findLSB(kinds);
        kinds &= kinds - 1u;
        uint own = number++;
        Sheet sheet = sheet_at(sheets, own, part);
        float sign_ = (part & 1) == 0 ? 1.0 : -1.0;
        // Height over the front, along the axis: at the start, per length, where the ray enters and where it leaves.
        float height = sign_ * (dot(sheet.slant, from) - sheet.height);
        float rise = sign_ * dot(sheet.slant, cone.direction);
        bool front = rise < 0.0;
        // What it leaves does not block it.
        if (t < OWN_REACH && (front ? cone.leaving < 0.0 && height < OWN_HEIGHT : cone.leaving > 0.0 && height > -OWN_HEIGHT)) {
            continue;
        }
        float seam = t >= OWN_REACH || (front ? height > 0.0 : height < 0.0) ? SEAM : 0.0;
        float enter = front ? height + rise * t : -(height + rise * t);
        float leave = front ? height + rise * t_out : -(height + rise * t_out);
        if (enter < -seam || leave > seam) {
            continue;
        }
        float at = clamp(-height / (abs(rise) > 1e-9 ? rise : 1e-9), t, t_out);
        vec2 uv = across_axis(from + cone.direction * at, part >> 1);
        if (at < first.t && covers(sheet, uv) && reaches(sheet, uv)) {
            first = Meeting(at, part, front, cell, normalize(sheet.slant) * (front ? sign_ : -sign_), 0.0, own);
        }
    }
    return first;
}

// Light that leaves a sheet towards the cone, over the cone's footprint there: filtered across the sheet, but not along its axis,
// where other surfaces face the same way before and behind it.
vec3 leaving_light(sampler2D atlas, sampler2D back, usampler2D rows, sampler3D kinds, Grid grid, Cone cone, Meeting met)
{
    int level = int(clamp(floor(log2(max(cone.spread * met.t, 1.0))), 0.0, grid.levels));
    vec3 p = cone.start + cone.direction * met.t;
    int within = met.cell[met.part >> 1] >> level;
    vec4 light;
    if (met.front) {
        light = light_at(atlas, rows, kinds, grid, level, p, within, met.part);
    } else {
        light = light_at(back, rows, kinds, grid, level, p, within, met.part); // seldom
    }
    return light.a > 0.0 ? light.rgb * (radiance_unit / light.a) : vec3(0.0);
}

// The next sheet on the ray's way from `t` to `end`; `t` ends behind its cell.
Meeting next_sheet(usampler2D sheets, usampler2D rows, sampler3D kinds, Grid grid, Cone cone, float end, inout float t)
{
    vec3 d = mix(cone.direction, vec3(1e-6), lessThan(abs(cone.direction), vec3(1e-6)));
    vec3 inverse = 1.0 / d;
    vec3 forward = step(0.0, d);
    ivec3 size = ivec3(grid.size);
    Meeting met = NOTHING_MET;
    for (int i = 0; i < CONE_MOST_STEPS; ++i) {
        if (t >= end || met.t < end) {
            break;
        }
        vec3 p = cone.start + d * t;
        ivec3 cell = clamp(ivec3(floor(p)), ivec3(0), size - 1);
        vec4 texel = texelFetch(kinds, cell, 0);
        uint found = kinds_of(texel);
        float width = found >= 64u ? float(1u << (found - 64u)) : 1.0;
        vec3 out_at = (floor(p / width) * width + forward * width - p) * inverse;
        float t_out = t + max(min(out_at.x, min(out_at.y, out_at.z)), 0.0);
        if (found < 64u) {
            met = first_sheet(sheets, cone, cell, first_number(rows, texel, cell, size, 0), found, t, min(t_out, end));
            met.opacity = met.t < end ? texel.g : 0.0;
        }
        t = t_out + 1e-3;
    }
    return met;
}

ConeResult trace_cone(sampler2D atlas, sampler2D back, usampler2D sheets, usampler2D rows, sampler3D kinds, Grid grid, Cone cone)
{
    ConeResult result = ConeResult(vec3(0.0), 1.0, NOTHING_MET);
    float end = cone_end(cone, grid);
    float t = cone_begin(cone, grid);
    for (int layer = 0; layer < CONE_MOST_LAYERS; ++layer) {
        if (t >= end || result.transmittance < CONE_END) {
            break;
        }
        Meeting met = next_sheet(sheets, rows, kinds, grid, cone, end, t);
        if (met.t < end) {
            result.radiance += result.transmittance * met.opacity * leaving_light(atlas, back, rows, kinds, grid, cone, met);
            result.transmittance *= 1.0 - met.opacity;
            result.first = layer == 0 ? met : result.first;
        }
    }
    return result;
}

// The same without light: what of the cone is open.
float trace_open(usampler2D sheets, usampler2D rows, sampler3D kinds, Grid grid, Cone cone)
{
    float transmittance = 1.0;
    float end = cone_end(cone, grid);
    float t = cone_begin(cone, grid);
    for (int layer = 0; layer < CONE_MOST_LAYERS; ++layer) {
        if (t >= end || transmittance < CONE_END) {
            break;
        }
        transmittance *= 1.0 - next_sheet(sheets, rows, kinds, grid, cone, end, t).opacity;
    }
    return transmittance;
}
