// How far a ray is clear of all surfaces by the picture. Sheets are known to a cell: a ray that leaves a lampshade or a moulding
// of a cell's size meets planes of its own surface that are not where that is, and shows its own lit side in itself. Included
// where the G-buffer's depth and normal are read, after view_lib.

// Points that the picture is asked for, as far apart (in cells), and how far from what it shows a sheet may be.
const int CLEAR_POINTS = 6;
const float CLEAR_STEP = 0.25;
const float SHEET_OFF = 1.0;

// Whether the eye sees past a point: it is before the plane of the surface that its pixel shows, or nothing is there.
bool seen_past(vec3 position_ws)
{
    vec3 s = project_ws(position_ws);
    if (s.z <= view.clip_start || any(lessThan(s.xy, vec2(0.0))) || any(greaterThanEqual(s.xy, vec2(1.0)))) {
        return false;
    }
    ivec2 pixel = ivec2(s.xy * view.resolution);
    float depth = texelFetch(gbuf_depth, pixel, 0).r;
    vec3 shown = position_ws_from_depth((vec2(pixel) + 0.5) * view.inverse_resolution, depth);
    return depth <= 0.0 || dot(position_ws - shown, octahedral_decode(texelFetch(gbuf_normal, pixel, 0).zw)) > 0.0;
}

// From where on sheets count along a ray, in cells of `cell` m: as far as the picture shows it clear, less what sheets may be off.
float clear_reach(vec3 position_ws, vec3 direction, float cell)
{
    float reach = 0.0;
    bool clear = true;
    for (int k = 1; k <= CLEAR_POINTS; ++k) {
        clear = clear && seen_past(position_ws + direction * (CLEAR_STEP * cell * float(k)));
        reach = clear ? CLEAR_STEP * float(k) : reach;
    }
    return max(reach - SHEET_OFF, 0.0);
}
