// What a material is at a point: a sum of lobes with weights, linear so that shaders mix and add.
// Weights are albedos; `gloss`-weighted means carry the glossy lobe's other numbers.

#include "lib/bsdf_lib.glsl"

struct Closure {
    vec3 diffuse;
    vec3 f0;                     // reflectance at normal incidence × weight
    vec3 f90;                    // at grazing incidence × weight
    float gloss;                 // weight of the glossy lobe
    float roughness;             // × gloss
    float eta;                   // × gloss, see Lobe
    float multiscatter;          // × gloss
    vec3 emission;               // radiance, W/(m²·sr)
    vec3 transparent;            // straight through
    vec3 transmission;           // refracted
    float transmission_roughness; // × luminance of transmission
    float transmission_eta;       // × luminance of transmission
    vec3 translucent;            // diffuse to the far side
    vec3 subsurface;             // part of `diffuse` that scatters below the surface
    vec3 subsurface_radius;      // × luminance of subsurface, m
    vec3 subsurface_entry;       // × luminance of subsurface: roughness and index of the way in; luminance of its albedo
    vec3 normal_ws;              // × weight
    float holdout;               // share that is cut out of the picture
};

Closure closure_none()
{
    return Closure(vec3(0.0), vec3(0.0), vec3(0.0), 0.0, 0.0, 0.0, 0.0, vec3(0.0), vec3(0.0), vec3(0.0), 0.0, 0.0,
                   vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), 0.0);
}

Closure closure_scale(Closure a, float k)
{
    return Closure(a.diffuse * k, a.f0 * k, a.f90 * k, a.gloss * k, a.roughness * k, a.eta * k, a.multiscatter * k,
                   a.emission * k, a.transparent * k, a.transmission * k, a.transmission_roughness * k,
                   a.transmission_eta * k, a.translucent * k, a.subsurface * k, a.subsurface_radius * k,
                   a.subsurface_entry * k, a.normal_ws * k, a.holdout * k);
}

Closure closure_add(Closure a, Closure b)
{
    return Closure(a.diffuse + b.diffuse, a.f0 + b.f0, a.f90 + b.f90, a.gloss + b.gloss, a.roughness + b.roughness,
                   a.eta + b.eta, a.multiscatter + b.multiscatter, a.emission + b.emission,
                   a.transparent + b.transparent, a.transmission + b.transmission,
                   a.transmission_roughness + b.transmission_roughness, a.transmission_eta + b.transmission_eta,
                   a.translucent + b.translucent, a.subsurface + b.subsurface,
                   a.subsurface_radius + b.subsurface_radius, a.subsurface_entry + b.subsurface_entry,
                   a.normal_ws + b.normal_ws, a.holdout + b.holdout);
}

Closure closure_mix(Closure a, Closure b, float t)
{
    t = saturate(t);
    return closure_add(closure_scale(a, 1.0 - t), closure_scale(b, t));
}

Closure closure_diffuse(vec3 color, vec3 n)
{
    Closure c = closure_none();
    c.diffuse = max(color, vec3(0.0));
    c.normal_ws = n * max(max3(c.diffuse), 1e-6);
    return c;
}

Closure closure_glossy(vec3 color, float roughness, float eta, float multiscatter, vec3 n)
{
    Closure c = closure_none();
    c.f0 = max(color, vec3(0.0));
    c.f90 = eta == ETA_CONSTANT ? c.f0 : vec3(1.0);
    c.gloss = 1.0;
    c.roughness = saturate(roughness);
    c.eta = eta;
    c.multiscatter = multiscatter;
    c.normal_ws = n;
    return c;
}

Closure closure_emission(vec3 radiance)
{
    Closure c = closure_none();
    c.emission = radiance;
    return c;
}

Closure closure_transparent(vec3 color)
{
    Closure c = closure_none();
    c.transparent = max(color, vec3(0.0));
    return c;
}

Closure closure_holdout()
{
    Closure c = closure_none();
    c.holdout = 1.0;
    return c;
}

Closure closure_translucent(vec3 color, vec3 n)
{
    Closure c = closure_none();
    c.translucent = max(color, vec3(0.0));
    c.normal_ws = n * max(max3(c.translucent), 1e-6);
    return c;
}

Closure closure_refraction(vec3 color, float roughness, float ior, vec3 n)
{
    Closure c = closure_none();
    c.transmission = max(color, vec3(0.0));
    float weight = luminance(c.transmission);
    c.transmission_roughness = saturate(roughness) * weight;
    c.transmission_eta = ior * weight;
    c.normal_ws = n * max(weight, 1e-6);
    return c;
}

Closure closure_alpha(Closure c, float alpha)
{
    alpha = saturate(alpha);
    return closure_add(closure_scale(c, alpha), closure_transparent(vec3(1.0 - alpha)));
}

// The glossy lobe of the sum.
Lobe closure_lobe(Closure c)
{
    float inverse = c.gloss > 0.0 ? 1.0 / c.gloss : 0.0;
    float eta = c.eta * inverse;
    // Curves of different kinds can't be averaged: between a dielectric's and Schlick's the heavier one wins.
    if (eta > ETA_CONSTANT && eta < 0.0) {
        eta = eta < -0.5 ? ETA_CONSTANT : ETA_SCHLICK;
    } else if (eta > 0.0 && eta < 1.0 && inverse > 0.0) {
        eta = eta > 0.5 ? max(eta, 1.0) : ETA_SCHLICK;
    }
    return Lobe(c.f0, vector_mean(c.f90), c.roughness * inverse, eta, c.multiscatter * inverse);
}
