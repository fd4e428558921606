// The low-resolution gather, averaged over the 3 × 3 blocks that show the same surface: every block has its own directions,
// and nine blocks' together are a ninth of the noise. The interpolation that follows takes as much for granted: that indirect
// light is smooth over a few blocks of one surface (passes/interpolate.glsl, whose tests of that these are).

#include "lib/view_lib.glsl"
#include "lib/math_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "passes/gather_grid.glsl"

const float SAME_FACING = 0.906; // cos 25°
// A tent over three blocks.
const float WEIGHT[2] = float[2](1.0, 0.5);

vec3 block_position(ivec2 block, float depth)
{
    ivec2 pixel = gather_grid_pixel(block, texelFetch(low_pixel, block, 0).rg);
    return position_ws_from_depth((vec2(pixel) + 0.5) * view.inverse_resolution, depth);
}

bool near_enough(ivec2 other, vec3 p, float d, float r) { return distance(block_position(other,d), p) <= min(r, texelFetch(raw_indirect, other, 0).a); }

void main()
{
    ivec2 block = ivec2(gl_FragCoord.xy);
    low_indirect = texelFetch(raw_indirect, block, 0);
    low_direction = texelFetch(raw_direction, block, 0);
    float depth = texelFetch(low_depth, block, 0).r;
    if (depth <= 0.0) {
        return;
    }
    vec3 ng = octahedral_decode(texelFetch(low_normal, block, 0).zw);
    vec3 position_ws = block_position(block, depth);
    float off_plane = float(GATHER_SCALE) * pixel_width(depth);
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
            float other_depth = texelFetch(low_depth, other, 0).r;
            if (other_depth > 0.0 && w > 0.0 && dot(octahedral_decode(texelFetch(low_normal, other, 0).zw), ng) >= SAME_FACING &&
                abs(dot(block_position(other, other_depth) - position_ws, ng)) <= off_plane && near_enough(other, position_ws, other_depth, low_indirect.a)) {
                light += w * texelFetch(raw_indirect, other, 0);
                direction += w * texelFetch(raw_direction, other, 0);
                weight += w;
            }
        }
    }
    low_indirect = light / weight;
    low_direction = direction / weight;
}
