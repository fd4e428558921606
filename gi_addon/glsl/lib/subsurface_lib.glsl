// The medium below a surface, as Cycles' random walk has it: isotropic scattering, no refraction at the boundary.

#include "lib/math_lib.glsl"
#include "lib/sequence_lib.glsl"

// Farther than this from all sides light diffuses, free paths.
const float DEEP = 4.0;

// Single-scattering albedo α of the half space that reflects the share A of diffuse light: the fit of M. Chiang, P. Kutz and
// B. Burley ("Practical and Controllable Subsurface Scattering for Production Path Tracing", SIGGRAPH 2016) extended by
// M. Wrenninge, R. Villemin and C. Hery ("Path Traced Subsurface Scattering using Anisotropic Phase Functions and
// Non-Exponential Free Flights", Pixar 17-07), at anisotropy 0, where 4.98511194 + 0.12735596 = 5.11246790 and so on.
float single_scattering_albedo(float a)
{
    float blend = sqrt(sqrt(a));
    float low = 1.8260523782 * pow(atan(5.1124679004 * a), 1.09686102424);
    float high = 0.496310210422 * pow(atan(4.2350080365 * a), 2.40602999408);
    return min(mix(low, high, blend), 0.999999);
}

// Decay of the diffuse field per free path: the root κ of α = 2κ / ln((1 + κ)/(1 − κ)) (K. Case and P. Zweifel, "Linear
// Transport Theory", 1967, §4.6), by its expansion at α = 1, κ² = 3(1 − α)(1 − 2/5 (1 − α))²; 2 % off at α = ½.
float diffuse_decay(float alpha)
{
    float absorbed = 1.0 - alpha;
    return min(sqrt(3.0 * absorbed) * (1.0 - 0.4 * absorbed), 0.9999);
}

vec3 single_scattering_albedo(vec3 a)
{
    return vec3(single_scattering_albedo(a.r), single_scattering_albedo(a.g), single_scattering_albedo(a.b));
}

// Share of diffuse light of `decay` from the middle of an empty sphere that comes to its side, `radius` free paths away: x/sinh x.
vec3 share_across_sphere(vec3 decay, float radius)
{
    vec3 x = decay * radius;
    return 2.0 * x / max(exp(min(x, 80.0)) - exp(-x), 2.0 * x);
}

// A number in [0, 1), and the next state.
float draw(inout uint state)
{
    state = hash_u32(state + 0x9E3779B9u);
    return unit_float(state);
}

vec3 draw_direction(inout uint state)
{
    float z = 1.0 - 2.0 * draw(state);
    float phi = TAU * draw(state);
    return vec3(sqrt(max(1.0 - z * z, 0.0)) * vec2(cos(phi), sin(phi)), z);
}
