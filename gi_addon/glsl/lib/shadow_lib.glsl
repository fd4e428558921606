// Shadow map look-ups with a soft filter (percentage closer, W. Reeves et al., SIGGRAPH 1987).
//
// Every texel of the filter is compared with the depth that the receiver's own plane has at that texel, not with the
// depth of the receiver's point: a plane then never shadows itself, however wide the filter and however steep the light,
// and nothing needs to be moved off the surface, which is what leaks light through corners. (J. Isidoro, "Shadow Mapping:
// GPU-based Tips and Techniques", GDC 2006, takes the same plane from screen derivatives.) What is left to a bias is the
// bend of surfaces within a texel.

#include "lib/light_lib.glsl"

// In texels' widths: facets that meet at 10° rise by tan(10°) ≈ 0.18 over one texel.
const float DEPTH_BIAS = 0.25;
// How far behind its plane a surface still is the receiver: as much as convex bends fall away within the filter. Found by
// scripts/score_shared.py on living_room, Diffuse Direct: 4 leaks along mouldings, 1 and less do not.
const float DEPTH_SLACK = 1.0;
// A plane nearly along the light has no depth of its own; its slope is held to this many texels' widths per texel.
const float STEEPEST = 30.0;

// The receiver's plane over the map. What is linear in map coordinates is the depth of parallel light, and one over the
// depth of light from a point.
struct ReceiverPlane {
    float value;      // at the texel coordinate asked for
    vec2 gradient;    // per texel
    float bias;       // how much nearer (in the same measure) still is the receiver itself
    float slack;      // how much farther
    bool inverse;
};

ReceiverPlane receiver_plane(LightView v, vec3 position_ws, vec3 ng, float depth)
{
    ReceiverPlane r;
    vec2 scale = 2.0 * v.guard / v.rect.zw; // map coordinates per texel
    float width = light_view_texel_width(v, depth);
    r.inverse = v.perspective > 0.5;
    vec2 along = vec2(dot(ng, v.axis_x), dot(ng, v.axis_y)) * scale;
    float limit = STEEPEST * width;
    if (r.inverse) {
        // 1/depth = n·(axis_x x + axis_y y + axis_z) / n·(p − origin).
        float c = dot(ng, position_ws - v.origin_ws);
        c = abs(c) < 1e-20 ? 1e-20 : c;
        r.value = 1.0 / depth;
        r.gradient = along / c;
        r.bias = DEPTH_BIAS * width / (depth * depth);
        r.slack = DEPTH_SLACK * width / (depth * depth);
        limit /= depth * depth;
    } else {
        float c = dot(ng, v.axis_z);
        c = abs(c) < 1e-20 ? 1e-20 : c;
        r.value = depth;
        r.gradient = -along / c;
        r.bias = DEPTH_BIAS * width;
        r.slack = DEPTH_SLACK * width;
    }
    float steep = max(abs(r.gradient.x), abs(r.gradient.y));
    r.gradient *= min(1.0, limit / max(steep, 1e-30));
    return r;
}

// What four texels around `texel` (in texels of the atlas) say of the receiver: (lit, telling), bilinear weights.
//
// A texel nearer to the light than the receiver's plane blocks it. A texel on the plane shows the receiver lit. A texel
// far behind the plane shows that the receiver is not there at all: the map looks past its edge, and such a texel tells
// nothing. Counting it as lit is what lets light leak around the inner corners of walls without thickness.
vec2 shadow_compare(sampler2D map, ReceiverPlane plane, vec2 texel, vec2 receiver)
{
    vec2 base = floor(texel - 0.5);
    vec2 f = texel - 0.5 - base;
    // textureGather's order: (0,1), (1,1), (1,0), (0,0).
    vec4 d = textureGather(map, (base + 1.0) / vec2(textureSize(map, 0)));
    d = mix(d, vec4(1e30), equal(d, vec4(0.0))); // empty texels of bounce maps
    vec2 offset = base + 0.5 - receiver;
    float origin = plane.value + dot(plane.gradient, offset);
    vec4 at = origin + vec4(plane.gradient.y, plane.gradient.x + plane.gradient.y, plane.gradient.x, 0.0);
    vec4 lit, behind;
    if (plane.inverse) {
        lit = vec4(lessThanEqual(vec4(1.0), (at + plane.bias) * d));
        behind = vec4(lessThan(vec4(1.0), (at - plane.slack) * d));
    } else {
        lit = vec4(greaterThanEqual(d, at - plane.bias));
        behind = vec4(greaterThan(d, at + plane.slack));
    }
    vec4 weight = vec4((1.0 - f.x) * f.y, f.x * f.y, f.x * (1.0 - f.y), (1.0 - f.x) * (1.0 - f.y)) * (1.0 - behind);
    return vec2(dot(weight, lit), dot(weight, vec4(1.0)));
}

// Points of a spiral that fills the unit disc evenly (H. Vogel, 1979); `turn` rotates it.
vec2 vogel_disc(int i, int count, float turn)
{
    float r = sqrt((float(i) + 0.5) / float(count));
    float phi = 2.39996323 * float(i) + turn; // the golden angle, π (3 − √5)
    return r * vec2(cos(phi), sin(phi));
}

// 3 × 3 bilinear comparisons cover a filter of radius `softness` texels without gaps up to 1.5; wider ones lean on the
// sub-frames' rotation.
vec2 shadow_narrow(sampler2D map, LightView v, ReceiverPlane plane, vec2 texel, float softness, float turn)
{
    vec2 low = v.rect.xy + 0.5;
    vec2 high = v.rect.xy + v.rect.zw - 0.5;
    mat2 rotation = mat2(cos(turn), sin(turn), -sin(turn), cos(turn));
    vec2 sum = vec2(0.0);
    int reach = softness > 0.0 ? 1 : 0;
    for (int y = -reach; y <= reach; ++y) {
        for (int x = -reach; x <= reach; ++x) {
            // Nine taps span twice the radius.
            vec2 tap = clamp(texel + rotation * (vec2(x, y) * (softness * (2.0 / 3.0))), low, high);
            sum += shadow_compare(map, plane, tap, texel);
        }
    }
    return sum;
}

// A light's point stands for a patch of its source, and a patch throws a penumbra: as wide as the patch looks from the
// blocker (R. Fernando, "Percentage-Closer Soft Shadows", SIGGRAPH 2005 sketch). In the measure that is linear over the
// map (depth, or 1/depth from a point) that width is patch × (blocker − receiver), so one formula serves both.
const int BLOCKER_TAPS = 8;
const int PENUMBRA_TAPS = 12;
// Texels. The blockers of wider penumbrae are found through the plane of a surface that may end before them, and rooms grow
// too dark (scripts/score_shared.py on living_room, Diffuse Direct: gain .99 with 4, .90 with 12, .81 with 24); sub-frames
// draw wider penumbrae by the light's points.
const float WIDEST_PENUMBRA = 4.0;

vec2 shadow_wide(sampler2D map, LightView v, ReceiverPlane plane, vec2 texel, float softness, float per_measure,
                 float search, float turn)
{
    vec2 low = v.rect.xy + 0.5;
    vec2 high = v.rect.xy + v.rect.zw - 0.5;
    float sum = 0.0;
    float count = 0.0;
    for (int i = 0; i < BLOCKER_TAPS; ++i) {
        vec2 tap = clamp(texel + search * vogel_disc(i, BLOCKER_TAPS, turn), low, high);
        ivec2 pixel = ivec2(floor(tap));
        float d = texelFetch(map, pixel, 0).r;
        d = d == 0.0 ? 1e30 : d;
        float at = plane.value + dot(plane.gradient, vec2(pixel) + 0.5 - texel);
        float gap = plane.inverse ? 1.0 / d - at : at - d;
        if (gap > plane.bias) {
            sum += gap;
            count += 1.0;
        }
    }
    if (count == 0.0) {
        return shadow_narrow(map, v, plane, texel, softness, turn);
    }
    float radius = clamp(per_measure * sum / count, softness, search);
    if (radius <= 1.5) {
        return shadow_narrow(map, v, plane, texel, radius, turn);
    }
    vec2 lit = vec2(0.0);
    for (int i = 0; i < PENUMBRA_TAPS; ++i) {
        vec2 tap = clamp(texel + radius * vogel_disc(i, PENUMBRA_TAPS, turn), low, high);
        lit += shadow_compare(map, plane, tap, texel);
    }
    return lit;
}

// Which of a light's views sees a point: the face with the largest depth; of parallel light the narrow map, the first, where it
// reaches.
int light_view_of(Light light, vec3 position_ws)
{
    if (light.views <= 1) {
        return light.first_view;
    }
    if (light_is_directional(light)) {
        vec2 at = abs(light_view_project(light_views[light.first_view], position_ws).xy);
        return light.first_view + (max(at.x, at.y) <= 1.0 ? 0 : 1);
    }
    // Faces in order +z, +x, −x, +y, −y, −z of the light's own frame (gi_addon/lights.py).
    int best = light.first_view;
    float depth = -1.0;
    for (int i = 0; i < light.views; ++i) {
        float d = dot(position_ws - light_views[light.first_view + i].origin_ws, light_views[light.first_view + i].axis_z);
        if (d > depth) {
            depth = d;
            best = light.first_view + i;
        }
    }
    return best;
}

// Share of a light that reaches a point, by the view `v` of it that sees the point. `ng` is the surface's geometric normal
// (unit, on the lit side); `softness` the filter's least radius in texels; `turn` the taps' rotation at this pixel, rad.
// An empty texel holds nothing's depth, 1e30, in shadow maps and 0 in bounce maps.
float light_visibility(sampler2D map, Light light, LightView v, vec3 position_ws, vec3 ng, float softness, float turn)
{
    vec3 p = light_view_project(v, position_ws);
    vec2 unit = p.xy / v.guard;
    if (any(greaterThan(abs(unit), vec2(1.0))) || p.z <= v.near) {
        return 1.0; // nothing of the scene lies outside a light's map, or nearer than it shows
    }
    vec2 texel = v.rect.xy + (unit * 0.5 + 0.5) * v.rect.zw;
    ReceiverPlane plane = receiver_plane(v, position_ws, ng, p.z);
    // Texels of penumbra per unit of the linear measure, and the widest one that a blocker at the near plane could throw.
    float axis = max(length(v.axis_x), length(v.axis_y));
    float per_measure = light.patch_radius / (axis * 2.0 * v.guard / v.rect.z);
    float widest = per_measure * (plane.inverse ? 1.0 / max(v.near, 1e-20) - plane.value : plane.value);
    vec2 lit = widest > max(softness, 1.0)
                   ? shadow_wide(map, v, plane, texel, softness, per_measure, min(widest, WIDEST_PENUMBRA), turn)
                   : shadow_narrow(map, v, plane, texel, softness, turn);
    if (lit.y > 1e-4) {
        return lit.x / lit.y;
    }
    // No texel tells: the surface is smaller than one. Then the point itself is compared, within a texel's width.
    float d = texelFetch(map, ivec2(floor(texel)), 0).r;
    return d == 0.0 || d >= p.z - light_view_texel_width(v, p.z) ? 1.0 : 0.0;
}

// The same by whichever map of the light sees the point. Included where HAS_SHADOW_DEPTH and HAS_RSM_DEPTH say which there are.
float light_share(Light light, vec3 position_ws, vec3 ng, float softness, float turn)
{
    if (light.views <= 0) {
        return 1.0;
    }
    LightView v = light_views[light_view_of(light, position_ws)];
#if HAS_SHADOW_DEPTH
    if (v.map == MAP_SHADOW) {
        return light_visibility(shadow_depth, light, v, position_ws, ng, softness, turn);
    }
#endif
#if HAS_RSM_DEPTH
    if (v.map == MAP_BOUNCE) {
        return light_visibility(rsm_depth, light, v, position_ws, ng, softness, turn);
    }
#endif
    return 1.0;
}

// The same for a point of the air, by its texel's depth alone: sub-frames blur it.
float air_share(Light light, vec3 position_ws)
{
    if (light.views <= 0) {
        return 1.0;
    }
    LightView v = light_views[light_view_of(light, position_ws)];
    vec3 p = light_view_project(v, position_ws);
    vec2 unit = p.xy / v.guard;
    if (any(greaterThan(abs(unit), vec2(1.0))) || p.z <= v.near) {
        return 1.0;
    }
    ivec2 texel = ivec2(v.rect.xy + (unit * 0.5 + 0.5) * v.rect.zw);
    float d = 0.0;
#if HAS_SHADOW_DEPTH
    if (v.map == MAP_SHADOW) {
        d = texelFetch(shadow_depth, texel, 0).r;
    }
#endif
#if HAS_RSM_DEPTH
    if (v.map == MAP_BOUNCE) {
        d = texelFetch(rsm_depth, texel, 0).r;
    }
#endif
    return d == 0.0 || d >= p.z ? 1.0 : 0.0;
}
