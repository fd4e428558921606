// Light that a reflective shadow map's texel sends into a body, to where it leaves it: the paper's second volume, of transmitted light
// (§IV-C). Volumes of light add up, and this light is carried as all other is, so that it goes into the same one.
//
// A texel reflects Φ = ρ E A_t as if all light left where it enters. Of the share σ of it that scatters below the surface it takes
// one walk (passes/body_walk.glsl), forwards, between the sheets of the bodies, and stands for w Φ/A that leaves there, w what
// the walk keeps and A the half space's albedo; with the share 1 − σ of the texels' light it stands for itself. Many texels
// light a cell: their mean is the transport's. Where the free path is small ⟨w⟩ = A, and nothing has moved.

#include "passes/body_walk.glsl"

// Moves what a texel sends out, if it does, to where it leaves the body, in cells of the bodies' grid.
void through_body(inout RsmTexel t, uint seed)
{
    vec3 p = (t.position_ws - body_low) / body_cell;
    // The sheet that the texel lies on; it may run along two cells' border.
    int part = -1;
    uint number = 0u;
    ivec3 cell = ivec3(0);
    float nearest = 0.25;
    for (int k = 0; k < 2; ++k) {
        ivec3 at = ivec3(floor(p + t.normal_ws * (k == 0 ? -1e-3 : 1e-3)));
        if (any(lessThan(at, ivec3(0))) || any(greaterThanEqual(at, body_size))) {
            continue;
        }
        vec4 texel = texelFetch(voxel_kinds, at, 0);
        uint kinds = kinds_of(texel);
        uint own = kinds < 64u ? first_number(voxel_rows, texel, at, body_size, 0) : 0u;
        for (int i = 0; i < 6; ++i) {
            if (kinds < 64u && (kinds >> i & 1u) == 1u) {
                Sheet sheet = sheet_at(voxel_sheets, own, i);
                float away = abs(sheet_height(sheet, i, p - vec3(at) - 0.5));
                if (away < nearest && dot(sheet_normal(sheet, i), t.normal_ws) > 0.5) {
                    nearest = away;
                    part = i;
                    number = own;
                    cell = at;
                }
                ++own;
            }
        }
    }
    Body body = unpack_body(texelFetch(voxel_bodies, store_texel(number), 0));
    uint state = seed;
    if (part < 0 || draw(state) >= body.share) {
        return;
    }
    // A colour with its own free path has walks of its own.
    bool together = max3(body.path) - min3(body.path) <= 1e-3 * max3(body.path);
    int channel = int(3.0 * draw(state));
    if (body.path[channel] < WALK_SHORT) {
        t.flux *= together ? vec3(1.0) : 3.0 * vec3(equal(ivec3(channel), ivec3(0, 1, 2)));
        return;
    }
    Sheet sheet = sheet_at(voxel_sheets, number, part);
    vec2 uv = across_axis(p - vec3(cell) - 0.5, part >> 1);
    vec3 start = vec3(cell) + 0.5 + sheet_point(sheet, part, uv);
    vec3 albedo = max(body.albedo, vec3(1e-3));
    mat3 frame = frame_from_normal(sheet_normal(sheet, part));
    vec3 direction = way_in(body, frame, vec2(draw(state), draw(state)), state);
    Grid grid = Grid(body_low, body_cell, vec3(body_size), 0.0);
    Walk walk = walk_below(voxel_sheets, voxel_rows, voxel_kinds, voxel_bodies, grid, start, direction, body.path[channel],
                           single_scattering_albedo(albedo), state);
    t.flux *= walk.weight / albedo * (together ? vec3(1.0) : 3.0 * vec3(equal(ivec3(channel), ivec3(0, 1, 2))));
    if (max3(walk.weight) > 0.0) {
        t.position_ws = body_low + walk.at * body_cell;
        t.normal_ws = sheet_normal(sheet_at(voxel_sheets, walk.number, walk.part), walk.part);
    }
}
