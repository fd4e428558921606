// Light from the screen at each block's representative pixel.

#include "engines/ssdo/gather_lib.glsl"
#include "passes/gather_receiver.glsl"

void main()
{
    ivec2 block = ivec2(gl_FragCoord.xy);
    Receiver r = gather_receiver(block);
    raw_indirect = vec4(0.0);
    raw_direction = vec4(0.0);
    // Smoothing and interpolation reach two blocks far.
    if (r.exists && receives(r.pixel, 3 * GATHER_SCALE)) {
        vec2 uv = (vec2(r.pixel) + 0.5) * view.inverse_resolution;
        Gathered g = gather_screen(r.position_ws, r.n, r.ng, view_direction_ws(uv), block, ssdo_slices);
        raw_indirect = vec4(g.radiance, 0.0);
        raw_direction = g.direction;
    }
}
