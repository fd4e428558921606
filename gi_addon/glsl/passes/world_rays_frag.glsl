// The rays' difference at every pixel: interpolated between blocks of the same surface, by rays of its own where there is
// none. What weighs the blocks knows nothing of the directions, so the interpolated expectation is zero too.

#include "lib/view_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "passes/gather_grid.glsl"
#include "passes/world_rays.glsl"

const float SAME_FACING = 0.906; // cos 25°, as in passes/interpolate.glsl

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 uv = gl_FragCoord.xy * view.inverse_resolution;
    float depth = texelFetch(gbuf_depth, pixel, 0).r;
    world_difference = vec4(0.0);
    if (depth <= 0.0) {
        return;
    }
    vec3 position_ws = position_ws_from_depth(uv, depth);
    vec4 normals = texelFetch(gbuf_normal, pixel, 0);
    vec3 n = octahedral_decode(normals.xy);
    vec3 ng = octahedral_decode(normals.zw);
    float scale = float(GATHER_SCALE);
    vec2 at = (gl_FragCoord.xy + vec2(gather_grid_offset())) / scale - 0.5;
    ivec2 base = ivec2(floor(at));
    vec2 f = at - vec2(base);
    ivec2 last = textureSize(low_depth, 0) - 1;
    vec3 sum = vec3(0.0);
    float weight = 0.0;
    for (int k = 0; k < 4; ++k) {
        ivec2 corner = ivec2(k & 1, k >> 1);
        ivec2 block = clamp(base + corner, ivec2(0), last);
        float other_depth = texelFetch(low_depth, block, 0).r;
        vec4 other = texelFetch(low_normal, block, 0);
        ivec2 other_pixel = gather_grid_pixel(block, texelFetch(low_pixel, block, 0).rg);
        vec3 other_ws = position_ws_from_depth((vec2(other_pixel) + 0.5) * view.inverse_resolution, other_depth);
        // The same plane within half a block's width, facing the same way, as shaded too.
        bool same = other_depth > 0.0 && dot(octahedral_decode(other.zw), ng) >= SAME_FACING &&
                    dot(octahedral_decode(other.xy), n) >= SAME_FACING &&
                    abs(dot(other_ws - position_ws, ng)) <= 0.5 * scale * pixel_width(depth);
        vec2 s = mix(1.0 - f, f, vec2(corner));
        float w = same ? max(s.x * s.y, 1e-3) : 0.0;
        sum += w * texelFetch(low_rays, block, 0).rgb;
        weight += w;
    }
    world_difference = vec4(weight > 0.0 ? sum / weight : world_rays_difference(position_ws, n, ng), 1.0);
}
