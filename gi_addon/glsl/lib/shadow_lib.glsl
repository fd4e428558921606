// Shadow map look-ups with a soft filter (percentage closer, W. Reeves et al., SIGGRAPH 1987).
//
// Every texel of the filter is compared with the depth that the receiver's own plane has at that texel, not with the
// depth of the receiver's point: a plane then never shadows itself, however wide the filter and however steep the light,
// and nothing needs to be moved off the surface, which is what leaks light through corners. (J. Isidoro, "Shadow Mapping:
// GPU-based Tips and Techniques", GDC 2006, takes the same plane from screen derivatives.) What is left to a bias is the
// bend of surfaces within a texel.

#include "lib/light_lib.glsl"

// In texels' widths: facets that meet at 10° rise by tan(10°) ≈ 0.18 over one texel.
const float DEPTH_BIAS = 0.2;
// A plane nearly along the light has no depth of its own; its slope is held to this many texels' widths per texel.
const float STEEPEST = 30.0;

// The receiver's plane over the map. What is linear in map coordinates is the depth of parallel light, and one over the
// depth of light from a point.
struct ReceiverPlane {
    float value;      // at the texel coordinate asked for
    vec2 gradient;    // per texel
    float bias;       // how much nearer (in the same measure) still is the receiver itself
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
        limit /= depth * depth;
    } else {
        float c = dot(ng, v.axis_z);
        c = abs(c) < 1e-20 ? 1e-20 : c;
        r.value = depth;
        r.gradient = -along / c;
        r.bias = DEPTH_BIAS * width;
    }
    float steep = max(abs(r.gradient.x), abs(r.gradient.y));
    r.gradient *= min(1.0, limit / max(steep, 1e-30));
    return r;
}

// Four texels around `texel` (in texels of the atlas), each lit or not, then interpolated. `offset` is where the first
// of them lies from the receiver's own coordinate, in texels.
float shadow_compare(sampler2D map, ReceiverPlane plane, vec2 texel, vec2 receiver)
{
    vec2 base = floor(texel - 0.5);
    vec2 f = texel - 0.5 - base;
    // textureGather's order: (0,1), (1,1), (1,0), (0,0).
    vec4 d = textureGather(map, (base + 1.0) / vec2(textureSize(map, 0)));
    vec2 offset = base + 0.5 - receiver;
    float origin = plane.value + dot(plane.gradient, offset);
    vec4 at = origin + vec4(plane.gradient.y, plane.gradient.x + plane.gradient.y, plane.gradient.x, 0.0);
    vec4 lit = plane.inverse ? vec4(lessThanEqual(vec4(1.0), (at + plane.bias) * d))
                             : vec4(greaterThanEqual(d, at - plane.bias));
    return mix(mix(lit.w, lit.z, f.x), mix(lit.x, lit.y, f.x), f.y);
}

// 3 × 3 bilinear comparisons cover a filter of radius `softness` texels without gaps up to 1.5; wider ones lean on the
// sub-frames' rotation.
float shadow_filtered(sampler2D map, LightView v, ReceiverPlane plane, vec2 texel, float softness, float angle)
{
    if (softness <= 0.0) {
        return shadow_compare(map, plane, texel, texel);
    }
    vec2 low = v.rect.xy + 0.5;
    vec2 high = v.rect.xy + v.rect.zw - 0.5;
    mat2 turn = mat2(cos(angle), sin(angle), -sin(angle), cos(angle));
    float sum = 0.0;
    for (int y = -1; y <= 1; ++y) {
        for (int x = -1; x <= 1; ++x) {
            vec2 tap = clamp(texel + turn * (vec2(x, y) * (softness * (2.0 / 3.0))), low, high); // 9 taps span 2 r
            sum += shadow_compare(map, plane, tap, texel);
        }
    }
    return sum / 9.0;
}

// Which of a light's views sees a point: the face with the largest depth.
int light_view_of(Light light, vec3 position_ws)
{
    if (light.views <= 1) {
        return light.first_view;
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

// Share of a light that reaches a point of a surface with geometric normal `ng` (unit, on the lit side).
float light_visibility(sampler2D map, Light light, vec3 position_ws, vec3 ng, float softness, float angle)
{
    if (light.views == 0) {
        return 1.0;
    }
    LightView v = light_views[light_view_of(light, position_ws)];
    vec3 p = light_view_project(v, position_ws);
    vec2 unit = p.xy / v.guard;
    if (any(greaterThan(abs(unit), vec2(1.0))) || p.z <= v.near) {
        return 1.0; // nothing of the scene lies outside a light's map, or nearer than it shows
    }
    vec2 texel = v.rect.xy + (unit * 0.5 + 0.5) * v.rect.zw;
    return shadow_filtered(map, v, receiver_plane(v, position_ws, ng, p.z), texel, softness, angle);
}
