// The closures of Blender's nodes. Layering follows Cycles: what a layer reflects (its directional albedo) is taken from
// the layers below it. SURFACE_TABLES says how that is found: 1 for this view, 2 as the mean over views (a bounce goes to
// all sides), 0 without tables, as if smooth (shadow maps, which only ask what passes).

#include "lib/surface_lib.glsl"
#include "nodes/color.glsl"

// Albedo of a glossy layer towards the viewer, or to all sides.
vec3 surface_layer_albedo(SurfacePoint point, vec3 n, vec3 f0, float f90, float roughness, float eta, float multiscatter)
{
    Lobe lobe = Lobe(f0, f90, roughness, eta, multiscatter);
    float cos_v = saturate(abs(dot(n, point.view_ws)));
#if SURFACE_TABLES == 2
    return lobe_albedo_average(brdf_average, brdf_energy, lobe);
#elif SURFACE_TABLES == 1
    return lobe_albedo(brdf_albedo, brdf_average, brdf_energy, lobe, cos_v);
#else
    return fresnel(lobe, cos_v);
#endif
}

// "Specular IOR Level" scales F0; ½ leaves the index alone.
float principled_ior(float ior, float level)
{
    ior = max(ior, 1e-5);
    return level != 0.5 ? ior_from_f0(f0_from_ior(ior) * 2.0 * max(level, 0.0)) : ior < 1.0 ? 1.0 / ior : ior;
}

Closure principled_closure(vec3 base, float metallic, float roughness, float ior, float level, vec3 tint, vec3 n,
                           float multiscatter, SurfacePoint point)
{
    metallic = saturate(metallic);
    roughness = saturate(roughness);
    ior = max(ior, 1e-5);
    level = max(level, 0.0);
    vec3 metal_f0 = saturate(base);

    float f0 = f0_from_ior(ior) * 2.0 * level;
    float eta = principled_ior(ior, level); // seen from outside a thinner medium: same F0, no total reflection in the table
    vec3 layer_f0 = saturate(f0 * max(tint, vec3(0.0)));
    bool has_layer = eta > 1.0;
    vec3 layer_albedo =
        has_layer ? surface_layer_albedo(point, n, layer_f0, 1.0, roughness, eta, multiscatter) : vec3(0.0);

    Closure c = closure_none();
    c.diffuse = max(base, vec3(0.0)) * ((1.0 - metallic) * saturate(1.0 - max3(layer_albedo)));
    float dielectric = has_layer ? 1.0 - metallic : 0.0;
    c.f0 = metal_f0 * metallic + layer_f0 * dielectric;
    c.gloss = metallic + dielectric;
    c.f90 = vec3(c.gloss);
    c.roughness = roughness * c.gloss;
    c.eta = (metallic > dielectric ? ETA_SCHLICK : eta) * c.gloss;
    c.multiscatter = multiscatter * c.gloss;
    c.normal_ws = n;
    return c;
}

// Glass of the principled BSDF: Fresnel splits between the glossy lobe and what is refracted, tinted √base per surface.
void principled_transmission(inout Closure c, vec3 base, float metallic, float roughness, float ior, vec3 tint,
                             float weight, vec3 n, float multiscatter, SurfacePoint point)
{
    weight = saturate(weight) * (1.0 - saturate(metallic));
    ior = max(ior, 1e-5);
    float eta = ior < 1.0 ? 1.0 / ior : ior;
    vec3 f0 = saturate(f0_from_ior(ior) * max(tint, vec3(0.0)));
    vec3 reflected =
        eta > 1.0 ? surface_layer_albedo(point, n, f0, 1.0, saturate(roughness), eta, multiscatter) : vec3(0.0);
    // The opaque dielectric gives way; its specular layer already is the reflection.
    float share = 1.0 - saturate(metallic) > 0.0 ? weight / (1.0 - saturate(metallic)) : 0.0;
    c.diffuse *= 1.0 - share;
    c.transmission += sqrt(saturate(base)) * (vec3(1.0) - reflected) * weight;
    float amount = luminance(c.transmission);
    c.transmission_roughness = saturate(roughness) * amount;
    c.transmission_eta = ior * amount;
}

// Light goes in as through a rough surface of this index of refraction, and comes out diffuse, as in Cycles. What layers above
// take is not the medium's: its own albedo is the base's.
void principled_subsurface(inout Closure c, vec3 base, float weight, vec3 radius, float roughness, float ior)
{
    c.subsurface = c.diffuse * saturate(weight);
    c.subsurface_radius = max(radius, vec3(0.0)) * luminance(c.subsurface);
    c.subsurface_entry = vec3(saturate(roughness), max(ior, 1.0), luminance(max(base, vec3(0.0)))) * luminance(c.subsurface);
}

// A clear layer on top: it takes its albedo from all below and adds a lobe of its own, merged into the glossy one.
void principled_coat(inout Closure c, float weight, float roughness, float ior, vec3 tint, SurfacePoint point)
{
    weight = saturate(weight);
    float eta = max(ior, 1.0);
    float f0 = f0_from_ior(eta);
    vec3 n = point.normal_ws;
    // Cycles' coat is without multiple scattering.
    float albedo =
        eta > 1.0 ? weight * surface_layer_albedo(point, n, vec3(f0), 1.0, saturate(roughness), eta, 0.0).r : 0.0;
    // The tint is what passes the coat at normal incidence; the way through lengthens with the refracted angle.
    float cos_i = saturate(abs(dot(point.view_ws, n)));
    float cos_t = sqrt(1.0 - (1.0 - cos_i * cos_i) / (eta * eta));
    vec3 passed = mix(vec3(1.0), pow(max(tint, vec3(1e-6)), vec3(1.0 / cos_t)), weight) * (1.0 - albedo);
    vec3 normal_ws = c.normal_ws;
    c.diffuse *= passed;
    c.subsurface *= passed;
    c.subsurface_radius *= luminance(passed);
    c.subsurface_entry *= luminance(passed);
    c.f0 *= passed;
    c.f90 *= passed;
    c.emission *= passed;
    c.transmission *= passed;
    float keep = c.gloss * luminance(passed);
    c.roughness *= luminance(passed);
    c.eta *= luminance(passed);
    c.multiscatter *= luminance(passed);
    c.f0 += vec3(f0 * weight);
    c.f90 += vec3(weight);
    c.gloss = keep + weight;
    c.roughness += saturate(roughness) * weight;
    c.eta += eta * weight;
    c.normal_ws = normal_ws;
}

// Albedo of sheen towards the viewer, from its table; seen by a light map, that towards the light.
float sheen_albedo(int first, vec3 n, SurfacePoint point)
{
    return node_table(first, 9, saturate(abs(dot(n, point.view_ws))), TABLE_LINEAR).x;
}

// Fibres on top: what they reflect is taken from all below, and leaves in all directions.
void principled_sheen(inout Closure c, float weight, vec3 tint, int first, vec3 n, SurfacePoint point)
{
    vec3 normal_ws = c.normal_ws;
    vec3 albedo = max(tint, vec3(0.0)) * (weight * sheen_albedo(first, n, point));
    vec3 emission = c.emission;
    c = closure_scale(c, saturate(1.0 - max3(albedo)));
    c.emission = emission;
    c.diffuse += albedo;
    c.normal_ws = normal_ws;
}

// Reflectance at normal incidence of index n and extinction k.
vec3 conductor_f0(vec3 n, vec3 k)
{
    return ((n - 1.0) * (n - 1.0) + k * k) / ((n + 1.0) * (n + 1.0) + k * k);
}

Closure closure_glass(vec3 color, float roughness, float ior, vec3 n, SurfacePoint point)
{
    float eta = max(ior, 1e-5);
    eta = eta < 1.0 ? 1.0 / eta : eta;
    float f0 = f0_from_ior(eta);
    float albedo = surface_layer_albedo(point, n, vec3(f0), 1.0, saturate(roughness), eta, 0.0).r;
    Closure c = closure_refraction(max(color, vec3(0.0)) * (1.0 - albedo), roughness, ior, n);
    c.f0 = max(color, vec3(0.0)) * f0;
    c.f90 = max(color, vec3(0.0));
    c.gloss = 1.0;
    c.roughness = saturate(roughness);
    c.eta = eta;
    c.normal_ws = n;
    return c;
}

float node_fresnel(float ior, vec3 n, SurfacePoint point)
{
    float eta = max(ior, 1e-5);
    return fresnel_dielectric(dot(point.view_ws, n), point.backfacing > 0.5 ? 1.0 / eta : eta);
}

// (Fresnel, Facing) of Blender's Layer Weight.
vec3 node_layer_weight(float blend, vec3 n, SurfacePoint point)
{
    float eta = max(1.0 - blend, 1e-5);
    float cos_i = dot(point.view_ws, n);
    float f = fresnel_dielectric(cos_i, point.backfacing > 0.5 ? eta : 1.0 / eta);
    float facing = abs(cos_i);
    if (blend != 0.5) {
        blend = clamp(blend, 0.0, 0.99999);
        blend = blend < 0.5 ? 2.0 * blend : 0.5 / (1.0 - blend);
        facing = pow(facing, blend);
    }
    return vec3(f, 1.0 - facing, 0.0);
}
