// Indirect light at each block's representative pixel, by cones.

#include "lib/view_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "lib/math_lib.glsl"
#include "passes/gather_receiver.glsl"
#include "engines/vct/diffuse_lib.glsl"

void main()
{
    Receiver r = gather_receiver(ivec2(gl_FragCoord.xy));
    raw_indirect = vec4(0.0);
    raw_direction = vec4(0.0);
    if (r.exists) {
        Gathered g = gather_cones(r.position_ws, r.n, r.ng);
        raw_indirect = vec4(g.radiance, g.nearness);
        raw_direction = g.direction;
    }
}
