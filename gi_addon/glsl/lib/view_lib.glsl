// The camera of this sub-frame, and the spaces: _ws world, _vs view (−z forward), _os object. `uv` is in [0, 1]² over the
// rendered region, v up. `view_from_world` reads right to left.

#include "generated/view.glsl"

vec3 ray_origin_ws(vec2 uv) { return view.origin_ws + view.origin_u * uv.x + view.origin_v * uv.y; }

// Not normalised: one unit of view depth per unit.
vec3 ray_direction_ws(vec2 uv) { return view.direction_ws + view.direction_u * uv.x + view.direction_v * uv.y; }

vec3 position_ws_from_depth(vec2 uv, float depth) { return ray_origin_ws(uv) + ray_direction_ws(uv) * depth; }

// A pixel's ray from where the view begins to a depth, `end` units away; 1e30 where there is nothing (depth 0).
struct EyeRay {
    vec3 origin_ws;
    vec3 direction;
    float end;
};

EyeRay eye_ray(vec2 uv, float depth)
{
    vec3 ray = ray_direction_ws(uv);
    float scale = length(ray);
    return EyeRay(ray_origin_ws(uv) + ray * view.clip_start, ray / scale, depth > 0.0 ? (depth - view.clip_start) * scale : 1e30);
}

// View depth of a point: its distance along the view axis.
float view_depth(vec3 position_ws) { return -(view.view_from_world * vec4(position_ws, 1.0)).z; }

// Towards the camera.
vec3 view_direction_ws(vec2 uv) { return -normalize(ray_direction_ws(uv)); }

// Width of a pixel at this view depth, in world units.
float pixel_width(float depth) { return view.orthographic > 0.5 ? view.pixel_size : view.pixel_size * depth; }

// Pixel coordinates of a world point; z is its view depth.
vec3 project_ws(vec3 position_ws)
{
    vec4 clip = view.clip_from_world * vec4(position_ws, 1.0);
    return vec3(clip.xy / clip.w * 0.5 + 0.5, view_depth(position_ws));
}
