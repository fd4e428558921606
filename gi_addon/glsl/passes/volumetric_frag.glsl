// Single scattering: L = ∫ T(eye, t) σs p(θ) Σ E(light, t) V T(light, t) dt along the pixel's ray.
//
// Every light has its own points on the ray. For one with a place, equiangular ones, pdf ∝ 1/d² (C. Kulla and M. Fajardo,
// "Importance Sampling Techniques for Path Tracing in Participating Media", EGSR 2012): its own singularity cancels, so a
// lamp in the fog neither sparkles nor needs a bound. A spot's are within its cone. For parallel light, ∝ T(eye, t).

#include "lib/view_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "lib/medium_lib.glsl"
#if HAS_LIGHTS && HAS_VOLUME_LIGHT
#include "lib/light_lib.glsl"
#include "lib/math_lib.glsl"
#if HAS_LIGHT_VIEWS
#include "lib/shadow_lib.glsl"
#endif

#if RADIAL_BLUR
#include "engines/ssdo/radial_lib.glsl"
#endif

#if VOXEL_VISIBILITY
#include "engines/vct/air_lib.glsl"
#endif

// Whether light gets to a point of the air.
float air_visibility(Light light, vec3 position_ws)
{
#if VOXEL_VISIBILITY
    return voxel_visibility(light, position_ws);
#elif HAS_LIGHT_VIEWS
    return air_share(light, position_ws);
#else
    return 1.0;
#endif
}

// The part of [span.x, span.y] that a spot's or an area light's side can reach.
vec2 lit_span(Light light, vec3 origin_ws, vec3 direction, vec2 span)
{
    if (light.kind != LIGHT_SPOT && light.kind != LIGHT_AREA) {
        return span;
    }
    vec3 o = origin_ws - light.position_ws;
    // In front: o·a + t d·a > 0.
    float oa = dot(o, light.axis_ws);
    float da = dot(direction, light.axis_ws);
    float cross_ = -oa / (abs(da) > 1e-12 ? da : 1e-12);
    bool wide = light.kind == LIGHT_AREA ? light.spread_tan < 0.0 : light.spot_cos <= 0.0;
    if (light.kind == LIGHT_AREA || !wide) {
        span = da > 0.0 ? vec2(max(span.x, cross_), span.y) : vec2(span.x, min(span.y, cross_));
    }
    if (wide) {
        return span;
    }
    // The cone z² ≥ c² (x² + y² + z²) in the light's own frame; c from the spread for an area light's patch.
    mat3 frame = light.kind == LIGHT_AREA ? frame_from_normal(light.axis_ws) : mat3(light.u_ws, light.v_ws, light.axis_ws);
    float c2 = light.kind == LIGHT_AREA ? 1.0 / (1.0 + sqr(light.spread_tan)) : sqr(light.spot_cos);
    vec3 p = o * frame;
    vec3 q = direction * frame;
    float a = q.z * q.z - c2 * dot(q, q);
    float b = p.z * q.z - c2 * dot(p, q);
    float c = p.z * p.z - c2 * dot(p, p);
    float root2 = b * b - a * c;
    if (root2 <= 0.0) {
        return a > 0.0 ? span : vec2(0.0, -1.0); // inside all along, or never
    }
    float root = sqrt(root2);
    float k = -(b + (b >= 0.0 ? root : -root));
    vec2 t = vec2(k / (abs(a) > 1e-20 ? a : 1e-20), c / (abs(k) > 1e-20 ? k : 1e-20));
    t = vec2(min(t.x, t.y), max(t.x, t.y));
    // a < 0: inside between the roots. a > 0: beyond one of them; the other belongs to the cone's mirror image, which the
    // half space in front has cut off.
    if (a < 0.0) {
        return vec2(max(span.x, t.x), min(span.y, t.y));
    }
    return da > 0.0 ? vec2(max(span.x, t.y), span.y) : vec2(span.x, min(span.y, t.x));
}

// Scattered by medium k, which the ray crosses in `span`.
vec3 scattered(Light light, int k, vec3 origin_ws, vec3 direction, vec2 span, float offset)
{
    span = lit_span(light, origin_ws, direction, span);
    if (span.y <= span.x) {
        return vec3(0.0);
    }
    bool parallel = light_is_directional(light);
    // Equiangular: t = δ + D tan φ, pdf = D / ((φb − φa)(D² + (t − δ)²)), δ the ray's nearest point to the light.
    vec3 to_light = light.position_ws - origin_ws;
    float delta = dot(to_light, direction);
    float nearest = max(length(to_light - direction * delta), 1e-6 * view.scene_radius);
    float phi_a = atan((span.x - delta) / nearest);
    float phi_b = span.y >= 1e29 ? 0.5 * PI : atan((span.y - delta) / nearest);
    float sigma = max(vector_mean(medium_extinction[k].rgb), 1e-12);
    float passed = 1.0 - exp(-sigma * (span.y - span.x));
    vec3 sum = vec3(0.0);
    for (int i = 0; i < step_count; ++i) {
        float u = (float(i) + offset) / float(step_count);
        float t, weight;
        if (parallel) {
            float rest = max(1.0 - u * passed, 1e-7);
            t = span.x - log(rest) / sigma;
            weight = passed / (sigma * rest);
        } else {
            float tangent = tan(mix(phi_a, phi_b, u));
            t = delta + nearest * tangent;
            weight = (phi_b - phi_a) * nearest * (1.0 + tangent * tangent);
        }
        vec3 p = origin_ws + direction * t;
        vec3 l;
        float angle;
        vec3 arriving = light_arriving(light, p, l, angle);
        if (max3(arriving) > 0.0) {
            vec3 left = medium_transmittance(p, l, light_distance(light, p)) * medium_transmittance(origin_ws, direction, t);
            sum += arriving * left * (weight * air_visibility(light, p) *
                                      henyey_greenstein(dot(l, direction), medium_scattering[k].w));
        }
    }
    return sum * medium_scattering[k].rgb / float(step_count);
}
#endif

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 uv = gl_FragCoord.xy * view.inverse_resolution;
    float depth = 0.0;
#if HAS_GBUF_DEPTH
    depth = texelFetch(gbuf_depth, pixel, 0).r;
#endif
    EyeRay ray = eye_ray(uv, depth);
    vec3 direction = ray.direction;
    vec3 origin_ws = ray.origin_ws;
    float end = ray.end;
    vec3 passes = medium_transmittance(origin_ws, direction, end);
#if HAS_VOLUME_TRANSMITTANCE
    volume_transmittance = vec4(passes, 1.0);
#endif
#if HAS_VOLUME_LIGHT
    vec3 light_sum = vec3(0.0);
#if HAS_LIGHTS
    float offset = fract(step_turn + unit_float(hash_u32(uvec2(pixel + view.pixel_offset))));
#endif
    for (int k = 0; k < MEDIA; ++k) {
        vec2 span = medium_span(k, origin_ws, direction);
        span = vec2(max(span.x, 0.0), min(span.y, end));
        float length_ = max(span.y - span.x, 0.0);
        if (any(greaterThan(medium_emission[k], vec3(0.0)))) {
            // Emission: ∫ ε T dt = ε (1 − T)/σ.
            vec3 sigma = medium_extinction[k].rgb;
            vec3 emitted = mix((1.0 - exp(-sigma * length_)) / max(sigma, vec3(1e-12)), vec3(length_),
                               lessThan(sigma * length_, vec3(1e-4)));
            light_sum += medium_emission[k] * emitted * medium_transmittance(origin_ws, direction, span.x);
        }
#if HAS_LIGHTS
        if (length_ > 0.0 && max3(medium_scattering[k].rgb) > 0.0) {
            for (int i = 0; i < light_count; ++i) {
#if RADIAL_BLUR
                float share = radial_visibility(lights[i], offset);
                light_sum += share > 0.0 ? share * scattered(lights[i], k, origin_ws, direction, span, offset) : vec3(0.0);
#else
                light_sum += scattered(lights[i], k, origin_ws, direction, span, offset);
#endif
            }
        }
#endif
    }
    volume_light = vec4(light_sum, dot(passes, vec3(1.0 / 3.0)));
#endif
}
