// The screen's samples of a slice (slice_lib.glsl), one side of it at a time. Included where `ssdo_planes` and `ssdo_box`
// are declared.
//
// A sample stands for its surface as far as that goes: to where it meets the plane of the next sample, if that is between the
// two, and half-way else; and for as much behind it as it is taken to be thick. The paper leaves the gaps between samples
// open, and loses light in them.
//
// In slice coordinates (x along v, y along T) the point at a share s of the way, with nearness q, is
//   (g (q − q₀) + s a.x, s a.y) / q   (orthographic: without / q),
// g and a constant along the way: d = o + z D(s) − p with D linear in s and p = o + z₀ D(0), D(0) = −|D(0)| v, z = 1/q.
// Directions need no division, and no position in the world.

#include "engines/ssdo/screen_lib.glsl"
#include "engines/ssdo/slice_lib.glsl"

// Pixels from `from`, along a unit direction, to the edge of what is drawn, or of the scene on it: no step is spent on nothing.
float pixels_to_edge(vec2 from, vec2 along)
{
    vec2 room = mix(from - ssdo_box.xy, ssdo_box.zw - from, greaterThan(along, vec2(0.0)));
    vec2 d = max(room, 0.0) / max(abs(along), vec2(1e-6));
    return 0.999 * min(d.x, d.y);
}

// The screen's direction, unit in pixels, of a world direction `t` at a point of clip coordinates `c`.
vec2 screen_direction(vec4 c, vec3 t)
{
    vec4 d = view.clip_from_world * vec4(t, 0.0);
    vec2 along = (d.xy * c.w - c.xy * d.w) * view.resolution;
    return along * inversesqrt(max(dot(along, along), 1e-37));
}

struct ScreenSample {
    ivec2 pixel;
    vec4 plane;
    float s;      // share of the way
};

struct Scan {
    vec3 origin;      // the receiver in screen coordinates
    vec2 way;         // pixels
    vec2 across;      // a
    float per_near;   // g
    int steps;
    float jitter;
    float thickness;
    float pixel;      // share of the way that is one pixel
    ScreenSample last;
    float since;      // share of the way from where `last` stands
};

Scan begin_scan(sampler2D planes, vec3 origin, vec3 v, vec3 t, vec2 way, int steps, float jitter, float thickness)
{
    Scan scan;
    bool perspective = view.orthographic < 0.5;
    vec2 uv = way * view.inverse_resolution;
    vec3 change = perspective ? view.direction_u * uv.x + view.direction_v * uv.y : view.origin_u * uv.x + view.origin_v * uv.y;
    float eye = length(ray_direction_ws(origin.xy * view.inverse_resolution));
    scan.origin = origin;
    scan.way = way;
    scan.across = vec2(dot(change, v), dot(change, t));
    scan.per_near = perspective ? eye / origin.z : eye;
    scan.steps = steps;
    scan.jitter = jitter;
    scan.pixel = inversesqrt(max(dot(way, way), 1.0));
    scan.thickness = thickness;
    scan.last.pixel = ivec2(origin.xy);
    scan.last.plane = texelFetch(planes, scan.last.pixel, 0);
    scan.last.s = 0.0;
    scan.since = 0.0;
    return scan;
}

// Direction, with a length of its own, of a sample's surface continued to a share of the way.
vec2 slice_toward(Scan scan, ScreenSample a, float s)
{
    return vec2(scan.per_near * (plane_near(a.plane, a.pixel, scan.origin.xy + scan.way * s) - scan.origin.z), 0.0) + scan.across * s;
}

vec2 unit(vec2 d) { return d * inversesqrt(max(dot(d, d), 1e-37)); }

float plane_at(ScreenSample a, vec2 p) { return a.plane.x + dot(a.plane.yz, p - (vec2(a.pixel) + 0.5)); }

// What a sample covers of a slice.
struct Covered {
    ScreenSample at;
    vec2 direction;   // unit, in the slice
    float distance;   // world units; 0 where nothing is
    uint lit;         // sectors in which it is seen
    uint sectors;     // and those behind it that it fills
};

// What the pixel before the k-th sample's covers, which is known when that is another: k from 0 to `steps`, where the way ends.
// All samples of one pixel are one. The receiver's own pixel covers nothing. `end` is the plane where the thing ends that the sample
// shows; NOTHING where that is not known, and guessed.
Covered scan_next(sampler2D planes, inout Scan scan, Slice slice, int k, vec4 end)
{
    ScreenSample a = scan.last;
    ScreenSample b = a;
    Covered r = Covered(a, vec2(1.0, 0.0), 0.0, 0u, 0u);
    float until = 1.0;
    if (k < scan.steps) {
        // The last one is a pixel before the end, which may be where the scene ends: of that pixel's surface is the rest.
        b.s = mix(scan.pixel, max(1.0 - scan.pixel, scan.pixel), spacing(float(k), scan.steps, scan.jitter));
        b.pixel = ivec2(scan.origin.xy + scan.way * b.s);
        if (b.pixel == a.pixel) {
            scan.last = b;
            return r;
        }
        b.plane = texelFetch(planes, b.pixel, 0);
        // A pixel is known at its middle: the edge may be before the sample of `a`, or a pixel behind that of `b`.
        float latest = b.s + scan.pixel;
        vec2 p = scan.origin.xy + scan.way * scan.since;
        vec2 p_latest = scan.origin.xy + scan.way * latest;
        float gap = plane_at(a, p) - plane_at(b, p);
        float gap_latest = plane_at(a, p_latest) - plane_at(b, p_latest);
        // A receiver on the edge itself is on both planes, to rounding.
        float least = 0.1 * nearness_of_pixel(scan.origin);
        bool at_edge = a.pixel == ivec2(scan.origin.xy) && abs(gap) < least && abs(gap_latest) > least;
        gap = at_edge ? 0.0 : gap;
        // A way that runs along an edge has been beyond it for some pixels whose middles are not: it passed it before `since` if
        // b, continued to the middle of `a`, is on the other side of a.
        float gap_middle = a.plane.x - plane_at(b, vec2(a.pixel) + 0.5);
        bool passed = gap * gap_middle < 0.0 && gap * (gap_latest - gap) > 0.0;
        // Two samples of one plane meet anywhere, by rounding.
        bool differ = max(abs(gap), abs(gap_latest)) > 0.1 * nearness_of_pixel(vec3(0.0, 0.0, b.plane.x));
        bool meet = (at_edge || differ && (passed || gap * gap_latest < 0.0)) && min(a.plane.x, b.plane.x) > 0.5 * NOTHING;
        until = meet ? max(mix(scan.since, latest, gap / (gap - gap_latest)), 0.0) : max(scan.since, sqr(0.5 * (sqrt(a.s) + sqrt(b.s))));
    }
    if (a.plane.x > 0.5 * NOTHING && a.pixel != ivec2(scan.origin.xy)) {
        vec2 d = slice_toward(scan, a, a.s);
        float far = length(d);
        r.direction = d / max(far, 1e-30);
        r.distance = view.orthographic > 0.5 ? far : far / plane_near(a.plane, a.pixel, scan.origin.xy + scan.way * a.s);
        // What begins at the receiver itself begins at its horizon.
        int before = scan.since > 0.0 ? sectors_below(slice, unit(slice_toward(scan, a, scan.since)))
                                      : scan.across.y > 0.0 ? int(SECTORS) : 0;
        int after = sectors_below(slice, unit(slice_toward(scan, a, until)));
        vec2 past = d - vec2(scan.thickness * far, 0.0);
        if (end.x > 0.5 * NOTHING) {
            past = slice_toward(scan, ScreenSample(a.pixel, end, a.s), a.s);
        }
        int behind = sectors_below(slice, unit(past));
        r.lit = bits_below(max(before, after)) & ~bits_below(min(before, after));
        r.sectors = r.lit | bits_below(max(after, behind)) & ~bits_below(min(after, behind));
    }
    scan.last = b;
    scan.since = until;
    return r;
}
