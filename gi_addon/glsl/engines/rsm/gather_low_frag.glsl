// Indirect light at each block's representative pixel.

#include "lib/view_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "lib/math_lib.glsl"
#include "passes/gather_receiver.glsl"
#if HAS_LOW_SLOPE
#define GATHER_SLOPE
#endif
#include "engines/rsm/gather_all_lib.glsl"

void main()
{
    Receiver r = gather_receiver(ivec2(gl_FragCoord.xy));
    low_indirect = vec4(0.0);
    low_direction = vec4(0.0);
#if HAS_LOW_SLOPE
    low_slope = vec4(0.0);
#endif
    if (r.exists) {
        Gathered g = gather_vpls(r.position_ws, r.n, r.ng,
                                 view_direction_ws((vec2(r.pixel) + 0.5) * view.inverse_resolution));
        low_indirect = vec4(g.radiance, 1.0);
        low_direction = g.direction;
#if HAS_LOW_SLOPE
        low_slope = vec4(g.slope.w > 0.0 ? g.slope.xyz / g.slope.w : vec3(0.0), 0.0);
#endif
    }
}
