// Light from the screen per pixel: interpolated from the low resolution where that holds the pixel's surface, gathered afresh
// where it does not.

#include "engines/ssdo/gather_lib.glsl"
#include "engines/ssdo/gathered_lib.glsl"
#if HAS_LOW_INDIRECT
#include "passes/interpolate.glsl"
#endif

// A pixel that gathers afresh takes this part of a block's slices: there are many such pixels, and their neighbours complete them
// (smooth_pixels_frag.glsl). Half the time for 4 % more error; a quarter of the slices is 10 %.
const int FRESH = 2;

#if TARGET == TARGET_BOUNCE
#define LIGHT last_bounce
#else
#define LIGHT rough_light
#endif

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 uv = gl_FragCoord.xy * view.inverse_resolution;
    float depth = texelFetch(gbuf_depth, pixel, 0).r;
    if (depth <= 0.0 || !receives(pixel, 0)) {
        LIGHT = vec4(vec3(0.0), NOT_WANTED);
        return;
    }
    vec3 position_ws = position_ws_from_depth(uv, depth);
    vec4 normals = texelFetch(gbuf_normal, pixel, 0);
    vec3 n = octahedral_decode(normals.xy);
    vec3 ng = octahedral_decode(normals.zw);
    vec3 radiance = vec3(0.0);
    bool found = false;
#if HAS_LOW_INDIRECT
    // What is only sent on is averaged over whole surfaces: near an edge the blocks of one side will do.
    int blocks = interpolated_blocks(position_ws, n, ng, depth, radiance);
    found = blocks == 4 || TARGET == TARGET_BOUNCE && blocks > 0;
#endif
    if (!found) {
        radiance = gather_screen(position_ws, n, ng, view_direction_ws(uv), pixel + view.pixel_offset, max(ssdo_slices / FRESH, 1)).radiance;
    }
    LIGHT = vec4(radiance, found ? INTERPOLATED : GATHERED);
}
