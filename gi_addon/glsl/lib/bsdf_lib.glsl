// GGX reflection with Fresnel, the glossy lobe of Blender's Principled BSDF.
//
// B. Walter et al., "Microfacet Models for Refraction through Rough Surfaces", EGSR 2007 (D, G);
// E. Heitz, "Understanding the Masking-Shadowing Function", JCGT 3(2), 2014 (height-correlated G2);
// C. Kulla and A. Conty, "Revisiting Physically Based Shading at Imageworks", 2017 (energy lost to multiple bounces).
//
// A lobe is (f0, f90, roughness, eta, multiscatter). `eta` picks the curve between f0 at normal and f90 at grazing
// incidence: > 0 a dielectric's real Fresnel curve of that index, ETA_SCHLICK Schlick's, ETA_CONSTANT none (f0 at every
// angle). Roughness is Blender's: GGX alpha is its square.

#include "lib/math_lib.glsl"

const float ETA_SCHLICK = 0.0;
const float ETA_CONSTANT = -1.0;
// Below this alpha the float32 GGX peak 1/(π α²) meets its own rounding: a mirror.
const float ALPHA_MIN = 1e-4;

struct Lobe {
    vec3 f0;
    float f90;
    float roughness;
    float eta;
    float multiscatter;
};

// As the G-buffer keeps it: (f0, roughness) and (eta, f90, multiscatter).
Lobe lobe_unpack(vec4 specular, vec4 packed_lobe)
{
    return Lobe(specular.rgb, packed_lobe.g, specular.a, packed_lobe.r, packed_lobe.b);
}

bool lobe_reflects(Lobe lobe) { return max3(lobe.f0) > 0.0 || lobe.f90 > 0.0; }

float f0_from_ior(float ior) { return sqr((ior - 1.0) / (ior + 1.0)); }

float ior_from_f0(float f0)
{
    float root = sqrt(clamp(f0, 0.0, 0.9999));
    return (1.0 + root) / (1.0 - root);
}

// Unpolarised Fresnel reflectance of a dielectric, eta = n_inside / n_outside. 1 under total internal reflection.
float fresnel_dielectric(float cos_i, float eta)
{
    float c = abs(cos_i);
    float g2 = eta * eta - 1.0 + c * c;
    if (g2 <= 0.0) {
        return 1.0;
    }
    float g = sqrt(g2);
    float a = (g - c) / (g + c);
    float b = ((g + c) * c - 1.0) / ((g - c) * c + 1.0);
    return 0.5 * a * a * (1.0 + b * b);
}

// Where between f0 and f90 the reflectance is at this angle.
float fresnel_curve(float cos_i, float eta)
{
    if (eta == ETA_CONSTANT) {
        return 0.0;
    }
    if (eta == ETA_SCHLICK) {
        float m = saturate(1.0 - cos_i);
        return sqr(sqr(m)) * m;
    }
    float real_f0 = f0_from_ior(eta);
    return saturate((fresnel_dielectric(cos_i, eta) - real_f0) / max(1.0 - real_f0, 1e-6));
}

vec3 fresnel(Lobe lobe, float cos_i) { return mix(lobe.f0, vec3(lobe.f90), fresnel_curve(cos_i, lobe.eta)); }

float ggx_d(float n_h, float alpha)
{
    float a2 = alpha * alpha;
    float d = n_h * n_h * (a2 - 1.0) + 1.0;
    return a2 / (PI * d * d);
}

// G2 / (4 n_v n_l), height-correlated Smith.
float ggx_visibility(float n_v, float n_l, float alpha)
{
    float a2 = alpha * alpha;
    float v = n_l * sqrt(a2 + n_v * n_v * (1.0 - a2));
    float l = n_v * sqrt(a2 + n_l * n_l * (1.0 - a2));
    return 0.5 / max(v + l, 1e-20);
}

float ggx_lambda(float cos_n, float alpha)
{
    float tan2 = max(1.0 / max(sqr(cos_n), 1e-20) - 1.0, 0.0);
    return 0.5 * (sqrt(1.0 + sqr(alpha) * tan2) - 1.0);
}

// G2/G1: what is left of the Fresnel term as the weight of a direction sampled by ggx_sample_visible_normal (E. Heitz, "Sampling
// the GGX Distribution of Visible Normals", JCGT 7(4), 2018).
float ggx_visible_weight(float cos_v, float cos_l, float alpha)
{
    float lambda_v = ggx_lambda(cos_v, alpha);
    return (1.0 + lambda_v) / (1.0 + lambda_v + ggx_lambda(cos_l, alpha));
}

// BRDF × cosθ_l for one direction of light, without the multiple-bounce gain.
vec3 ggx_eval(Lobe lobe, float alpha, vec3 n, vec3 v, vec3 l)
{
    float n_l = dot(n, l);
    float n_v = abs(dot(n, v));
    if (n_l <= 0.0 || n_v <= 0.0) {
        return vec3(0.0);
    }
    vec3 h = safe_normalize(v + l);
    return fresnel(lobe, saturate(dot(v, h))) *
           (ggx_d(saturate(dot(n, h)), alpha) * ggx_visibility(n_v, n_l, alpha) * n_l);
}

// Normals visible from v (in the frame of the normal). E. Heitz, "Sampling the GGX Distribution of Visible Normals",
// JCGT 7(4), 2018.
vec3 ggx_sample_visible_normal(vec3 v, float alpha, vec2 u)
{
    vec3 stretched = normalize(vec3(alpha * v.xy, v.z));
    float length2 = dot(stretched.xy, stretched.xy);
    vec3 t1 = length2 > 0.0 ? vec3(-stretched.y, stretched.x, 0.0) * inversesqrt(length2) : vec3(1.0, 0.0, 0.0);
    vec3 t2 = cross(stretched, t1);
    float r = sqrt(u.x);
    float phi = TAU * u.y;
    float p1 = r * cos(phi);
    float p2 = r * sin(phi);
    float s = 0.5 * (1.0 + stretched.z);
    p2 = mix(sqrt(max(0.0, 1.0 - p1 * p1)), p2, s);
    vec3 n = p1 * t1 + p2 * t2 + sqrt(max(0.0, 1.0 - p1 * p1 - p2 * p2)) * stretched;
    return normalize(vec3(alpha * n.xy, max(0.0, n.z)));
}

// --- tables (passes/brdf_tables_comp.glsl): what the lobe reflects in all ---------------------------------------------

// An index of refraction as a table coordinate in [0, 1): z⁴ = F0 spreads [1, ∞) with most of it near 1 … 2.
float ior_coordinate(float eta) { return sqrt(sqrt(f0_from_ior(eta))); }

vec2 table_uv(vec2 x, vec2 size) { return (saturate(vec3(x, 0.0)).xy * (size - 1.0) + 0.5) / size; }

// Fraction of the way from f0 to f90 of the lobe's directional albedo. Schlick's curve fills the table's upper half.
float albedo_curve(sampler3D albedo_table, float roughness, float cos_v, float eta)
{
    if (eta == ETA_CONSTANT) {
        return 0.0;
    }
    vec3 size = vec3(textureSize(albedo_table, 0));
    float slices = size.z - 1.0; // the last slice is Schlick's curve
    float slice = eta == ETA_SCHLICK ? slices : ior_coordinate(eta) * (slices - 1.0);
    vec3 uvw = vec3(table_uv(vec2(roughness, cos_v), size.xy), (slice + 0.5) / size.z);
    return textureLod(albedo_table, uvw, 0.0).r;
}

// The same averaged over the hemisphere of views, cosine-weighted.
float albedo_curve_average(sampler2D average_table, float roughness, float eta)
{
    if (eta == ETA_CONSTANT) {
        return 0.0;
    }
    vec2 size = vec2(textureSize(average_table, 0));
    float slices = size.y - 1.0;
    float slice = eta == ETA_SCHLICK ? slices : ior_coordinate(eta) * (slices - 1.0);
    return textureLod(average_table, vec2(table_uv(vec2(roughness, 0.0), size).x, (slice + 0.5) / size.y), 0.0).r;
}

// Energy of the lobe without Fresnel: E for this direction, and its average over all.
vec2 lobe_energy(sampler2D energy_table, float roughness, float cos_v)
{
    vec2 size = vec2(textureSize(energy_table, 0));
    return textureLod(energy_table, table_uv(vec2(roughness, cos_v), size), 0.0).rg;
}

// What bounces between microfacets bring back, relative to E: Fms = Fss Eavg / (1 − Fss (1 − Eavg)) (Kulla and Conty,
// appendix). Fss, the Fresnel curve's own average, is a smooth lobe's albedo average.
vec3 multiscatter_fresnel(sampler2D average_table, Lobe lobe, float e_average)
{
    vec3 fss = mix(lobe.f0, vec3(lobe.f90), albedo_curve_average(average_table, 0.0, lobe.eta));
    return fss * e_average / max(vec3(1.0) - fss * (1.0 - e_average), vec3(1e-4));
}

// Gain of the single-bounce BRDF for them: 1 + Fms (1 − E)/E.
vec3 multiscatter_gain(sampler2D energy_table, sampler2D average_table, Lobe lobe, float cos_v)
{
    if (lobe.multiscatter <= 0.0) {
        return vec3(1.0);
    }
    vec2 e = lobe_energy(energy_table, lobe.roughness, cos_v);
    vec3 fms = multiscatter_fresnel(average_table, lobe, e.y);
    return mix(vec3(1.0), vec3(1.0) + fms * ((1.0 - e.x) / max(e.x, 1e-4)), lobe.multiscatter);
}

// Share of the Fresnel albedo that is left of a lobe of energy `e`: E + Fms (1 − E). Without multiple scattering Cycles
// takes the albedo as if nothing were lost.
vec3 multiscatter_share(sampler2D average_table, Lobe lobe, vec2 e)
{
    vec3 fms = multiscatter_fresnel(average_table, lobe, e.y);
    return mix(vec3(1.0), vec3(e.x) + fms * (1.0 - e.x), lobe.multiscatter);
}

// Directional albedo of the lobe: Cycles' Glossy Color.
vec3 lobe_albedo(sampler3D albedo_table, sampler2D average_table, sampler2D energy_table, Lobe lobe, float cos_v)
{
    vec3 f = mix(lobe.f0, vec3(lobe.f90), albedo_curve(albedo_table, lobe.roughness, cos_v, lobe.eta));
    return f * multiscatter_share(average_table, lobe, lobe_energy(energy_table, lobe.roughness, cos_v));
}

// The same averaged over the hemisphere of views.
vec3 lobe_albedo_average(sampler2D average_table, sampler2D energy_table, Lobe lobe)
{
    vec3 f = mix(lobe.f0, vec3(lobe.f90), albedo_curve_average(average_table, lobe.roughness, lobe.eta));
    float e = lobe_energy(energy_table, lobe.roughness, 1.0).y;
    return f * multiscatter_share(average_table, lobe, vec2(e));
}
