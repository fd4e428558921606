// Light that entered the surface near by and leaves here: P. Christensen and B. Burley, "Approximate Reflectance Profiles for
// Efficient Subsurface Scattering", Pixar 15-04, eq. 3,
//   R(r)/A = (e^(−r/d) + e^(−r/3d)) / (8π d r), 1 over a plane,  d = ℓ / (1.9 − A + 3.5 (A − 0.8)²), ℓ the mean free path.
// J. Jimenez et al. ("Separable Subsurface Scattering", CGF 34, 2015) blur by two one-dimensional kernels. Here the sub-frames
// do what separability is for: a few taps each, drawn by the profile itself on the surface's tangent plane, each weighed by the
// profile at its true distance over its density. Taps that meet no such surface are left out of the mean.

#include "lib/view_lib.glsl"
#include "lib/math_lib.glsl"
#include "lib/sequence_lib.glsl"

const int TAPS = 12;

vec3 profile(float r, vec3 d)
{
    r = max(r, 1e-4 * min3(d));
    return (exp(-r / d) + exp(-r / (3.0 * d))) / (8.0 * PI * d * r);
}

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 uv = gl_FragCoord.xy * view.inverse_resolution;
    float depth = texelFetch(gbuf_depth, pixel, 0).r;
    vec4 medium = texelFetch(gbuf_subsurface, pixel, 0);
    vec3 direct_sum = vec3(0.0);
    vec3 indirect_sum = vec3(0.0);
    vec3 weights = vec3(0.0);
    float share = 0.0;
    if (depth > 0.0 && medium.a > 0.0 && max3(medium.rgb) > 0.0) {
        share = medium.a;
        vec3 position_ws = position_ws_from_depth(uv, depth);
        vec3 ng = octahedral_decode(texelFetch(gbuf_normal, pixel, 0).zw);
        vec3 albedo = saturate(texelFetch(gbuf_diffuse, pixel, 0).rgb);
        vec3 d = max(medium.rgb / (1.9 - albedo + 3.5 * (albedo - 0.8) * (albedo - 0.8)), vec3(1e-3 * max3(medium.rgb)));
        mat3 frame = frame_from_normal(ng);
        uint seed = hash_u32(uvec2(pixel + view.pixel_offset));
        vec2 turn = unit_shift(seed);
        for (int k = 0; k < TAPS; ++k) {
            vec2 u = fract(sobol_2d(view.subframe * uint(TAPS) + uint(k), 45u) + turn);
            // One number chooses the channel, then the exponential (a fourth of the profile is the narrow one), then r.
            float channel = u.x * 3.0;
            float pick = fract(channel);
            bool narrow = pick < 0.25;
            float rest = narrow ? pick * 4.0 : (pick - 0.25) / 0.75;
            float scale = channel < 1.0 ? d.x : channel < 2.0 ? d.y : d.z;
            float r = -log(max(1.0 - rest, 1e-6)) * scale * (narrow ? 1.0 : 3.0);
            vec3 there_ws = position_ws + frame * vec3(r * cos(TAU * u.y), r * sin(TAU * u.y), 0.0);
            vec3 p = project_ws(there_ws);
            if (p.z > view.clip_start && all(greaterThan(p.xy, vec2(0.0))) && all(lessThan(p.xy, vec2(1.0)))) {
                ivec2 q = ivec2(p.xy * view.resolution);
                float z = texelFetch(gbuf_depth, q, 0).r;
                if (z > 0.0 && texelFetch(gbuf_subsurface, q, 0).a > 0.0) {
                    // In the same pixel as the tangent plane's point, that point is as good as any.
                    vec3 y = q == pixel ? there_ws : position_ws_from_depth((vec2(q) + 0.5) * view.inverse_resolution, z);
                    vec3 w = profile(distance(y, position_ws), d) / dot(profile(r, d), vec3(1.0 / 3.0));
                    weights += w;
#if HAS_DIRECT_DIFFUSE
                    direct_sum += w * texelFetch(direct_diffuse, q, 0).rgb;
#endif
#if HAS_INDIRECT_DIFFUSE
                    indirect_sum += w * texelFetch(indirect_diffuse, q, 0).rgb;
#endif
                }
            }
        }
    }
    // A channel none of whose taps count keeps the light of its own point.
    bvec3 none = lessThanEqual(weights, vec3(1e-12));
#if HAS_SUBSURFACE_DIRECT
    vec3 own_direct = vec3(0.0);
#if HAS_DIRECT_DIFFUSE
    own_direct = texelFetch(direct_diffuse, pixel, 0).rgb;
#endif
    subsurface_direct = vec4(mix(direct_sum / max(weights, vec3(1e-12)), own_direct, none), share);
#endif
#if HAS_SUBSURFACE_INDIRECT
    vec3 own_indirect = vec3(0.0);
#if HAS_INDIRECT_DIFFUSE
    own_indirect = texelFetch(indirect_diffuse, pixel, 0).rgb;
#endif
    subsurface_indirect = vec4(mix(indirect_sum / max(weights, vec3(1e-12)), own_indirect, none), share);
#endif
}
