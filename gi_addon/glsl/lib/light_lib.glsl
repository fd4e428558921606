// Lights and their maps. One Light is one point of a light source (gi_addon/lights.py); Cycles' units and conventions.

#include "lib/math_lib.glsl"
#include "generated/light.glsl"

// Radiant intensity towards `direction_ws` (a unit vector leaving the light), W/sr.
vec3 light_intensity(Light light, vec3 direction_ws)
{
    if (light.kind == LIGHT_POINT) {
        return light.emission;
    }
    if (light.kind == LIGHT_SPOT) {
        // Blender's cone: the cosine to the axis in the spot's own, scaled, frame, smoothed over the blend.
        vec3 local = vec3(dot(direction_ws, light.u_ws), dot(direction_ws, light.v_ws), dot(direction_ws, light.axis_ws));
        float cos_angle = local.z * inversesqrt(max(dot(local, local), 1e-30));
        float t = saturate((cos_angle - light.spot_cos) * light.spot_scale);
        return light.emission * (t * t * (3.0 - 2.0 * t));
    }
    float cos_l = dot(direction_ws, light.axis_ws);
    if (light.kind == LIGHT_MESH) {
        return light.emission * abs(cos_l); // both sides of a surface emit
    }
    if (cos_l <= 0.0) {
        return vec3(0.0);
    }
    // Area: constant radiance, or the profile of its spread, max(tan(spread/2) − tanθ, 0) × scale.
    float profile = 1.0;
    if (light.spread_tan >= 0.0) {
        profile = max(light.spread_tan - sqrt(max(0.0, 1.0 - cos_l * cos_l)) / cos_l, 0.0) * light.spread_scale;
    }
    return light.emission * (cos_l * profile);
}

// What a falloff of other than the distance's square makes of the irradiance at distance² `d2` (m²).
float light_falloff(Light light, float d2)
{
    return pow(max(d2, 1e-30), 0.5 * light.falloff) * d2 / max(d2 + light.falloff_smooth, 1e-30);
}

bool light_is_directional(Light light) { return light.kind == LIGHT_SUN || light.kind == LIGHT_WORLD; }

// How far light has come to a point: 1e30 m from infinitely far away.
float light_distance(Light light, vec3 position_ws)
{
    return light_is_directional(light) ? 1e30 : length(light.position_ws - position_ws);
}

// Light arriving at a point: unit vector towards it in `l`; returns irradiance on a surface facing it, W/m². `angle` is
// the angular radius of the patch of the source that this point stands for.
vec3 light_arriving(Light light, vec3 position_ws, out vec3 l, out float angle)
{
    if (light_is_directional(light)) {
        l = -light.axis_ws;
        angle = light.patch_radius;
        return light.emission;
    }
    vec3 to_light = light.position_ws - position_ws;
    float distance2 = dot(to_light, to_light);
    if (distance2 <= 0.0) {
        l = light.axis_ws;
        angle = 0.0;
        return vec3(0.0);
    }
    l = to_light * inversesqrt(distance2);
    float falloff = light_falloff(light, distance2);
    float facing = light.kind == LIGHT_AREA || light.kind == LIGHT_MESH ? abs(dot(l, light.axis_ws)) : 1.0;
    angle = light.patch_radius * sqrt(facing / distance2);
    if (light.kind == LIGHT_POINT || light.kind == LIGHT_SPOT) {
        // Blender's soft lights are discs of radius r that face the shaded point: I/(d² + r²), d to the centre. A sphere
        // ("soft falloff" off) is I/d².
        vec3 to_center = light.center_ws - position_ws;
        distance2 = dot(to_center, to_center) + light.soft_radius2;
    } else {
        // The patch is a disc of its own area: π r² L / (d² + r²) facing it, bounded where the point would not be.
        distance2 += sqr(light.patch_radius);
    }
    return light_intensity(light, -l) * (falloff / max(distance2, 1e-37));
}

// --- views -----------------------------------------------------------------------------------------------------------

// Map coordinates of a point; z is its depth. The light's own span is [−1, 1]².
vec3 light_view_project(LightView v, vec3 position_ws)
{
    vec3 d = position_ws - v.origin_ws;
    float depth = dot(d, v.axis_z);
    vec2 xy = vec2(dot(d, v.axis_x) / dot(v.axis_x, v.axis_x), dot(d, v.axis_y) / dot(v.axis_y, v.axis_y));
    return vec3(v.perspective > 0.5 ? xy / max(depth, 1e-20) : xy, depth);
}

// The point at map coordinates `xy` and `depth`.
vec3 light_view_position(LightView v, vec2 xy, float depth)
{
    vec2 s = v.perspective > 0.5 ? xy * depth : xy;
    return v.origin_ws + v.axis_x * s.x + v.axis_y * s.y + v.axis_z * depth;
}

// World width of a texel at `depth`, for a tile of `size` texels.
float light_view_texel_width(LightView v, float depth)
{
    float span = 2.0 * v.guard * max(length(v.axis_x), length(v.axis_y)) / v.rect.z;
    return v.perspective > 0.5 ? span * depth : span;
}

// Solid angle of one texel by its midpoint, (1 + x² + y²)^−3/2 dx dy: exact to 1e-5 from 64 texels a side, and free of
// the cancellation between the corners' angles that ruins small texels in 32 bits.
float texel_solid_angle(vec2 center, vec2 size) { return size.x * size.y * pow(1.0 + dot(center, center), -1.5); }

// Flux (W) arriving through the texel of a bounce map centred at `xy`, `texel` wide in map coordinates, and the area
// across the beam at `depth` that the texel stands for.
vec3 light_view_flux(LightView v, Light light, vec2 xy, vec2 texel, float depth, out float beam_area)
{
    vec2 scale = vec2(length(v.axis_x), length(v.axis_y));
    if (v.perspective < 0.5) {
        beam_area = texel.x * texel.y * scale.x * scale.y;
        return light.emission * beam_area;
    }
    vec2 plane = xy * scale;
    float solid_angle = texel_solid_angle(plane, texel * scale);
    vec3 d = v.axis_x * xy.x + v.axis_y * xy.y + v.axis_z;
    float length2 = dot(d, d);
    float distance2 = depth * depth * length2;
    beam_area = solid_angle * distance2;
    return light_intensity(light, d * inversesqrt(length2)) * (solid_angle * light_falloff(light, distance2));
}
