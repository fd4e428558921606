// Indirect light of a pixel from the low-resolution gather, where that holds the pixel's surface (Dachsbacher and
// Stamminger 2005, §4.3; paper §IV-B). Included after view_lib, math_lib and sequence_lib, where the low-resolution
// G-buffer, `low_indirect` and `low_direction` are declared.
//
// A neighbour counts if its triangle's plane is the pixel's within the blocks' own footprint and faces the same way
// within 25°: relative to the picture, not to world units. Its irradiance is turned to the pixel's shading normal by the
// linear irradiance model E(n) ∝ R0/4 + R1·n/2 (R. Ramamoorthi and P. Hanrahan, SIGGRAPH 2001, orders 0 and 1).
//
// Straight lines between blocks lie above light that is convex, by E″ h²/12 in the mean, h their width, and blocks seen aslant or off
// their middles are not where bilinear weights take them to be. A technique that knows gradients (G. Ward and P. Heckbert, "Irradiance
// Gradients", EGWR 1992) has neither error: with d_k to block k, d = Σ w_k d_k, E_k = E + E′d_k + ½E″d_k² and E′_k = E′ + E″d_k,
// Σ w_k (E_k − ½E′_k (d_k + d)) = E + O(d²).

#include "passes/gather_receiver.glsl"

#ifndef HAS_LOW_SLOPE
#define HAS_LOW_SLOPE 0 // not known here
#endif

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
    Receiver others[4];
    vec4 shares = vec4(0.0); // 0 for another surface's
    vec3 middle_ws = vec3(0.0);
    int count = 0;
    for (int k = 0; k < 4; ++k) {
        ivec2 corner = ivec2(k & 1, k >> 1);
        others[k] = gather_receiver(clamp(base + corner, ivec2(0), last));
        // Off the plane by less than half a block's width: the same surface, seen from here.
        if (on_surface(others[k], position_ws, ng, 0.5 * scale * pixel_width(depth))) {
            vec2 s = mix(1.0 - f, f, vec2(corner));
            shares[k] = s.x * s.y;
            middle_ws += shares[k] * others[k].position_ws;
            ++count;
        }
    }
    vec4 sum = vec4(0.0);
    for (int k = 0; k < 4; ++k) {
        ivec2 block = clamp(base + ivec2(k & 1, k >> 1), ivec2(0), last);
        vec4 direction = texelFetch(low_direction, block, 0);
        float from = linear_irradiance(direction, others[k].n);
        // Turning may dim to nothing, and brighten by the two-fold at most that 25° can make of an even sky.
        float turn = from > 0.0 ? min(linear_irradiance(direction, n) / from, 2.0) : 1.0;
#if HAS_LOW_SLOPE
        // Where all four are of the surface: −(d_k + d). What changes by more than itself across half a block is no straight line,
        // but never below nothing.
        vec3 back = count == 4 ? 2.0 * position_ws - others[k].position_ws - middle_ws : vec3(0.0);
        turn *= 1.0 + clamp(0.5 * dot(texelFetch(low_slope, block, 0).xyz, back), -1.0, 1.0);
#endif
        sum += shares[k] * vec4(turn * texelFetch(low_indirect, block, 0).rgb, 1.0);
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
