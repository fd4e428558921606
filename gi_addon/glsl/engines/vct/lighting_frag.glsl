// Indirect light per pixel: interpolated from the low resolution where that holds the pixel's surface, by cones of its
// own where it does not, which those of the blocks around complete (paper §IV-B, §IV-D).

#include "lib/view_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "lib/math_lib.glsl"
#include "engines/vct/diffuse_lib.glsl"
#include "passes/interpolate.glsl"
#include "engines/vct/share_lib.glsl"

// Pixels that gather for themselves take of the nearest block of their surface, among those next to theirs, and of all that it sees.
const int NEXT = 3;

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float depth = texelFetch(gbuf_depth, pixel, 0).r;
    indirect_diffuse = vec4(0.0);
    if (depth <= 0.0) {
        return;
    }
#if GATHER_SCALE == 1
    indirect_diffuse = vec4(texelFetch(low_indirect, pixel, 0).rgb, 1.0); // a block is its pixel
#else
    vec3 position_ws = position_ws_from_depth(gl_FragCoord.xy * view.inverse_resolution, depth);
    vec4 normals = texelFetch(gbuf_normal, pixel, 0);
    vec3 n = octahedral_decode(normals.xy);
    vec3 ng = octahedral_decode(normals.zw);
    vec3 radiance;
    if (!interpolated_indirect(position_ws, n, ng, depth, radiance)) {
        uvec4 own[CONES];
        trace_hits(position_ws, n, ng, cone_run(pixel), own);
        Gatherer here = gatherer(position_ws, n, ng);
        ivec2 block = (pixel + gather_grid_offset()) / GATHER_SCALE;
        Gatherer there;
        Gatherer next = here;
        ivec2 nearest = block;
        float closest = 1e30;
        for (int i = 0; i < NEXT * NEXT; ++i) {
            ivec2 other = block + window_step(i, NEXT);
            if (on_same_surface(here, other, position_ws, float(GATHER_SCALE) * pixel_width(depth), there)) {
                float way = distance(there.at, here.at);
                if (way < closest) {
                    closest = way;
                    nearest = other;
                    next = there;
                }
            }
        }
        uint shared_ = 0u; // a bit for each block around the nearest
        if (closest < 1e30 && see_each_other(here, next)) {
            shared_ = texelFetch(seen_blocks, nearest, 0).r | 1u << (SIDE * SIDE / 2);
        }
        float nearness;
        radiance = shared_light(here, own, nearest, SIDE, shared_, nearness).radiance;
    }
    indirect_diffuse = vec4(radiance, 1.0);
#endif
}
