// The low-resolution gather, averaged over the 3 × 3 blocks that show the same surface: every block has its own directions,
// and nine blocks' together are a ninth of the noise. The interpolation that follows takes as much for granted: that indirect
// light is smooth over a few blocks of one surface (passes/interpolate.glsl, whose tests of that these are). It is over as far as
// the surfaces lie that it comes from, by the mean of 1/distance (G. Ward et al., "A Ray Tracing Solution for Diffuse
// Interreflection", SIGGRAPH 1988): not at a contact, nor across a wall. A gather that does not know says 0.

#include "lib/view_lib.glsl"
#include "lib/math_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "passes/gather_receiver.glsl"

// A tent over three blocks.
const float WEIGHT[2] = float[2](1.0, 0.5);

void main()
{
    ivec2 block = ivec2(gl_FragCoord.xy);
    low_indirect = texelFetch(raw_indirect, block, 0);
    low_direction = texelFetch(raw_direction, block, 0);
    Receiver here = gather_receiver(block);
    if (!here.exists) {
        return;
    }
    float off_plane = float(GATHER_SCALE) * pixel_width(here.depth);
    ivec2 last = textureSize(low_depth, 0) - 1;
    vec4 light = vec4(0.0);
    vec4 direction = vec4(0.0);
    float weight = 0.0;
    for (int y = -1; y <= 1; ++y) {
        for (int x = -1; x <= 1; ++x) {
            ivec2 other = block + ivec2(x, y);
            float w = WEIGHT[abs(x)] * WEIGHT[abs(y)];
            if (any(lessThan(other, ivec2(0))) || any(greaterThan(other, last))) {
                w = 0.0;
            }
            other = clamp(other, ivec2(0), last);
            Receiver there = gather_receiver(other);
            float nearness = max(low_indirect.a, texelFetch(raw_indirect, other, 0).a);
            if (w > 0.0 && on_surface(there, here.position_ws, here.ng, off_plane) &&
                distance(there.position_ws, here.position_ws) * nearness <= 1.0) {
                light += w * texelFetch(raw_indirect, other, 0);
                direction += w * texelFetch(raw_direction, other, 0);
                weight += w;
            }
        }
    }
    low_indirect = light / weight;
    low_direction = direction / weight;
}
