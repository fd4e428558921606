// Light at each block's representative pixel, from where its own cones and those of the blocks around it ended.

#include "lib/view_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "lib/math_lib.glsl"
#include "passes/gather_receiver.glsl"
#include "engines/vct/diffuse_lib.glsl"
#include "engines/vct/share_lib.glsl"

bool joined(ivec2 a, ivec2 step_)
{
    if (step_.x < 0 || (step_.x == 0 && step_.y < 0)) {
        a += step_;
        step_ = -step_;
    }
    int k = step_.y == 0 ? 0 : step_.x == 0 ? 1 : step_.y > 0 ? 2 : 3; // of PAIR
    return (uint(texelFetch(joined_to, a, 0).r * 255.0 + 0.5) >> k & 1u) == 1u;
}

// Whether nothing stands between a block and one up to two away, by the neighbours that lie on the way.
bool sees_block(ivec2 block, ivec2 step_)
{
    ivec2 towards = sign(step_);
    if (step_ == towards) {
        return joined(block, step_);
    }
    if (joined(block, towards) && joined(block + towards, step_ - towards)) {
        return true;
    }
    // A knight's move has two ways.
    towards = ivec2(step_ / 2);
    return abs(step_.x) != abs(step_.y) && joined(block, towards) && joined(block + towards, step_ - towards);
}

void main()
{
    ivec2 block = ivec2(gl_FragCoord.xy);
    Receiver r = gather_receiver(block);
    raw_indirect = vec4(0.0);
    raw_direction = vec4(0.0);
    seen_blocks = 0u;
    if (!r.exists) {
        return;
    }
    uvec4 own[CONES];
    for (int i = 0; i < CONES; ++i) {
        own[i] = texelFetch(cone_hits, ivec3(block, i), 0);
    }
    Gatherer here = gatherer(r.position_ws, r.n, r.ng);
    float off_plane = float(GATHER_SCALE) * pixel_width(r.depth);
    Gatherer there;
    for (int i = 0; i < SIDE * SIDE; ++i) {
        ivec2 step_ = window_step(i, SIDE);
        if (step_ != ivec2(0) && on_same_surface(here, block + step_, r.position_ws, off_plane, there)) {
            seen_blocks |= sees_block(block, step_) ? 1u << i : 0u;
        }
    }
    float nearness;
    Gathered g = shared_light(here, own, block, SIDE, seen_blocks, nearness);
    raw_indirect = vec4(g.radiance, nearness);
    raw_direction = g.direction;
}
