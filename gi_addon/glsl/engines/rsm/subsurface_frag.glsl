// Light that entered elsewhere and leaves here: C. Dachsbacher and M. Stamminger, "Translucent Shadow Maps", EGSR 2003, on
// the RSM's own depth. The radiant exitance is ∫ E(y) R(|x − y|) dA(y), with P. Christensen and B. Burley's "Approximate
// Reflectance Profiles for Efficient Subsurface Scattering", Pixar 15-04, eq. 3:
//   R(r)/A = (e^(−r/d) + e^(−r/3d)) / (8π d r), whose integral over a plane is 1,  d = ℓ / s,
//   s = 1.9 − A + 3.5 (A − 0.8)², for light that enters a surface diffusely and the mean free path ℓ, which Cycles'
// random walk takes from the radius as it is.
// E dA is the flux that comes through a light's beam, so the integral is one over the plane across the beam at x: points
// there are drawn by the profile itself (a fourth of them with length d, the rest with 3d), and each stands for the point
// y where its light first meets a surface. A thin part lit from behind has such points on its far side.

#include "lib/view_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "engines/rsm/rsm_lib.glsl"

const int SUBSURFACE_TAPS = 8;

vec3 profile(float r, vec3 d)
{
    r = max(r, 1e-4 * min3(d));
    return (exp(-r / d) + exp(-r / (3.0 * d))) / (25.1327412 * d * r); // 8π
}

// Where the light on its way to `q` first meets a surface; false where the map does not know.
bool entry_point(Light light, vec3 q, out vec3 y)
{
    LightView v = rsm_views[rsm_view_of(light, q)];
    vec3 p = light_view_project(v, q);
    y = q;
    if (p.z <= v.near || any(greaterThan(abs(p.xy), vec2(1.0)))) {
        return false;
    }
    ivec2 texel = ivec2(v.rect.xy + (p.xy / v.guard * 0.5 + 0.5) * v.rect.zw);
    float depth = texelFetch(rsm_depth, texel, 0).r;
    if (depth <= 0.0) {
        return false;
    }
    y = light_view_position(v, p.xy, depth);
    // On the texel's plane rather than at its centre's depth: its slope may be longer than a mean free path.
    vec3 n = octahedral_decode(texelFetch(rsm_normal, texel, 0).zw);
    vec2 xy = ((vec2(texel) + 0.5 - v.rect.xy) / v.rect.zw * 2.0 - 1.0) * v.guard;
    vec3 along = v.perspective > 0.5 ? v.axis_x * p.x + v.axis_y * p.y + v.axis_z : v.axis_z;
    float facing = dot(n, along);
    if (abs(facing) > 0.1 * length(along)) {
        y += along * (dot(n, light_view_position(v, xy, depth) - y) / facing);
    }
    return true;
}

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 uv = gl_FragCoord.xy * view.inverse_resolution;
    float depth = texelFetch(gbuf_depth, pixel, 0).r;
    vec4 medium = texelFetch(gbuf_subsurface, pixel, 0);
    direct_subsurface = vec4(0.0);
    if (depth <= 0.0 || medium.a <= 0.0 || max3(medium.rgb) <= 0.0) {
        return;
    }
    vec3 position_ws = position_ws_from_depth(uv, depth);
    vec3 albedo = saturate(texelFetch(gbuf_diffuse, pixel, 0).rgb);
    vec3 s = 1.9 - albedo + 3.5 * (albedo - 0.8) * (albedo - 0.8);
    // A channel that does not scatter is as sharp as the map.
    vec3 d = max(medium.rgb / s, vec3(1e-3 * max3(medium.rgb)));
    uint seed = hash_u32(uvec2(pixel + view.pixel_offset));
    vec2 turn = unit_shift(seed);
    vec3 exitance = vec3(0.0);
    for (int i = 0; i < rsm_light_count; ++i) {
        Light light = rsm_lights[i];
        vec3 l;
        float angle;
        vec3 here = light_arriving(light, position_ws, l, angle);
        if (light.views <= 0 || max3(here) <= 0.0) {
            continue;
        }
        mat3 across = frame_from_normal(l);
        for (int k = 0; k < SUBSURFACE_TAPS; ++k) {
            vec2 u = fract(sobol_2d(view.subframe * uint(SUBSURFACE_TAPS) + uint(k), 42u) + turn);
            // One number chooses the channel, then the exponential, then the length.
            float channel = u.x * 3.0;
            float pick = fract(channel);
            bool narrow = pick < 0.25;
            float rest = narrow ? pick * 4.0 : (pick - 0.25) / 0.75;
            float length_ = channel < 1.0 ? d.x : channel < 2.0 ? d.y : d.z;
            float radius = -log(max(1.0 - rest, 1e-6)) * length_ * (narrow ? 1.0 : 3.0);
            float phi = TAU * u.y;
            vec3 q = position_ws + across * vec3(radius * cos(phi), radius * sin(phi), 0.0);
            vec3 y;
            vec3 towards;
            vec3 beam = light_arriving(light, q, towards, angle) * saturate(dot(towards, l));
            if (entry_point(light, q, y)) {
#if HAS_MEDIUM
                beam *= medium_transmittance(y, towards, light_distance(light, y));
#endif
                exitance += beam * profile(distance(y, position_ws), d) / dot(profile(radius, d), vec3(1.0 / 3.0));
            }
        }
    }
    direct_subsurface = vec4(exitance * (INV_PI / float(SUBSURFACE_TAPS)), medium.a);
}
