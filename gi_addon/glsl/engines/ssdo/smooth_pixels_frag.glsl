// Pixels that gathered afresh, averaged over the 3 × 3 pixels of one surface as blocks are (passes/smooth_blocks_frag.glsl): they too
// have parts of one set of directions, and stand in lines along edges, which would be dotted. In pairs of opposite pixels, and
// 1/n of them in the n-th sub-frame, for the reasons given there: in a box's corners light curves within a pixel (all of them in
// each sub-frame took 1.2 % of an empty Cornell box's).

#include "lib/view_lib.glsl"
#include "lib/math_lib.glsl"
#include "passes/receiver.glsl"
#include "engines/ssdo/gathered_lib.glsl"

#if TARGET == TARGET_INDIRECT
#define TARGET_LIGHT indirect_diffuse
#else
#define TARGET_LIGHT screen_light
#endif

Receiver pixel_receiver(ivec2 pixel)
{
    return receiver_of(pixel, texelFetch(gbuf_depth, pixel, 0).r, texelFetch(gbuf_normal, pixel, 0));
}

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 light = texelFetch(rough_light, pixel, 0);
    if (light.a == GATHERED) {
        Receiver here = pixel_receiver(pixel);
        float off_plane = pixel_width(here.depth);
        ivec2 last = textureSize(rough_light, 0) - 1;
        float share = 1.0 / float(view.subframe + 1u);
        vec4 sum = vec4(light.rgb, 1.0);
        for (int k = 0; k < PAIRS; ++k) {
            ivec2 a = clamp(pixel + PAIR[k], ivec2(0), last);
            ivec2 b = clamp(pixel - PAIR[k], ivec2(0), last);
            vec4 light_a = texelFetch(rough_light, a, 0);
            vec4 light_b = texelFetch(rough_light, b, 0);
            bool known = min(light_a.a, light_b.a) > NOT_WANTED && a + b == 2 * pixel;
            if (known && on_surface(pixel_receiver(a), here.position_ws, here.ng, off_plane) &&
                on_surface(pixel_receiver(b), here.position_ws, here.ng, off_plane)) {
                sum += share * WEIGHT[k] * vec4(light_a.rgb + light_b.rgb, 2.0);
            }
        }
        light.rgb = sum.rgb / sum.a;
    }
    TARGET_LIGHT = vec4(light.rgb, 1.0);
}
