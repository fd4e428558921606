// The visible surface of each pixel as a plane over the screen: nearness, and its slope per pixel.
//
// Nearness q is 1/depth for a perspective camera and −depth for an orthographic one: what is linear over the screen on
// planes and along rays alike. A ray's point is behind a pixel's surface where its q is less than the plane's q at that very
// point of the pixel, so that a plane never hides itself, however steep, and no bias is needed.
// From n·(o + d/q − p) = 0 along the ray o + d z: q = n·d / n·(p − o), or z = n·(p − o)/n·d with d constant.

#include "engines/ssdo/screen_lib.glsl"
#include "engines/ssdo/layer_lib.glsl"

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 uv = gl_FragCoord.xy * view.inverse_resolution;
    float depth = texelFetch(gbuf_depth, pixel, 0).r;
    PLANES = vec4(NOTHING, 0.0, 0.0, 0.0);
    if (depth <= 0.0) {
        return;
    }
    vec3 ng = octahedral_decode(texelFetch(gbuf_normal, pixel, 0).zw);
    vec3 d = ray_direction_ws(uv);
    float side = dot(ng, d) <= 0.0 ? 1.0 : -1.0;
    ng *= side;
    float q = nearness(depth);
    vec2 slope;
    if (view.orthographic > 0.5) {
        slope = vec2(dot(ng, view.origin_u), dot(ng, view.origin_v)) / -max(-dot(ng, d), 1e-6);
    } else {
        // n·(p − o) = depth n·d, negative for a plane that is seen.
        float plane = -max(-dot(ng, d), 1e-6) * depth;
        slope = vec2(dot(ng, view.direction_u), dot(ng, view.direction_v)) / plane;
    }
    slope *= view.inverse_resolution;
    // A plane seen edge-on runs from eye to horizon within its pixel; beyond half its depth it says nothing.
    float steepest = view.orthographic > 0.5 ? depth : q;
    float steep = max(abs(slope.x), abs(slope.y));
    slope *= min(1.0, steepest / max(steep, 1e-30));
    PLANES = vec4(q, slope, side);
}
