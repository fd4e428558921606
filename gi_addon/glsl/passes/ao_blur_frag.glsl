// 5 × 5 Gaussian of the paper's §IV-B over the 4 × 4 rotations; neighbours on another surface are left out.

#include "lib/view_lib.glsl"
#include "lib/math_lib.glsl"

// exp(−x²/2σ²), σ = 1.25 texels: the kernel then ends at its 4 % tail.
const float WEIGHT[3] = float[3](1.0, 0.726, 0.278); // exp(−1/3.125), exp(−4/3.125)

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    ivec2 size = textureSize(ao_raw, 0);
    float depth = texelFetch(gbuf_depth, pixel, 0).r;
    if (depth <= 0.0) {
        ao = vec2(0.0);
        return;
    }
    vec3 ng = octahedral_decode(texelFetch(gbuf_normal, pixel, 0).zw);
    vec3 position_ws = position_ws_from_depth(gl_FragCoord.xy * view.inverse_resolution, depth);
    float width = pixel_width(depth);
    vec2 sum = vec2(0.0);
    float weight = 0.0;
    for (int y = -2; y <= 2; ++y) {
        for (int x = -2; x <= 2; ++x) {
            ivec2 q = pixel + ivec2(x, y);
            if (any(lessThan(q, ivec2(0))) || any(greaterThanEqual(q, size))) {
                continue;
            }
            float d = texelFetch(gbuf_depth, q, 0).r;
            if (d <= 0.0) {
                continue;
            }
            vec3 other_ws = position_ws_from_depth((vec2(q) + 0.5) * view.inverse_resolution, d);
            // Same surface: within two pixels' width of this pixel's plane.
            if (abs(dot(other_ws - position_ws, ng)) > 2.0 * width) {
                continue;
            }
            float w = WEIGHT[abs(x)] * WEIGHT[abs(y)];
            sum += w * texelFetch(ao_raw, q, 0).rg;
            weight += w;
        }
    }
    ao = sum / weight;
}
