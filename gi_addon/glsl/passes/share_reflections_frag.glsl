// What neighbouring pixels' reflected rays found, shared: T. Stachowiak and Y. Uludag, "Stochastic Screen-Space Reflections",
// SIGGRAPH 2015 course. Two rounds: rays, each weighed anew by the lobe that takes it; then the lobes' means, among pixels that
// mirror the same.
//
// 1. Pixel q's ray, of density p_q, is one that p could have drawn with density p_p. The rays of p and of each q are weighed
// by pairs, so that their sum is the integral over p's lobe, whatever the lobes (balance heuristic: E. Veach and L. Guibas,
// SIGGRAPH 1995; by pairs: B. Bitterli, "Correlations and Reuse for Fast and Accurate Physically Based Light Transport",
// 2022). With w_q the weight of q as a neighbour, w_p = 1, and k rays of neighbours for one of p's own:
//   Σ_q w_q [ s(l_q) L_q k p_p(l_q) / (k p_q(l_q) + p_p(l_q)) + s(l_p) L_p p_p(l_p) / (k p_q(l_p) + p_p(l_p)) ] / Σ_q w_q,
// s = F G2/G1 of p's lobe. No share is above w_q k, whatever the densities. It holds for all normals and textures of roughness;
// what it supposes is that q and p receive the same light along l_q.
// 2. A pixel whose mirrored view direction r and alpha are p's shares its mean over the lobe, relative to the lobe's albedo.
//
// How far off neighbours may be: a lobe of GGX alpha is a blur of what a mirror shows, by half vectors of slope variance α²/2
// per axis (Beckmann's relation), directions of 2α². From a pixel Δx beside p, what is mirrored at a distance t is seen from
// beside, an angle |Δx/t + Δr| off. Weights that are Gaussian in this angle, of variance ε 2α², make the lobe's variance
// 1 + ε times as large; so does another alpha, √2 α being as much wider. Round 1 has ε and no Δr, round 2 has ε/4: with ε = .08
// the lobe is 5 % wider, √1.1, and no more at a contact, where t is small. Mirrors have no neighbours.
//
// Weights that hang on a ray's own t would prefer some rays to others. So t is what the pixels around met, in round 1 a typical
// value; and what a ray met that is nearer than |Δx| over two standard deviations of the angle is no neighbour's to draw: as for
// directions below its horizon, p_q = 0 there, and p's own rays count in full.

#include "lib/view_lib.glsl"
#include "lib/bsdf_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "lib/reflection_lib.glsl"

// What is shared, by round: the rays' own light, then what the first round made of it.
#if SHARING_ROUND == 2
#define FOUND traced_near
#elif SHARED == SHARED_SOURCES
#define FOUND traced_sources
#else
#define FOUND traced
#endif

const float WIDENING = SHARING_ROUND == 1 ? 0.08 : 0.02;
// Pairs of opposite pixels that are asked in each round.
const int PAIRS = SHARING_ROUND == 1 ? 16 : 6;
// k: a disc to two σ has weights of .43 in the mean.
const float RAYS = 0.86 * float(PAIRS);
// No neighbour is farther off than this share of the picture's height, however far what is mirrored.
const float FARTHEST = 1.0 / 16.0;

struct Sum {
    vec3 light;
    float own;          // of round 1: what the pixel's own ray counts
    float nearness;
    float weight;
};

bool outside(ivec2 pixel)
{
    return any(lessThan(pixel, ivec2(0))) || any(greaterThanEqual(pixel, textureSize(FOUND, 0)));
}

// Nearness of what is mirrored around a pixel: the mean's square of its root, which a few rays to a contact do not rule.
float typical_nearness(ivec2 pixel)
{
    vec2 sum = vec2(0.0);
    for (int y = -1; y <= 1; ++y) {
        for (int x = -1; x <= 1; ++x) {
            ivec2 other = clamp(pixel + ivec2(x, y), ivec2(0), textureSize(FOUND, 0) - 1);
            float nearness = texelFetch(FOUND, other, 0).a;
            sum += nearness >= 0.0 ? vec2(sqrt(nearness), 1.0) : vec2(0.0);
        }
    }
    return sqr(sum.x / sum.y);
}

// Adds what pixel `other` has to share. `own_ray` is `here`'s: direction, density; and the nearness of what it met.
void ask(ivec2 other, Glossy here, Lobe lobe, vec4 own_ray, float own_nearness, float nearness, float variance,
         inout Sum sum)
{
    if (outside(other)) {
        return;
    }
    vec4 found = texelFetch(FOUND, other, 0);
    Glossy there = glossy_at(other);
    if (found.a < 0.0 || !there.exists) {
        return;
    }
    vec3 off = there.position_ws - here.position_ws;
#if SHARING_ROUND == 1
    float beside = dot(off, off);
    float w = exp(-0.5 * beside * sqr(nearness) / variance);
    vec4 ray = texelFetch(traced_ray, other, 0);
    float density = reflected_pdf(here, ray.xyz);
    if (ray.w > 0.0 && density > 0.0 && beside * sqr(found.a) <= 4.0 * variance) {
        sum.light += w * RAYS * density / (RAYS * ray.w + density) * reflected_share(here, lobe, ray.xyz) * found.rgb;
    }
    if (own_ray.w > 0.0) {
        float other_density = beside * sqr(own_nearness) <= 4.0 * variance ? reflected_pdf(there, own_ray.xyz) : 0.0;
        sum.own += w * own_ray.w / (RAYS * other_density + own_ray.w);
    }
#else
    off = off * nearness + reflect(-there.v, there.n) - reflect(-here.v, here.n);
    float wider = sqrt(2.0) * (there.alpha - here.alpha);
    float w = exp(-0.5 * (dot(off, off) + sqr(wider)) / variance);
    sum.light += w * found.rgb;
#endif
    sum.nearness += w * found.a;
    sum.weight += w;
}

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 light = texelFetch(FOUND, pixel, 0);
    if (light.a >= 0.0) {
        Glossy here = glossy_at(pixel);
        Lobe lobe = lobe_unpack(texelFetch(gbuf_specular, pixel, 0), texelFetch(gbuf_lobe, pixel, 0));
        float cos_v = dot(here.n, here.v);
        vec4 own_ray = vec4(0.0);
#if SHARING_ROUND < 2
        own_ray = texelFetch(traced_ray, pixel, 0);
        light.rgb *= own_ray.w > 0.0 ? reflected_share(here, lobe, own_ray.xyz) : vec3(0.0);
#endif
#if SHARING_ROUND > 0
        float nearness = SHARING_ROUND == 1 ? typical_nearness(pixel) : light.a;
        float variance = 2.0 * WIDENING * sqr(here.alpha);
        // A step of one pixel on a surface that faces the eye turns the mirrored ray by its own angle, and what is mirrored
        // is as much farther off.
        float turn = pixel_width(texelFetch(gbuf_depth, pixel, 0).r) * nearness;
        turn += SHARING_ROUND == 1 || view.orthographic > 0.5 ? 0.0 : view.pixel_size;
        float reach = min(2.0 * sqrt(variance) / max(turn, 1e-20), FARTHEST * view.resolution.y);
        Sum sum = Sum(vec3(0.0), 1.0, light.a, 1.0);
        if (reach > 0.5) {
            uint seed = hash_u32(uvec3(pixel + view.pixel_offset, 2u * view.subframe + uint(SHARING_ROUND)));
            vec2 shift = unit_shift(seed);
            for (int i = 0; i < PAIRS; ++i) {
                vec2 u = fract(r2_sequence(uint(i)) + shift);
                float phi = PI * u.y;
                ivec2 step_ = ivec2(round(reach * sqrt(u.x) * vec2(cos(phi), sin(phi))));
                ask(pixel + step_, here, lobe, own_ray, light.a, nearness, variance, sum);
                ask(pixel - step_, here, lobe, own_ray, light.a, nearness, variance, sum);
            }
        }
        light = vec4(light.rgb * sum.own + sum.light, sum.nearness) / sum.weight;
#endif
        vec3 albedo = lobe_albedo(brdf_albedo, brdf_average, brdf_energy, lobe, cos_v);
        vec3 gain = multiscatter_gain(brdf_energy, brdf_average, lobe, cos_v);
#if SHARING_ROUND == 0
        light.rgb *= gain;
#elif SHARING_ROUND == 1
        light.rgb *= safe_divide(gain, albedo);
#else
        light.rgb *= albedo;
#endif
    }
#if SHARING_ROUND == 1
    traced_near = light;
#elif SHARED == SHARED_SOURCES
    reflected_sources = vec4(light.rgb, 1.0);
#else
    indirect_glossy = vec4(light.rgb, 1.0);
#endif
}
