// Where the cones of each block's representative pixel end, what light comes from there, and which blocks are neighbours.

#include "lib/view_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "lib/math_lib.glsl"
#include "passes/gather_receiver.glsl"
#include "engines/vct/diffuse_lib.glsl"
#include "engines/vct/hits_lib.glsl"
#include "engines/vct/joined_lib.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main()
{
    ivec2 block = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(block, textureSize(low_depth, 0)))) {
        return;
    }
    Receiver r = gather_receiver(block);
    uvec4 hits[CONES];
    uint joined = 0u;
    if (r.exists) {
        joined = joined_blocks(r, block);
        trace_hits(r.position_ws, r.n, r.ng, cone_run(block), hits);
    }
    imageStore(joined_to, block, vec4(float(joined) / 255.0));
    for (int i = 0; i < CONES; ++i) {
        imageStore(cone_hits, ivec3(block, i), r.exists ? hits[i] : uvec4(0u));
    }
}
