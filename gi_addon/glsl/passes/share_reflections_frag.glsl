// What neighbouring pixels' reflected rays found, shared among pixels whose lobes show the same (T. Stachowiak and Y. Uludag,
// "Stochastic Screen-Space Reflections", SIGGRAPH 2015 course, share rays too, and re-weigh each by the receiver's lobe; here
// the receivers are those for whom the weights are one).
//
// A lobe of GGX alpha is a blur of what a mirror shows: half vectors of slope variance α²/2 per axis (Beckmann's relation),
// directions of 2α². A pixel q that lies Δx beside p, what it mirrors being at a distance t, shows p's blur from beside:
// its mirrored point is Δx + t Δr off p's, r the mirrored view direction, an angle |Δx/t + Δr|. Taking q's rays for p's with
// weights that are Gaussian in this angle, of variance ε 2α², makes the lobe's variance 1 + ε times as large. It holds
// flat and curved surfaces, normal maps, the eye's parallax and contacts alike, and mirrors, whose neighbours all differ,
// stay as they are. So does a lobe of another width count: √(2) α differs by as much. There are two rounds, of σ/2 and σ, together
// (1 + ¼) ε: with ε = .08 the lobe is 5 % wider, √1.1.
//
// 1/t is its mean over what a pixel's neighbours met, not its own ray's: weights that hang on a ray would prefer some
// rays to others.
//
// Energy: weights are shares of one, and what is shared is light over the lobe's albedo (reflection_lib.glsl), so an even light
// stays what it is.

#include "lib/view_lib.glsl"
#include "lib/bsdf_lib.glsl"
#include "lib/sequence_lib.glsl"

// What is shared, by round: the rays' own light, then what the first round made of it.
#if SHARING_ROUND == 2
#define FOUND traced_near
#elif SHARED == SHARED_SOURCES
#define FOUND traced_sources
#else
#define FOUND traced
#endif

const float WIDENING = 0.08;
// Pairs of opposite pixels that are asked in each round.
const int PAIRS = 8;
// The kernel ends at two σ; nor does it go farther than this share of the picture's height, however far what is mirrored.
const float FARTHEST = 1.0 / 16.0;

struct Mirror {
    bool exists;
    vec3 position_ws;
    vec3 mirrored;      // the view direction, mirrored
    float alpha;
};

Mirror mirror_at(ivec2 pixel)
{
    vec2 uv = (vec2(pixel) + 0.5) * view.inverse_resolution;
    float depth = texelFetch(gbuf_depth, pixel, 0).r;
    vec3 n = octahedral_decode(texelFetch(gbuf_normal, pixel, 0).xy);
    float alpha = max(sqr(texelFetch(gbuf_specular, pixel, 0).a), ALPHA_MIN);
    return Mirror(depth > 0.0, position_ws_from_depth(uv, depth), reflect(-view_direction_ws(uv), n), alpha);
}

bool outside(ivec2 pixel)
{
    return any(lessThan(pixel, ivec2(0))) || any(greaterThanEqual(pixel, textureSize(FOUND, 0)));
}

// Mean nearness around a pixel.
float mean_nearness(ivec2 pixel)
{
    vec2 sum = vec2(0.0);
    for (int y = -1; y <= 1; ++y) {
        for (int x = -1; x <= 1; ++x) {
            ivec2 other = clamp(pixel + ivec2(x, y), ivec2(0), textureSize(FOUND, 0) - 1);
            float nearness = texelFetch(FOUND, other, 0).a;
            sum += nearness >= 0.0 ? vec2(nearness, 1.0) : vec2(0.0);
        }
    }
    return sum.x / sum.y;
}

// Weight and weighted light of pixel `other`.
void ask(ivec2 other, Mirror here, float nearness, float variance, inout vec4 light, inout float weight)
{
    if (outside(other)) {
        return;
    }
    vec4 found = texelFetch(FOUND, other, 0);
    Mirror there = mirror_at(other);
    if (found.a < 0.0 || !there.exists) {
        return;
    }
    vec3 off = (there.position_ws - here.position_ws) * nearness + there.mirrored - here.mirrored;
    float wider = sqrt(2.0) * (there.alpha - here.alpha);
    float w = exp(-0.5 * (dot(off, off) + sqr(wider)) / variance);
    light += w * found;
    weight += w;
}

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 uv = gl_FragCoord.xy * view.inverse_resolution;
    vec4 light = texelFetch(FOUND, pixel, 0);
    if (light.a >= 0.0) {
#if SHARING_ROUND > 0
        Mirror here = mirror_at(pixel);
        float depth = texelFetch(gbuf_depth, pixel, 0).r;
        float nearness = SHARING_ROUND == 1 ? mean_nearness(pixel) : light.a;
        float variance = 2.0 * WIDENING * sqr(here.alpha) * (SHARING_ROUND == 1 ? 0.25 : 1.0);
        // A step of one pixel on a surface that faces the eye turns the mirrored ray by its own angle, and what is mirrored
        // is as much farther off.
        float turn = pixel_width(depth) * nearness + (view.orthographic > 0.5 ? 0.0 : view.pixel_size);
        float reach = min(2.0 * sqrt(variance) / max(turn, 1e-20), FARTHEST * view.resolution.y);
        float weight = 1.0;
        if (reach > 0.5) {
            uint seed = hash_u32(uvec3(pixel + view.pixel_offset, 2u * view.subframe + uint(SHARING_ROUND)));
            vec2 shift = unit_shift(seed);
            for (int i = 0; i < PAIRS; ++i) {
                vec2 u = fract(r2_sequence(uint(i)) + shift);
                float phi = PI * u.y;
                ivec2 step_ = ivec2(round(reach * sqrt(u.x) * vec2(cos(phi), sin(phi))));
                ask(pixel + step_, here, nearness, variance, light, weight);
                ask(pixel - step_, here, nearness, variance, light, weight);
            }
        }
        light /= weight;
#endif
#if SHARING_ROUND != 1
        Lobe lobe = lobe_unpack(texelFetch(gbuf_specular, pixel, 0), texelFetch(gbuf_lobe, pixel, 0));
        float cos_v = dot(octahedral_decode(texelFetch(gbuf_normal, pixel, 0).xy), view_direction_ws(uv));
        light.rgb *= lobe_albedo(brdf_albedo, brdf_average, brdf_energy, lobe, max(cos_v, 1e-3));
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
