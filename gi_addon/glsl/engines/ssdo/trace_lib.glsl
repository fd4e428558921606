// A ray through the depth buffer, pixel by pixel where something is near and in large steps where nothing is (Uludag 2014,
// see pyramid_comp.glsl). Included where `ssdo_planes` and `ssdo_pyramid` are declared, and the layer behind if it is there
// (HAS_SSDO_PLANES_2). Unlike march_lib's it misses nothing that the screen shows, which reflections need and diffuse light does
// not. For compute shaders: software drivers take one level of detail for four neighbouring fragments, and textureSize() of one
// level for all invocations at once.
//
// A pixel's surface b is known at its middle, and so is the one before on the way, a. Where does b end, if the ray crosses its plane
// within a's square? In a valley between the two (a wall's foot) what is seen is the nearer of both planes everywhere: so b's plane,
// continued to a's middle, is behind a's there, and b goes on to where they meet. Else b would hide a's middle: it ends between the
// two, on the pixels' border in the mean, and the ray passes b's edge. A thickness that forgives such rays would catch them a pixel
// outside of every edge that they run along.
//
// What has passed an edge is inside a thing, having met a side that the eye does not see, if it is before that thing's back: the
// next layer's plane where that shows a back. A front before nothing is a sheet. A front before another front may be either, and
// is `thickness` × the ray's length thick, as all things where there is no layer behind: its light is a better guess than
// none (Sponza's Glossy Indirect: relMSE .79, .87 as sheets).

#include "engines/ssdo/screen_lib.glsl"

// Steps up and down the pyramid: a straight line over a 1080p picture needs about 100 where it grazes surfaces.
const int TRACE_STEPS = 128;

struct Traced {
    bool found;
    bool hidden;    // of the layer behind
    ivec2 pixel;
    vec2 at;        // pixel position of the hit
    float distance; // world units
};

// A part of the ray's way within a pixel: (x, y, nearness) at its ends, their shares of the way, and the pixel before.
struct Crossing {
    ivec2 pixel;
    ivec2 before;
    vec3 enter;
    vec3 leave;
    float s_enter;
    float s_leave;
    float rounding;
};

const float NO_CROSSING = 2.0;

// The share of the way at which the ray meets a layer's surface there, from the side that this shows.
float meets(sampler2D planes, Crossing c)
{
    vec4 plane = texelFetch(planes, c.pixel, 0);
    if (plane.x <= 0.5 * NOTHING) {
        return NO_CROSSING;
    }
    float side = plane.w < 0.0 ? -1.0 : 1.0;
    float gap = side * (c.enter.z - plane_near(plane, c.pixel, c.enter.xy));
    float gap_after = side * (c.leave.z - plane_near(plane, c.pixel, c.leave.xy));
    if (gap >= -c.rounding) {
        return gap_after < -c.rounding ? mix(c.s_enter, c.s_leave, max(gap, 0.0) / (max(gap, 0.0) - gap_after)) : NO_CROSSING;
    }
    // Behind it already: was that so a pixel ago?
    float s = c.s_enter - (c.s_leave - c.s_enter) * gap / min(gap_after - gap, -1e-30);
    vec3 at = mix(c.enter, c.leave, (s - c.s_enter) / max(c.s_leave - c.s_enter, 1e-30));
    vec4 other = texelFetch(planes, c.before, 0);
    vec2 middle = vec2(c.before) + 0.5;
    bool valley = side * (plane_near(plane, c.pixel, middle) - other.x) <= 0.0 && other.x > 0.5 * NOTHING;
    bool within = all(lessThanEqual(abs(at.xy - middle), vec2(0.501)));
    return valley && within && gap_after < gap ? s : NO_CROSSING;
}

Traced trace(vec3 start_ws, vec3 direction_ws, float reach, float thickness)
{
    Traced hit = Traced(false, false, ivec2(0), vec2(0.0), 0.0);
    float far = 0.9999 * ray_length_on_screen(start_ws, direction_ws, reach);
    vec3 a = screen_from_ws(start_ws);
    vec3 b = screen_from_ws(start_ws + direction_ws * far);
    bool perspective = view.orthographic < 0.5;
    vec2 way = b.xy - a.xy;
    // Where the ray crosses columns and rows: far away in s for a ray that does not.
    vec2 per_way = 1.0 / mix(way, vec2(1e-6), lessThan(abs(way), vec2(1e-6)));
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
                    ivec2 before = clamp(ivec2(floor(p.xy - ahead)), ivec2(0), last);
                    Crossing c = Crossing(pixel, before, p, mix(a, b, s_exit), s, s_exit, nearness_rounding(a));
                    float s_hit = meets(ssdo_planes, c);
                    if (s_hit > 1.0) {
                        vec4 plane = texelFetch(ssdo_planes, pixel, 0);
                        float surface = plane_near(plane, pixel, p.xy);
                        float t = perspective ? far * s * b.z / mix(a.z, b.z, s) : far * s;
                        bool inside = depth_of_nearness(p.z) - depth_of_nearness(surface) <= thickness * t;
#if HAS_SSDO_PLANES_2
                        vec4 end = texelFetch(ssdo_planes_2, pixel, 0);
                        inside = end.w < 0.0 ? p.z > plane_near(end, pixel, p.xy) : inside && end.w > 0.0;
#endif
                        s_hit = inside && p.z - surface < -c.rounding ? s : NO_CROSSING;
                    }
#if HAS_SSDO_PLANES_2
                    float s_hidden = meets(ssdo_planes_2, c);
                    hit.hidden = s_hidden < s_hit;
                    s_hit = min(s_hit, s_hidden);
#endif
                    if (s_hit <= 1.0) {
                        hit.found = true;
                        hit.pixel = pixel;
                        hit.at = mix(a.xy, b.xy, s_hit);
                        // Distance × q is linear over the screen, distance itself under an orthographic camera.
                        hit.distance = perspective ? far * s_hit * b.z / mix(a.z, b.z, s_hit) : far * s_hit;
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
