// Irradiance from virtual point lights. Included where `vpls` is declared.
//
// A Lambertian patch of flux Φ gives E = Φ/π · cosθ_p cosθ_x / d² (design.md §4; Dachsbacher and Stamminger 2005, eq. 1,
// with the 1/π they leave to the scale). Taken as a disc of its own area A, with K = cosθ_p cosθ_x / (π d²) its form
// factor is not K A but K A / (1 + K A): exact for a disc facing a point on its axis, A/(π d² + A), never above 1, and
// with both cosines in it, so that patches seen edge-on — a sphere's inside, a corner — lose no light to the bound.

#include "lib/math_lib.glsl"
#if HAS_MEDIUM
#include "lib/medium_lib.glsl"
#endif
#if HAS_OCCUPANCY
#include "lib/occupancy_lib.glsl"
#endif
#if HAS_OCCUPANCY && MESH_LIGHTS
#include "generated/light.glsl"

// Whether the triangle that lit a virtual light from one side hides it on the other: lamps hang closer to ceilings than any
// cell is small. T. Möller and B. Trumbore, JGT 2(1), 1997.
bool own_lamp_blocks(Light light, vec3 from_ws, vec3 to_ws)
{
    if (light.kind != LIGHT_MESH) {
        return false;
    }
    vec3 d = to_ws - from_ws;
    vec3 p = cross(d, light.v_ws);
    float determinant = dot(light.u_ws, p);
    vec3 s = from_ws - light.center_ws;
    vec3 q = cross(s, light.u_ws);
    vec3 hit = vec3(dot(s, p), dot(d, q), dot(light.v_ws, q)) / (abs(determinant) > 0.0 ? determinant : 1e30);
    return hit.x >= 0.0 && hit.y >= 0.0 && hit.x + hit.y <= 1.0 && hit.z > 1e-4 && hit.z < 1.0 - 1e-4;
}
#endif

struct Gathered {
    vec3 radiance;    // E/π: what a white Lambert surface reflects, W/(m²·sr)
    vec4 direction;   // Σ luminance × direction to the source; Σ luminance
#ifdef GATHER_SLOPE
    vec4 slope;       // Σ ∇L, where L is the luminance of the radiance as if nothing stood between; Σ L
#endif
};

Gathered gathered_nothing()
{
    Gathered g;
    g.radiance = vec3(0.0);
    g.direction = vec4(0.0);
#ifdef GATHER_SLOPE
    g.slope = vec4(0.0);
#endif
    return g;
}

// What a virtual light sends to a surface that nothing stands before.
struct VplLight {
    vec3 radiance;    // E/π
    vec3 direction;   // towards it
    float arriving;   // luminance of E/π on a surface that faces it
#ifdef GATHER_SLOPE
    vec3 slope;       // gradient of the radiance's luminance over the receiver's position, 1/m of it
#endif
};

// Its disc `widen` times as large as its own.
VplLight vpl_light(Vpl vpl, vec3 position_ws, vec3 n, vec3 ng, float widen)
{
    vec3 d = vpl.position_ws - position_ws;
    float d2 = dot(d, d);
    float inverse = inversesqrt(max(d2, 1e-37));
    vec3 w = d * inverse;
    bool in_air = vpl.light == VPL_AIR;
    float cos_p = in_air ? 1.0 : max(-dot(w, vpl.normal_ws), 0.0);
    float cos_x = dot(w, ng) > 0.0 ? max(dot(w, n), 0.0) : 0.0;
    cos_p = dot(w, ng) > 0.0 ? cos_p : 0.0;
    float area = vpl.area * widen;
    vec3 flux = vpl.flux * INV_PI;
#if HAS_MEDIUM
    if (in_air) {
        // E = Φ p(θ) cosθ_x / (d² + r²): the form above, with π p in place of the sender's cosine.
        flux *= PI * henyey_greenstein(-dot(w, vpl.normal_ws), vpl.anisotropy);
    }
    flux *= medium_transmittance(position_ws, w, sqrt(d2));
#endif
    // Φ/A · K A/(1 + K A) without the area: Φ cos cos / (π d² + cos cos A); for a direction by the same bound but for the
    // receiver's own cosine.
    float product = cos_p * cos_x;
    float spread = max(PI * d2 + product * area, 1e-37);
    VplLight light;
    light.radiance = flux * (product / spread);
    light.direction = w;
    light.arriving = luminance(flux) * cos_p / max(PI * d2 + cos_p * area, 1e-37);
#ifdef GATHER_SLOPE
    // With D from the receiver to the light, f = q/(π Dᵏ + q A), where q = (−D·n_p)(D·n), k = 4, and in air D·n, 3. Since
    // ∇D = −1: ∇f = f π Dᵏ/(π Dᵏ + q A) (∇q/q + k D/D²), here in cosines.
    vec3 turning = in_air ? 3.0 * product * w - n : 4.0 * product * w - cos_p * n + cos_x * vpl.normal_ws;
    light.slope = product > 0.0 ? turning * (luminance(flux) * (PI * d2 / spread) * inverse / spread) : vec3(0.0);
#endif
    return light;
}

// Whether anything stands between a virtual light and a point, `start_ws` the point clear of the cells of its own surface.
bool vpl_hidden(Vpl vpl, vec3 start_ws, vec3 position_ws)
{
    bool hidden = false;
#if HAS_OCCUPANCY && MESH_LIGHTS
    hidden = vpl.light >= 0 && own_lamp_blocks(rsm_lights[vpl.light], vpl.position_ws, position_ws);
#endif
#if HAS_OCCUPANCY
    hidden = hidden || cells_block(start_ws, vpl.clear_ws);
#endif
    return hidden;
}

// Every `stride`-th virtual light from `first` on, each standing for `stride` of them, its disc as many times as large. A
// light's own disc is its share among those of all sub-frames, which a pixel's mean over them has; where the sum is not
// averaged so, `alone` is their number, and the disc the sub-frame's.
Gathered gather_some_vpls(vec3 position_ws, vec3 n, vec3 ng, int first, int stride, float alone)
{
    Gathered g = gathered_nothing();
    vec3 start_ws = position_ws;
#if HAS_OCCUPANCY
    start_ws = cells_clear(position_ws, ng);
#endif
    for (int i = first; i < vpl_count; i += stride) {
        Vpl vpl = vpls[i];
        VplLight light = vpl_light(vpl, position_ws, n, ng, float(stride) * (vpl.light == -1 ? 1.0 : alone));
        if (light.arriving > 0.0 && !vpl_hidden(vpl, start_ws, position_ws)) {
            g.radiance += light.radiance;
            g.direction += vec4(light.direction, 1.0) * light.arriving;
        }
    }
    g.radiance *= float(stride);
    g.direction *= float(stride);
    return g;
}
