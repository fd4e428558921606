// A half-plane of directions at a time, by a visibility bitmask: O. Therrien, Y. Levesque and G. Gilet, "Screen Space
// Indirect Lighting with Visibility Bitmask", The Visual Computer 39, 2023.
//
// A slice is the plane through the eye's direction v and a direction T across it, T uniform about v. Light in it is
//   E/π = mean over T of |n'| ∫ L(θ) cos(θ − γ) |sin θ| dθ,
// θ from v towards T, n' the normal's projection into the slice, γ its angle (J. Jimenez et al., "Practical Realtime
// Strategies for Accurate Indirect Occlusion", SIGGRAPH 2016 course, §5). The 32 sectors are equal in that integral, not in
// angle as in the paper, so each bit weighs the same; a random shift of their borders makes the count of bits unbiased.
//
// Directions in a slice are unit vectors (cos θ, sin θ), since with c and s for those the integral needs one arc cosine and no
// other trigonometry:  ∫₀^θ cos(x − γ) |sin x| dx = ½ (|θ| sin γ + |s| (s cos γ − c sin γ)).

#include "lib/math_lib.glsl"

const float SECTORS = 32.0;

// Within 7e-5 (M. Abramowitz and I. Stegun, "Handbook of Mathematical Functions", 1964, 4.4.45): a 400th of a sector.
float arc_cosine(float x)
{
    float a = abs(x);
    float y = sqrt(max(1.0 - a, 0.0)) * (1.5707288 + a * (-0.2121144 + a * (0.0742610 - a * 0.0187293)));
    return x < 0.0 ? PI - y : y;
}

struct Slice {
    vec2 normal;     // (cos γ, sin γ)
    float low;       // integral at γ − π/2
    float total;     // over the half circle
    float weight;    // |n'| × total: 1 in the mean
    float shift;     // of the sectors' borders
};

float slice_integral(Slice slice, vec2 d)
{
    return 0.5 * (arc_cosine(d.x) * slice.normal.y + abs(d.y) * (d.y * slice.normal.x - d.x * slice.normal.y));
}

Slice make_slice(vec3 n, vec3 v, vec3 t, float shift)
{
    Slice slice;
    vec2 projected = vec2(max(dot(n, v), 1e-6), dot(n, t));
    slice.normal = normalize(projected);
    slice.low = slice_integral(slice, vec2(slice.normal.y, -slice.normal.x));
    slice.total = slice_integral(slice, vec2(-slice.normal.y, slice.normal.x)) - slice.low;
    slice.weight = length(projected) * slice.total;
    slice.shift = shift;
    return slice;
}

// The sectors' count below a direction; what is behind the surface counts as its horizon.
int sectors_below(Slice slice, vec2 d)
{
    if (dot(d, slice.normal) <= 0.0) {
        return d.y > 0.0 ? int(SECTORS) : 0; // |γ| < π/2
    }
    float u = (slice_integral(slice, d) - slice.low) / max(slice.total, 1e-6);
    return int(clamp(floor(u * SECTORS + slice.shift), 0.0, SECTORS));
}

// Bits below the n-th.
uint bits_below(int n) { return n >= 32 ? 0xFFFFFFFFu : (1u << uint(n)) - 1u; }

uint sectors_between(Slice slice, vec2 a, vec2 b)
{
    int i = sectors_below(slice, a);
    int j = sectors_below(slice, b);
    return bits_below(max(i, j)) & ~bits_below(min(i, j));
}

// Those above the triangle that a surface with the normal `ng` lies on.
uint sectors_above(Slice slice, vec3 ng, vec3 v, vec3 t)
{
    vec2 h = normalize(vec2(max(dot(ng, v), 1e-6), dot(ng, t)));
    return sectors_between(slice, vec2(h.y, -h.x), vec2(-h.y, h.x));
}

// The direction in the middle of a sector, by halving: the integral grows with θ.
vec2 slice_middle(Slice slice, int sector)
{
    float target = (clamp(float(sector) + 0.5 - slice.shift, 0.0, SECTORS)) / SECTORS * slice.total + slice.low;
    float low = -0.5 * PI;
    float high = 0.5 * PI;
    vec2 d = slice.normal;
    for (int i = 0; i < 10; ++i) {
        float middle = 0.5 * (low + high);
        d = mat2(slice.normal, vec2(-slice.normal.y, slice.normal.x)) * vec2(cos(middle), sin(middle));
        if (slice_integral(slice, d) < target) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return d;
}
