// The screen as geometry: points as (pixel x, pixel y, nearness q), in which rays are straight (planes_frag.glsl).

#include "lib/view_lib.glsl"
#include "lib/math_lib.glsl"

// Nearness where no surface is: farther than everything.
const float NOTHING = -1e30;

float nearness(float depth) { return view.orthographic > 0.5 ? -depth : 1.0 / depth; }
float depth_of_nearness(float q) { return view.orthographic > 0.5 ? -q : 1.0 / q; }

vec3 screen_from_ws(vec3 position_ws)
{
    vec3 p = project_ws(position_ws);
    return vec3(p.xy * view.resolution, nearness(p.z));
}

vec3 ws_from_screen(vec3 p) { return position_ws_from_depth(p.xy * view.inverse_resolution, depth_of_nearness(p.z)); }

// How far along a ray the screen knows it: to the picture's edge, a depth of `clip_start`, or `reach`.
float ray_length_on_screen(vec3 start_ws, vec3 direction_ws, float reach)
{
    vec4 c = view.clip_from_world * vec4(start_ws, 1.0);
    vec4 d = view.clip_from_world * vec4(direction_ws, 0.0);
    vec4 at = vec4(c.w + c.x, c.w - c.x, c.w + c.y, c.w - c.y);
    vec4 change = vec4(d.w + d.x, d.w - d.x, d.w + d.y, d.w - d.y);
    for (int i = 0; i < 4; ++i) {
        if (change[i] < 0.0) {
            reach = min(reach, max(at[i], 0.0) / -change[i]);
        }
    }
    float depth = view_depth(start_ws);
    float deeper = dot(direction_ws, view.forward_ws);
    if (deeper < 0.0) {
        reach = min(reach, max(depth - max(view.clip_start, 1e-3 * depth), 0.0) / -deeper);
    }
    return reach;
}

// Where along its way, in [0, 1], a march tests for the k-th time: finer near its start, and the end itself at last.
float spacing(float k, int steps, float jitter) { return sqr((k + jitter) / (float(steps) - 1.0 + jitter)); }

// Nearness that one pixel's width of depth makes at a screen position, and the rounding of nearness there.
float nearness_of_pixel(vec3 at) { return view.pixel_size * (view.orthographic > 0.5 ? 1.0 : at.z); }
float nearness_rounding(vec3 at) { return 1e-6 * (view.orthographic > 0.5 ? view.scene_radius : at.z); }

// Whether the surface of `pixel` shows its front (plane.w: 1 if that is the eye's side, −1 if not, 0 where nothing is) to a point
// at screen position `at`: the point is before its plane, by more than rounding, which would make planes light themselves. Normals are kept to 2⁻¹⁵, which tilts a plane of slope tan φ by
// (1 + tan² φ) of that per pixel of distance.
bool faces(vec4 plane, ivec2 pixel, vec3 at)
{
    vec2 away = at.xy - (vec2(pixel) + 0.5);
    float width = nearness_of_pixel(at);
    vec2 slope = plane.yz / width;
    float rounding = nearness_rounding(at) + width * (1.0 + dot(slope, slope)) * length(away) / 32768.0;
    return plane.w * (at.z - plane.x - dot(plane.yz, away)) > rounding;
}

// The surface of `pixel` continued to pixel position `p`, q there. A plane that is looked along would run to the eye or the
// horizon; it is followed to half and double its depth.
float plane_near(vec4 plane, ivec2 pixel, vec2 p)
{
    float q = plane.x + dot(plane.yz, p - (vec2(pixel) + 0.5));
    return view.orthographic > 0.5 ? q : clamp(q, 0.5 * plane.x, 2.0 * plane.x);
}
