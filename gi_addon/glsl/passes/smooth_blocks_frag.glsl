// The low-resolution gather, averaged over the blocks around that show the same surface. The interpolation that follows takes as much
// for granted: that indirect light is smooth over a few blocks of one surface (passes/interpolate.glsl, whose tests of that these
// are). It is over as far as the surfaces lie that it comes from, by the mean of 1/distance (G. Ward et al., "A Ray Tracing Solution
// for Diffuse Interreflection", SIGGRAPH 1988): not at a contact, nor across a wall that is thinner than a block. A gather that does
// not know says 0.
//
// RADIUS 1: 3 × 3 blocks; 2 × 2 neighbours have directions that complete each other, the tent weighs the four sets alike wherever it
// stands, and their noise is that of one set four times as large.
// Wider, for gathers that share all directions of 5 × 5 blocks already, whose noise is as wide: a block counts by 1 − (r/(RADIUS +
// 1))², and by 1 − (its distance over that of what lights it)², as what is curved adds an error of.
//
// IN_PAIRS: a block counts if the one opposite to it does. Light that falls off towards an edge is else taken from one side only:
// E at the foot of a wall came out 13 % too low (stability test 6's scene). What is linear over blocks then stays, what is curved
// does not, by the square of a block's width: so the n-th sub-frame takes 1/n of its neighbours, as the mean of n has 1/n of
// the noise; but all of 3 × 3 where blocks are pixels. Of a wider window it takes the middle, of 1/n of the area.

#include "lib/view_lib.glsl"
#include "lib/math_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "passes/gather_receiver.glsl"

#if HAS_SEEN
// Whether nothing stands between a block and another up to four away, by the bits of 5 × 5 around it and around one on the way.
bool sees(ivec2 block, ivec2 step_)
{
    ivec2 size = abs(step_);
    ivec2 first = max(size.x, size.y) > 2 ? step_ / 2 : step_;
    ivec2 bit = first + 2;
    if ((texelFetch(seen_blocks, block, 0).r >> (bit.x + 5 * bit.y) & 1u) == 0u) {
        return false;
    }
    bit = step_ - first + 2;
    return first == step_ || (texelFetch(seen_blocks, block + first, 0).r >> (bit.x + 5 * bit.y) & 1u) == 1u;
}
#endif

// How far off a block is, 1 as far as what lights either; FAR where there is none or it shows another surface than `here`.
const float FAR = 1e30;
float how_far(ivec2 other, ivec2 last, Receiver here, float nearness, float off_plane)
{
    if (any(lessThan(other, ivec2(0))) || any(greaterThan(other, last))) {
        return FAR;
    }
    Receiver there = gather_receiver(other);
#if !HAS_SEEN // else it is known to be of the surface
    if (!on_surface(there, here.position_ws, here.ng, off_plane)) {
        return FAR;
    }
#endif
    return distance(there.position_ws, here.position_ws) * max(nearness, texelFetch(raw_indirect, other, 0).a);
}

// Weight of a block as far off as `how_far` says, in the n-th sub-frame.
float near_weight(float far, float n)
{
    return RADIUS == 1 ? (far <= 1.0 ? 1.0 : 0.0) : max(1.0 - min(far, 1.0) * min(far, 1.0) * n, 0.0);
}

// Weight of a step in the window.
float window_weight(ivec2 step_, float n)
{
    vec2 far = vec2(step_) / float(RADIUS + 1);
    if (RADIUS > 1) {
        return max(1.0 - n * dot(far, far), 0.0);
    }
    far = 1.0 - abs(far);
    return IN_PAIRS != 0 && GATHER_SCALE > 1 ? far.x * far.y / n : far.x * far.y;
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
    float n = float(view.subframe + 1u);
    float nearness = low_indirect.a;
    float weight = 1.0;
    const int WIDTH = 2 * RADIUS + 1;
    for (int k = WIDTH * WIDTH / 2 + 1; k < WIDTH * WIDTH; ++k) {
        ivec2 step_ = ivec2(k % WIDTH, k / WIDTH) - RADIUS;
        float w = window_weight(step_, n);
        if (w == 0.0) {
            continue;
        }
        ivec2 a = block + step_;
        ivec2 b = block - step_;
#if HAS_SEEN
        if (!sees(block, step_) || !sees(block, -step_)) {
            continue;
        }
#endif
        float w_a = w * near_weight(how_far(a, last, here, nearness, off_plane), n);
        float w_b = w * near_weight(how_far(b, last, here, nearness, off_plane), n);
        if (IN_PAIRS != 0) {
            w_a = w_b = min(w_a, w_b);
        }
        a = clamp(a, ivec2(0), last);
        b = clamp(b, ivec2(0), last);
        low_indirect += w_a * texelFetch(raw_indirect, a, 0) + w_b * texelFetch(raw_indirect, b, 0);
        low_direction += w_a * texelFetch(raw_direction, a, 0) + w_b * texelFetch(raw_direction, b, 0);
        weight += w_a + w_b;
    }
    low_indirect /= weight;
    low_direction /= weight;
}
