// The low-resolution gather, averaged over the 3 × 3 blocks that show the same surface: 2 × 2 neighbours have directions that
// complete each other, the tent weighs the four sets alike wherever it stands, and their noise is that of one set four times as
// large. The interpolation that follows takes as much for granted: that indirect light is smooth over a few blocks of one
// surface (passes/interpolate.glsl, whose tests of that these are). It is over as far as the surfaces lie that it comes from, by
// the mean of 1/distance (G. Ward et al., "A Ray Tracing Solution for Diffuse Interreflection", SIGGRAPH 1988): not at a contact,
// nor across a wall that is thinner than a block. A gather that does not know says 0.
//
// IN_PAIRS: a block counts if the one opposite to it does. Light that falls off towards an edge is else taken from one side only:
// E at the foot of a wall came out 13 % too low (stability test 6's scene). What is linear over blocks then stays, what is curved
// does not, by the square of a block's width: so the n-th sub-frame takes 1/n of its neighbours, as the mean of n has 1/n of
// the noise; but all of them where blocks are pixels.

#include "lib/view_lib.glsl"
#include "lib/math_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "passes/gather_receiver.glsl"

// Whether there is a block `other` and it shows the surface of `here`, no farther off than what lights either.
float same_surface(ivec2 other, ivec2 last, Receiver here, float nearness, float off_plane)
{
    if (any(lessThan(other, ivec2(0))) || any(greaterThan(other, last))) {
        return 0.0;
    }
    Receiver there = gather_receiver(other);
    float d = distance(there.position_ws, here.position_ws) * max(nearness, texelFetch(raw_indirect, other, 0).a) / REACH;
    return on_surface(there, here.position_ws, here.ng, off_plane) ? max(1.0 - (SOFT != 0 ? d * d : floor(min(d, 1.0))), 0.0) : 0.0;
}

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
    float share = IN_PAIRS != 0 && GATHER_SCALE > 1 ? 1.0 / float(view.subframe + 1u) : 1.0;
    float nearness = low_indirect.a;
    float weight = 1.0;
    const int WIDTH = 2 * RADIUS + 1;
    for (int k = WIDTH * WIDTH / 2 + 1; k < WIDTH * WIDTH; ++k) {
        ivec2 step_ = ivec2(k % WIDTH, k / WIDTH) - RADIUS;
        ivec2 a = block + step_;
        ivec2 b = block - step_;
        float has_a = same_surface(a, last, here, nearness, off_plane);
        float has_b = same_surface(b, last, here, nearness, off_plane);
        if (IN_PAIRS != 0) {
            has_a = has_b = min(has_a,has_b);
        }
        vec2 tent = 1.0 - vec2(abs(step_)) / float(RADIUS + 1);
        float w_a = tent.x * tent.y * share * has_a;
        float w_b = tent.x * tent.y * share * has_b;
        a = clamp(a, ivec2(0), last);
        b = clamp(b, ivec2(0), last);
        low_indirect += w_a * texelFetch(raw_indirect, a, 0) + w_b * texelFetch(raw_indirect, b, 0);
        low_direction += w_a * texelFetch(raw_direction, a, 0) + w_b * texelFetch(raw_direction, b, 0);
        weight += w_a + w_b;
    }
    low_indirect /= weight;
    low_direction /= weight;
}
