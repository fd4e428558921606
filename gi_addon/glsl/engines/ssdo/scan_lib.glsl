// The screen's samples of a slice (slice_lib.glsl). Included where `ssdo_planes` is declared.
//
// A sample stands for its surface as far as half-way to the samples before and after it, and for as much behind it as it is
// taken to be thick. The paper leaves the gaps between samples open, and loses light in them.

#include "engines/ssdo/screen_lib.glsl"
#include "engines/ssdo/slice_lib.glsl"

vec3 surface_ws(vec4 plane, ivec2 pixel, vec2 p) { return ws_from_screen(vec3(p, plane_near(plane, pixel, p))); }

// Pixels from `from` to the picture's edge along a unit direction.
float pixels_to_edge(vec2 from, vec2 along)
{
    vec2 room = mix(from, view.resolution - from, greaterThan(along, vec2(0.0)));
    vec2 d = room / max(abs(along), vec2(1e-6));
    return 0.999 * min(d.x, d.y);
}

// The screen's direction, unit in pixels, of a world direction `t` at a point of clip coordinates `c`.
vec2 screen_direction(vec4 c, vec3 t)
{
    vec4 d = view.clip_from_world * vec4(t, 0.0);
    vec2 along = (d.xy * c.w - c.xy * d.w) * view.resolution;
    return along * inversesqrt(max(dot(along, along), 1e-37));
}

// What the k-th sample along `way` (pixels) covers of a slice.
struct SliceSample {
    ivec2 pixel;
    vec4 plane;
    vec3 direction;
    float distance;  // world units; 0 where nothing is
    uint sectors;
};

SliceSample slice_sample(Slice slice, vec3 origin, vec3 position_ws, vec3 v, vec2 way, float side, int k, int steps,
                         float jitter, float thickness)
{
    float s = spacing(k, steps, jitter);
    vec2 p = origin.xy + way * s;
    SliceSample r;
    r.pixel = ivec2(p);
    r.plane = texelFetch(ssdo_planes, r.pixel, 0);
    r.sectors = 0u;
    vec3 d = surface_ws(r.plane, r.pixel, p) - position_ws;
    r.distance = r.plane.x > 0.5 * NOTHING ? length(d) : 0.0;
    r.direction = d / max(r.distance, 1e-30);
    if (r.distance > 0.0) {
        // Its surface stands for the screen half-way to the samples before and after it.
        float s_before = 0.5 * (s + (k > 0 ? spacing(k - 1, steps, jitter) : 0.0));
        float s_after = 0.5 * (s + (k + 1 < steps ? spacing(k + 1, steps, jitter) : 1.0));
        float theta = slice_angle(d, v, side);
        float before = slice_angle(surface_ws(r.plane, r.pixel, origin.xy + way * s_before) - position_ws, v, side);
        float after = slice_angle(surface_ws(r.plane, r.pixel, origin.xy + way * s_after) - position_ws, v, side);
        float behind = slice_angle(d - v * (thickness * r.distance), v, side);
        r.sectors = sectors_between(slice, min(min(theta, behind), min(before, after)),
                                    max(max(theta, behind), max(before, after)));
    }
    return r;
}
