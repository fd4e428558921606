// A ray through the depth buffer. Included where `ssdo_planes` is declared.
//
// Points along the ray are tested at quadratically growing distances; where it dives below the visible surface the crossing
// is bisected. What it then lies behind by more than `thickness` × its distance from the start, it passes behind: the depth
// buffer's surfaces are taken to be as thick as that. Screen and world scale alike, so neither zoom nor units matter.

#include "engines/ssdo/screen_lib.glsl"

// Halvings of a step: the crossing is then known to 1/32 of it.
const int BISECTIONS = 5;

struct ScreenHit {
    bool found;
    ivec2 pixel;
    float distance; // world units
    float lost;     // 1 where the ray left the screen, or ended, behind something: the screen does not know what it meets
};

float gap_at(vec3 p)
{
    vec4 plane = texelFetch(ssdo_planes, ivec2(p.xy), 0);
    return p.z - plane_at(plane, p.xy);
}

ScreenHit march(vec3 start_ws, vec3 direction_ws, float reach, int steps, float thickness, float jitter)
{
    ScreenHit hit = ScreenHit(false, ivec2(0), 0.0, 0.0);
    // A hair inside the edge, so that the last point still is a pixel.
    float far = 0.9999 * ray_length_on_screen(start_ws, direction_ws, reach);
    vec3 a = screen_from_ws(start_ws);
    vec3 b = screen_from_ws(start_ws + direction_ws * far);
    bool perspective = view.orthographic < 0.5;
    ivec2 last = textureSize(ssdo_planes, 0) - 1;
    float before = 0.0;
    bool front = true;
    for (int k = 0; k < steps; ++k) {
        if (!hit.found) {
            float s = spacing(k, steps, jitter);
            vec3 p = mix(a, b, s);
            float gap = gap_at(p);
            bool behind = gap < 0.0;
            if (behind) {
                float high = s;
                if (front) {
                    float low = before;
                    for (int i = 0; i < BISECTIONS; ++i) {
                        float middle = 0.5 * (low + high);
                        vec3 m = mix(a, b, middle);
                        float g = gap_at(m);
                        if (g < 0.0) {
                            high = middle;
                            gap = g;
                        } else {
                            low = middle;
                        }
                    }
                }
                vec3 h = mix(a, b, high);
                // Distance × q is linear over the screen, distance itself under an orthographic camera.
                float t = perspective ? far * high * b.z / h.z : far * high;
                if (depth_of_nearness(h.z) - depth_of_nearness(h.z - gap) <= thickness * t) {
                    hit.found = true;
                    hit.pixel = clamp(ivec2(h.xy), ivec2(0), last);
                    hit.distance = t;
                }
            }
            front = !behind;
            before = s;
        }
    }
    hit.lost = front ? 0.0 : 1.0;
    return hit;
}

// Whether the surface at `pixel` shows its front to a point at screen position `at`: the point is in front of its plane.
bool faces(ivec2 pixel, vec3 at)
{
    vec4 plane = texelFetch(ssdo_planes, pixel, 0);
    return at.z > plane.x + dot(plane.yz, at.xy - (vec2(pixel) + 0.5));
}
