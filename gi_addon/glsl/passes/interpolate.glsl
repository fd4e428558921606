// Indirect light of a pixel from the low-resolution gather, where that holds the pixel's surface (Dachsbacher and
// Stamminger 2005, §4.3; paper §IV-B). Included after view_lib, math_lib and sequence_lib, where the low-resolution
// G-buffer, `low_indirect` and `low_direction` are declared.
//
// A neighbour counts if its triangle's plane is the pixel's within the blocks' own footprint and faces the same way
// within 25°: relative to the picture, not to world units. Its irradiance is turned to the pixel's shading normal by the
// linear irradiance model E(n) ∝ R0/4 + R1·n/2 (R. Ramamoorthi and P. Hanrahan, SIGGRAPH 2001, orders 0 and 1).

#include "passes/gather_receiver.glsl"

float linear_irradiance(vec4 direction, vec3 n) { return max(0.25 * direction.w + 0.5 * dot(direction.xyz, n), 0.0); }

// How many of the four blocks around a pixel are of its surface, and the mean of those.
int interpolated_blocks(vec3 position_ws, vec3 n, vec3 ng, float depth, out vec3 radiance)
{
    float scale = float(GATHER_SCALE);
    // A block's light is that of its middle pixel, for even blocks the one above and right of the middle (gbuffer_mips_frag.glsl).
    vec2 at = (gl_FragCoord.xy + vec2(gather_grid_offset()) - (float(GATHER_SCALE / 2) + 0.5)) / scale;
    ivec2 base = ivec2(floor(at));
    vec2 f = at - vec2(base);
    ivec2 last = textureSize(low_depth, 0) - 1;
    vec4 sum = vec4(0.0);
    int count = 0;
    for (int k = 0; k < 4; ++k) {
        ivec2 corner = ivec2(k & 1, k >> 1);
        ivec2 block = clamp(base + corner, ivec2(0), last);
        Receiver other = gather_receiver(block);
        // Off the plane by less than half a block's width: the same surface, seen from here.
        if (on_surface(other, position_ws, ng, 0.5 * scale * pixel_width(depth))) {
            vec2 s = mix(1.0 - f, f, vec2(corner));
            vec4 direction = texelFetch(low_direction, block, 0);
            float from = linear_irradiance(direction, other.n);
            // Turning may dim to nothing, and brighten by the two-fold at most that 25° can make of an even sky.
            float turn = from > 0.0 ? min(linear_irradiance(direction, n) / from, 2.0) : 1.0;
            sum += s.x * s.y * vec4(turn * texelFetch(low_indirect, block, 0).rgb, 1.0);
            ++count;
        }
    }
    radiance = count < 4 ? sum.rgb / max(sum.a, 1e-6) : sum.rgb; // else weights are 1 but for rounding
    return count;
}

// False where a neighbour is of another surface: gather afresh. With one missing, light that falls off towards an edge would be
// taken from one side of the pixel only, and jump as the grid moves; and so it would with one of no weight, since a block that
// holds an edge may stand for a pixel off its middle.
bool interpolated_indirect(vec3 position_ws, vec3 n, vec3 ng, float depth, out vec3 radiance)
{
    return interpolated_blocks(position_ws, n, ng, depth, radiance) == 4;
}
