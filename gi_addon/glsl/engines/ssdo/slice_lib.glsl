// A half-plane of directions at a time, by a visibility bitmask: O. Therrien, Y. Levesque and G. Gilet, "Screen Space
// Indirect Lighting with Visibility Bitmask", The Visual Computer 39, 2023.
//
// A slice is the plane through the eye's direction v and a direction T across it, T uniform about v. Light in it is
//   E/π = mean over T of |n'| ∫ L(θ) cos(θ − γ) |sin θ| dθ,
// θ from v towards T, n' the normal's projection into the slice, γ its angle (J. Jimenez et al., "Practical Realtime
// Strategies for Accurate Indirect Occlusion", SIGGRAPH 2016 course, §5). The 32 sectors are equal in that integral, not in
// angle as in the paper, so each bit weighs the same; a random shift of their borders makes the count of bits unbiased.

#include "lib/math_lib.glsl"

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
