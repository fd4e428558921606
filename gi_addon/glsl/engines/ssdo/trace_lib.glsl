// A ray through the depth buffer, pixel by pixel where something is near and in large steps where nothing is (Uludag 2014,
// see pyramid_comp.glsl). Included where `ssdo_planes` and `ssdo_pyramid` are declared. Unlike march_lib's it misses nothing
// that the screen shows, which reflections need and diffuse light does not. For compute shaders: software drivers take one
// level of detail for four neighbouring fragments, and textureSize() of one level for all invocations at once.

#include "engines/ssdo/screen_lib.glsl"

// Steps up and down the pyramid: a straight line over a 1080p picture needs about 100 where it grazes surfaces.
const int TRACE_STEPS = 128;

struct Traced {
    bool found;
    vec2 at;        // pixel position of the hit
    float distance; // world units
};

Traced trace(vec3 start_ws, vec3 direction_ws, float reach, float thickness)
{
    Traced hit = Traced(false, vec2(0.0), 0.0);
    float far = 0.9999 * ray_length_on_screen(start_ws, direction_ws, reach);
    vec3 a = screen_from_ws(start_ws);
    vec3 b = screen_from_ws(start_ws + direction_ws * far);
    bool perspective = view.orthographic < 0.5;
    float rounding = nearness_rounding(a);
    vec2 way = b.xy - a.xy;
    // Where the ray crosses columns and rows: far away in s for a ray that does not.
    vec2 per_way = 1.0 / mix(way, vec2(1e-6), lessThan(abs(way), vec2(1e-6)));
    float per_pixel = inversesqrt(max(dot(way, way), 1.0)); // share of the way
    vec2 forward = vec2(greaterThan(per_way, vec2(0.0)));
    int top = textureQueryLevels(ssdo_pyramid) - 1;
    ivec2 last = textureSize(ssdo_planes, 0) - 1;
    int level = 0;
    float s = 0.0;
    // A point on a border between cells belongs to the one ahead: a thousandth of a pixel is above rounding.
    vec2 ahead = 1e-3 * (2.0 * forward - 1.0);
    bool open_way = far > 0.0;
    for (int i = 0; i < TRACE_STEPS; ++i) {
        if (open_way) {
            vec3 p = mix(a, b, s);
            float size = float(1 << level);
            vec2 cell = floor((p.xy + ahead) / size);
            vec2 exits = ((cell + forward) * size - a.xy) * per_way;
            float s_exit = min(max(min(exits.x, exits.y), s), 1.0);
            float q_exit = mix(a.z, b.z, s_exit);
            ivec2 texel = min(ivec2(cell), max((last + 1) >> level, ivec2(1)) - 1);
            bool clear = min(p.z, q_exit) > texelFetch(ssdo_pyramid, texel, level).r;
            if (!clear && level > 0) {
                level -= 1;
            } else {
                if (!clear) {
                    ivec2 pixel = clamp(ivec2(cell), ivec2(0), last);
                    vec4 plane = texelFetch(ssdo_planes, pixel, 0);
                    vec2 p_exit = mix(a.xy, b.xy, s_exit);
                    float surface = plane_near(plane, pixel, p.xy);
                    float gap = p.z - surface;
                    float gap_exit = q_exit - plane_near(plane, pixel, p_exit);
                    bool side = gap < -rounding;
                    float s_hit = side || gap_exit >= 0.0 ? s : mix(s, s_exit, max(gap, 0.0) / (max(gap, 0.0) - gap_exit));
                    float t = perspective ? far * s_hit * b.z / mix(a.z, b.z, s_hit) : far * s_hit;
                    // A surface is known to a pixel: what the ray was before a pixel ago, it has met on the way.
                    vec3 ago = mix(a, b, max(s - per_pixel, 0.0));
                    bool met = ago.z - plane_near(plane, pixel, ago.xy) > rounding;
                    bool enters = side ? met || depth_of_nearness(p.z) - depth_of_nearness(surface) <= thickness * t
                                       : gap_exit < -rounding;
                    if (enters) {
                        hit.found = true;
                        hit.at = mix(a.xy, b.xy, s_hit);
                        hit.distance = t;
                    }
                }
                if (hit.found || s_exit >= 1.0) {
                    open_way = false;
                }
                s = s_exit;
                level = clear ? min(level + 1, top) : level;
            }
        }
    }
    return hit;
}
