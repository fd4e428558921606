// Radiance that leaves each cell's sheets: what the lights' reflective shadow maps show of them, and what they emit (paper
// Figure 4c, Voxel Radiance Injection).
//
// The paper scatters RSM texels into cells: their number per cell depends on both resolutions. Here each sheet asks, at the middle
// of each square that it covers. The ray from the light to that point ends on the sheet (lit, and this is what it reflects),
// before it (blocked), or behind it (no surface there). So
//     L = Σ_lit B/π / (lit + blocked)
// with B the radiosity, albedo × irradiance × cosine, by the texel's albedo and irradiance and the sheet's own normal: no
// resolution is in it, a sheet half in shadow gives half of its light, and what is rough within a cell (mouldings under grazing
// light) no more than arrives: lit facets send B by their own normals, but the dark ones beside them are in no map. What shines
// through a translucent sheet leaves by its other side.

#include "engines/vct/volume_lib.glsl"
#if HAS_RSM_DEPTH
#include "engines/rsm/rsm_lib.glsl"
#endif

layout(local_size_x = 64) in;

#if HAS_VOXEL_BOUNCE
layout(binding = 12) uniform sampler2D bounce_now;
layout(binding = 13) uniform sampler2D bounce_back_now;
#endif

#if HAS_RSM_DEPTH
// The light is on the sheet where it ends in the sheet's own cell, or as far off as a square's middle may be off what it covers,
// and faces as the sheet does, within 60°. Nearness to its plane would not do: under grazing light a shelf's shadow reaches many
// cells, however little the shelf stands out.
const float IN_CELL = 0.5 + 0.125;
const float FACING = 0.5;

// What a light does to one side of a sheet.
struct Lit {
    vec4 sum;      // radiance that is sent back, number of points that it shines on
    vec3 through;  // radiance that leaves the other side
    float blocked; // points that it does not
};

const Lit UNLIT = Lit(vec4(0.0), vec3(0.0), 0.0);

Lit sum_of(Lit a, Lit b) { return Lit(a.sum + b.sum, a.through + b.through, a.blocked + b.blocked); }

// What light of view `index` at point `p` of a sheet of normal `n`, in the cell around `center`, shows, added to the side that it
// shines on. Texels of what light shines through stand for one of its sides each, for both (rsm_frag.glsl).
void ask_view(int index, vec3 center, vec3 p, vec3 n, float covered, inout Lit front, inout Lit back)
{
    LightView v = rsm_views[index];
    vec3 at = light_view_project(v, p);
    if (any(greaterThan(abs(at.xy), vec2(1.0))) || (v.perspective > 0.5 && at.z <= 0.0)) {
        return; // another view of the light has this point, or none: then it is dark
    }
    RsmTexel t = rsm_texel(index, ivec2(v.rect.xy + (at.xy / v.guard * 0.5 + 0.5) * v.rect.zw));
    if (t.area <= 0.0) {
        return;
    }
    // Where this very ray meets the texel's plane.
    vec3 from = v.perspective > 0.5 ? v.origin_ws : p - v.axis_z * at.z;
    vec3 ray = p - from;
    float facing = dot(ray, t.normal_ws);
    vec3 hit = t.position_ws;
    if (abs(facing) > GRAZING_COS * length(ray)) {
        hit = from + ray * (dot(t.position_ws - from, t.normal_ws) / facing);
    }
    float slope = dot(ray, n);
    bool on_front = slope < 0.0;
    vec3 out_of = on_front ? n : -n;
    bool through = facing > 0.0;
    bool on_sheet = max3(abs(hit - center)) <= IN_CELL * grid_cell && dot(through ? -t.normal_ws : t.normal_ws, out_of) > FACING;
    if (!on_sheet && dot(hit - p, ray) >= 0.0) {
        return; // behind
    }
    vec4 light = vec4(0.0);
    if (on_sheet) {
        // The beam's share that falls on the sheet, whichever of its facets takes it: flux / (beam / cosine) = B cosine / cos_g.
        float cosine = abs(slope) / max(abs(facing), GRAZING_COS * length(ray));
        light = vec4(t.flux * (cosine / (t.area * PI)), 1.0);
        // What a lamp lights in its own cell's reach leaves past the lamp: the slit above a ceiling lamp shares its cell
        // with the room, which sees the lamp.
        if (rsm_lights[v.light].kind == LIGHT_MESH && distance(p, from) < 1.733 * grid_cell) {
            light.rgb *= 1.0 - covered;
        }
    }
    Lit here = Lit(vec4(through ? vec3(0.0) : light.rgb, light.a), through ? light.rgb : vec3(0.0), on_sheet ? 0.0 : 1.0);
    if (on_front) {
        front = sum_of(front, here);
    } else {
        back = sum_of(back, here);
    }
}

// What leaves the side `near` of a sheet, in units of the volumes: of what shines on it, and through from the side `far`.
vec3 leaving_mean(Lit near, Lit far)
{
    vec3 sent = near.sum.a > 0.0 ? near.sum.rgb / (near.sum.a + near.blocked) : vec3(0.0);
    vec3 through = far.sum.a > 0.0 ? far.through / (far.sum.a + far.blocked) : vec3(0.0);
    return (sent + through) / radiance_unit;
}

// No point of a cell, a ball of radius √3/2 cells, is in a view whose span its middle lies farther outside of.
bool outside_view(LightView v, vec3 center)
{
    vec3 middle = light_view_project(v, center);
    float radius = 0.867 * grid_cell;
    float away = v.perspective > 0.5 ? middle.z - radius : 1.0;
    float edge = max3(abs(vec3(middle.xy, 0.0)));
    float margin = radius / (away * min(length(v.axis_x), length(v.axis_y))) * (1.0 + edge);
    return (v.perspective > 0.5 && middle.z + radius <= 0.0) || (away > 0.0 && edge > 1.0 + margin);
}
#endif

#if HAS_VOXEL_LAMPS
// The share of a cell's face along `axis` that lamps cover. A lamp with two sides covers what one of them does.
float lamps_cover(ivec3 cell, int axis)
{
    vec4 texel = texelFetch(voxel_kinds, cell, 0);
    uint kinds = kinds_of(texel);
    float covered = 0.0;
    for (int part = 2 * axis; part < 2 * axis + 2; ++part) {
        if (kinds < 64u && (kinds >> part & 1u) == 1u) {
            uint number = first_number(voxel_rows, texel, cell, grid_size, 0) + sheets_before(kinds, part);
            covered = max(covered, texelFetch(voxel_lamps, store_texel(number), 0).r);
        }
    }
    return covered;
}
#endif

// Where half floats end. The unit keeps light below (engines/vct.py: radiance_unit) but for what lies nearer to a lamp than a
// quarter of a cell: that is as bright as what lies there.
const float HALF_END = 65504.0;

void main()
{
    uint number = invoked_number();
    ivec3 cell;
    uint kinds;
    if (!first_of_cell(voxel_places, voxel_rows, voxel_kinds, grid_size, 0, number, cell, kinds)) {
        return;
    }
    vec3 emission = vec3(0.0);
#if HAS_VOXEL_EMISSION
    emission = texelFetch(voxel_emission, store_texel(number), 0).rgb * emission_scale; // by both sides of a surface
#endif
    vec3 center = grid_low + (vec3(cell) + 0.5) * grid_cell;
    uint own = number;
    for (int part = 0; part < 6; ++part) {
        if ((kinds >> part & 1u) == 1u) {
            Sheet sheet = sheet_at(voxel_sheets, own, part);
            vec3 front = emission;
            vec3 back = emission;
#if HAS_RSM_DEPTH
            float covered = 0.0;
#if HAS_VOXEL_LAMPS
            covered = lamps_cover(cell, part >> 1);
            ivec3 before = cell + ivec3(axis_vector(part >> 1)) * ((part & 1) == 0 ? 1 : -1);
            if (all(greaterThanEqual(before, ivec3(0))) && all(lessThan(before, grid_size))) {
                covered = max(covered, lamps_cover(before, part >> 1));
            }
#endif
            vec3 n = sheet_normal(sheet, part);
            Lit lit_front = UNLIT;
            Lit lit_back = UNLIT;
            for (int index = 0; index < view_count; ++index) {
                bool outside = outside_view(rsm_views[index], center);
                for (int square = 0; square < (outside ? 0 : 16); ++square) {
                    if ((sheet.squares >> square & 1u) == 1u) {
                        vec3 p = center + sheet_point(sheet, part, square_middle(square)) * grid_cell;
                        ask_view(index, center, p, n, covered, lit_front, lit_back);
                    }
                }
                bool last = index + 1 == view_count || rsm_views[index + 1].light != rsm_views[index].light;
                if (last) {
                    front += leaving_mean(lit_front, lit_back);
                    back += leaving_mean(lit_back, lit_front);
                    lit_front = lit_back = UNLIT;
                }
            }
#endif
#if HAS_VOXEL_BOUNCE
            if (add_bounce == 1) {
                front += texelFetch(bounce_now, store_texel(own), 0).rgb;
                back += texelFetch(bounce_back_now, store_texel(own), 0).rgb;
            }
#endif
            float share = squares_share(sheet.squares);
            imageStore(voxel_radiance, store_texel(own), clamp(vec4(front, 1.0) * share, -HALF_END, HALF_END));
            imageStore(voxel_back, store_texel(own), clamp(vec4(back, 1.0) * share, -HALF_END, HALF_END));
            ++own;
        }
    }
}
