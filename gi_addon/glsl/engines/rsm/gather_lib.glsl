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
};

// Every `stride`-th virtual light from `first` on, each standing for `stride` of them, its disc as many times as large. A
// light's own disc is its share among those of all sub-frames, which a pixel's mean over them has; where the sum is not
// averaged so, `alone` is their number, and the disc the sub-frame's.
//
// Rays are tested from `start_ws` on, the point clear of the cells of its own surface.
Gathered gather_some_vpls_from(vec3 start_ws, vec3 position_ws, vec3 n, vec3 ng, int first, int stride, float alone)
{
    Gathered g = Gathered(vec3(0.0), vec4(0.0));
    for (int i = first; i < vpl_count; i += stride) {
        Vpl vpl = vpls[i];
        vec3 d = vpl.position_ws - position_ws;
        float d2 = dot(d, d);
        float inverse = inversesqrt(max(d2, 1e-37));
        vec3 w = d * inverse;
        bool in_air = vpl.light == VPL_AIR;
        float cos_p = in_air ? 1.0 : -dot(w, vpl.normal_ws);
        float cos_g = dot(w, ng);
        if (cos_p <= 0.0 || cos_g <= 0.0) {
            continue;
        }
#if HAS_OCCUPANCY && MESH_LIGHTS
        if (vpl.light >= 0 && own_lamp_blocks(rsm_lights[vpl.light], vpl.position_ws, position_ws)) {
            continue;
        }
#endif
#if HAS_OCCUPANCY
        if (cells_block(start_ws, vpl.clear_ws)) {
            continue;
        }
#endif
        float cos_x = max(dot(w, n), 0.0);
        // Φ/A · K A/(1 + K A) without the area: Φ cos cos / (π d² + cos cos A).
        float product = cos_p * cos_x;
        float area = vpl.area * float(stride) * (vpl.light >= 0 || in_air ? alone : 1.0);
        float kernel = product / (PI * d2 + product * area);
        vec3 flux = vpl.flux;
#if HAS_MEDIUM
        if (in_air) {
            // E = Φ p(θ) cosθ_x / (d² + r²): the form above, with π p in place of the sender's cosine.
            flux *= PI * henyey_greenstein(-dot(w, vpl.normal_ws), vpl.anisotropy);
        }
        flux *= medium_transmittance(position_ws, w, sqrt(d2));
#endif
        g.radiance += flux * kernel;
        // Light per direction, by the same bound but for the receiver's own cosine.
        float arriving = luminance(flux) * cos_p / (PI * d2 + cos_p * area);
        g.direction += vec4(w, 1.0) * arriving;
    }
    g.radiance *= INV_PI * float(stride);
    g.direction *= float(stride);
    return g;
}

Gathered gather_some_vpls(vec3 position_ws, vec3 n, vec3 ng, int first, int stride, float alone)
{
    vec3 start_ws = position_ws;
#if HAS_OCCUPANCY
    start_ws = cells_clear(position_ws, ng);
#endif
    return gather_some_vpls_from(start_ws, position_ws, n, ng, first, stride, alone);
}

// All of them at a point that the eye sees, `to_eye` from it.
Gathered gather_vpls(vec3 position_ws, vec3 n, vec3 ng, vec3 to_eye)
{
    vec3 start_ws = position_ws;
#if HAS_OCCUPANCY
    start_ws = cells_clear_along(position_ws, ng, to_eye);
#endif
    return gather_some_vpls_from(start_ws, position_ws, n, ng, 0, 1, 1.0);
}
