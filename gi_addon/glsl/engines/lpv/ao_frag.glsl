// Ambient occlusion from the geometry volume: the share ∫ V cosθ dω/π of directions whose ray meets no wall within
// `ao_distance`, by cosine-distributed rays through the grid. It sees nothing finer than a cell, and all that the scene has, on
// screen or not. The second channel serves techniques whose indirect light nothing tests for visibility: here all is tested.

#include "lib/view_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "engines/lpv/geometry_lib.glsl"
#include "engines/lpv/march_lib.glsl"

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 uv = gl_FragCoord.xy * view.inverse_resolution;
    float depth = texelFetch(gbuf_depth, pixel, 0).r;
    if (depth <= 0.0) {
        ao_raw = vec2(0.0); // Cycles' pass is black where nothing is
        return;
    }
    vec4 normals = texelFetch(gbuf_normal, pixel, 0);
    vec3 ng = octahedral_decode(normals.zw);
    mat3 frame = frame_from_normal(octahedral_decode(normals.xy));
    vec3 position_ws = position_ws_from_depth(uv, depth);
    // 16 rotations over 4 × 4 pixels, which the blur evens out.
    ivec2 block = (pixel + view.pixel_offset) & 3;
    float turn = float(block.y * 4 + block.x) / 16.0;
    float sum = 0.0;
    for (int i = 0; i < ao_directions; ++i) {
        vec2 u = fract(sobol_2d(view.subframe * uint(ao_directions) + uint(i), 20u) + vec2(turn, turn * 7.0)); // 7: prime to 16
        vec3 direction = frame * warp_cosine_hemisphere(u);
        sum += dot(direction, ng) > 0.0 ? open_share(position_ws, ng, direction, ao_distance) : 0.0;
    }
    ao_raw = vec2(sum / float(ao_directions), 1.0);
}
