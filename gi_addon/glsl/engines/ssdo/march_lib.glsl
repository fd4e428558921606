// A ray through the depth buffer. Included where `ssdo_planes` is declared.
//
// The buffer is sampled at quadratically growing distances. A sample's plane stands for the screen half-way to the samples
// before and after it, and the ray is cut with it there: steps of many pixels then lose no light at the edges of surfaces
// (tests/test_ssdo.py holds it to form factors). What a ray is already behind where a sample's part begins, it enters from the
// side if it is behind by less than `thickness` × its distance from the start; otherwise it passes behind. Screen and world
// scale alike, so neither zoom nor units matter.

#include "engines/ssdo/screen_lib.glsl"

struct ScreenHit {
    bool found;
    ivec2 pixel;
    float distance; // world units
};

ScreenHit march(vec3 start_ws, vec3 direction_ws, float reach, int steps, float thickness, float jitter)
{
    ScreenHit hit = ScreenHit(false, ivec2(0), 0.0);
    // A hair inside the edge, so that the last point still is a pixel.
    float far = 0.9999 * ray_length_on_screen(start_ws, direction_ws, reach);
    vec3 a = screen_from_ws(start_ws);
    vec3 b = screen_from_ws(start_ws + direction_ws * far);
    bool perspective = view.orthographic < 0.5;
    ivec2 last = textureSize(ssdo_planes, 0) - 1;
    // Rounding of q, of which a ray's start has no more to spare.
    float rounding = nearness_rounding(a);
    for (int k = 0; k < steps; ++k) {
        if (!hit.found) {
            float s = spacing(float(k), steps, jitter);
            ivec2 pixel = clamp(ivec2(mix(a.xy, b.xy, s)), ivec2(0), last);
            vec4 plane = texelFetch(ssdo_planes, pixel, 0);
            float s_before = k > 0 ? spacing(float(k) - 0.5, steps, jitter) : 0.0;
            float s_after = k + 1 < steps ? spacing(float(k) + 0.5, steps, jitter) : 1.0;
            vec3 before = mix(a, b, s_before);
            vec3 after = mix(a, b, s_after);
            float surface = plane_near(plane, pixel, before.xy);
            float gap = before.z - surface;
            float gap_after = after.z - plane_near(plane, pixel, after.xy);
            bool side = gap < -rounding;
            float s_hit = side || gap_after >= 0.0 ? s_before : mix(s_before, s_after, max(gap, 0.0) / (max(gap, 0.0) - gap_after));
            // Distance × q is linear over the screen, distance itself under an orthographic camera.
            float t = perspective ? far * s_hit * b.z / mix(a.z, b.z, s_hit) : far * s_hit;
            bool enters = side ? depth_of_nearness(before.z) - depth_of_nearness(surface) <= thickness * t : gap_after < 0.0;
            if (enters && plane.x > 0.5 * NOTHING) {
                hit.found = true;
                hit.pixel = pixel;
                hit.distance = t;
            }
        }
    }
    return hit;
}
