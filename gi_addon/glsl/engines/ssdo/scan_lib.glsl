// A half-plane of directions at a time, by a visibility bitmask: O. Therrien, Y. Levesque and G. Gilet, "Screen Space
// Indirect Lighting with Visibility Bitmask", The Visual Computer 39, 2023. Included where `ssdo_planes` is declared.
//
// A slice is the plane through the eye's direction v and a direction T across it, T uniform about v. Light in it is
//   E/π = mean over T of |n'| ∫ L(θ) cos(θ − γ) |sin θ| dθ,
// θ from v towards T, n' the normal's projection into the slice, γ its angle (J. Jimenez et al., "Practical Realtime
// Strategies for Accurate Indirect Occlusion", SIGGRAPH 2016 course, §5). The 32 sectors are equal in that integral, not in
// angle as in the paper, so each bit weighs the same; a random shift of their borders makes the count of bits unbiased.
// A sample stands for its surface as far as half-way to the samples before and after it: the paper leaves gaps between.

#include "engines/ssdo/screen_lib.glsl"

const float SECTORS = 32.0;

// ∫₀^θ cos(x − γ) |sin x| dx.
float slice_integral(float theta, float gamma)
{
    float a = 0.5 * theta * sin(gamma) - 0.25 * (cos(2.0 * theta - gamma) - cos(gamma));
    return theta < 0.0 ? -a : a;
}

struct Slice {
    float gamma;
    float low;       // integral at γ − π/2
    float total;     // over the half circle
    float weight;    // |n'| × total: 1 in the mean
    float shift;     // of the sectors' borders
};

Slice make_slice(vec3 n, vec3 v, vec3 t, float shift)
{
    Slice slice;
    float x = dot(n, v);
    float y = dot(n, t);
    slice.gamma = atan(y, max(x, 1e-6));
    slice.low = slice_integral(slice.gamma - 0.5 * PI, slice.gamma);
    slice.total = slice_integral(slice.gamma + 0.5 * PI, slice.gamma) - slice.low;
    slice.weight = sqrt(x * x + y * y) * slice.total;
    slice.shift = shift;
    return slice;
}

// The sectors' count below angle θ.
int sectors_below(Slice slice, float theta)
{
    float clamped = clamp(theta, slice.gamma - 0.5 * PI, slice.gamma + 0.5 * PI);
    float u = (slice_integral(clamped, slice.gamma) - slice.low) / max(slice.total, 1e-6);
    return int(clamp(floor(u * SECTORS + slice.shift), 0.0, SECTORS));
}

// Bits below the n-th.
uint bits_below(int n) { return n >= 32 ? 0xFFFFFFFFu : (1u << uint(n)) - 1u; }

uint sectors_between(Slice slice, float a, float b)
{
    return bits_below(sectors_below(slice, max(a, b))) & ~bits_below(sectors_below(slice, min(a, b)));
}

// Angle from v of a direction in the slice, on the side of T where `side` is 1.
float slice_angle(vec3 d, vec3 v, float side) { return side * acos(clamp(dot(d, v) * inversesqrt(max(dot(d, d), 1e-37)), -1.0, 1.0)); }

vec3 surface_ws(vec4 plane, ivec2 pixel, vec2 p) { return ws_from_screen(vec3(p, plane_near(plane, pixel, p))); }

// Pixels from `from` to the picture's edge along a unit direction.
float pixels_to_edge(vec2 from, vec2 along)
{
    vec2 room = mix(from, view.resolution - from, greaterThan(along, vec2(0.0)));
    vec2 d = room / max(abs(along), vec2(1e-6));
    return 0.999 * min(d.x, d.y);
}

// The angle in the middle of a sector, by halving: the integral grows with θ.
float slice_middle(Slice slice, int sector)
{
    float target = (clamp(float(sector) + 0.5 - slice.shift, 0.0, SECTORS)) / SECTORS * slice.total + slice.low;
    float low = slice.gamma - 0.5 * PI;
    float high = slice.gamma + 0.5 * PI;
    for (int i = 0; i < 10; ++i) {
        float middle = 0.5 * (low + high);
        if (slice_integral(middle, slice.gamma) < target) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return 0.5 * (low + high);
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
