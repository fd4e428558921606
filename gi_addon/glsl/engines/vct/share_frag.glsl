// Light at each block's representative pixel, from where its own cones and those of the blocks around it ended.

#include "lib/view_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "lib/math_lib.glsl"
#include "passes/gather_receiver.glsl"
#include "engines/vct/diffuse_lib.glsl"
#include "engines/vct/share_lib.glsl"

void main()
{
    ivec2 block = ivec2(gl_FragCoord.xy);
    Receiver r = gather_receiver(block);
    low_indirect = vec4(0.0);
    low_direction = vec4(0.0);
    if (!r.exists) {
        return;
    }
    uvec4 own[CONES];
    for (int i = 0; i < CONES; ++i) {
        own[i] = texelFetch(cone_hits, ivec3(block, i), 0);
    }
    Gatherer here = gatherer(r.position_ws, r.n, r.ng);
    Gathered g = shared_light(here, own, r.position_ws, float(GATHER_SCALE) * pixel_width(r.depth), block, SIDE, true);
    low_indirect = vec4(g.radiance, 1.0);
    low_direction = g.direction;
}
