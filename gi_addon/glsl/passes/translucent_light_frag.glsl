// Light that arrives straight from its source at the far side of a translucent surface and leaves, scattered evenly, on this
// one: L = tint E/π with the irradiance E of the side that faces away from the eye (Lambert transmission, Cycles'
// Translucent BSDF). Alpha is 1 there, 0 where a surface refracts instead.

#include "lib/view_lib.glsl"
#include "lib/math_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "lib/lamps_lib.glsl"

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 uv = gl_FragCoord.xy * view.inverse_resolution;
    float depth = texelFetch(translucent_depth, pixel, 0).r;
    transmission_direct = vec4(0.0);
    if (depth <= 0.0 || texelFetch(translucent_medium, pixel, 0).g < 0.5) {
        return;
    }
    float turn = shadow_turn(pixel);
    vec3 position_ws = position_ws_from_depth(uv, depth);
    vec4 normals = texelFetch(translucent_normal, pixel, 0);
    // Towards the far side.
    vec3 n = -octahedral_decode(normals.xy);
    vec3 ng = -octahedral_decode(normals.zw);
#if HAS_TRANSLUCENT_SET
    uint lit_with = set_at(translucent_set, pixel);
#else
    uint lit_with = 0u;
#endif
    vec3 irradiance = lamps_irradiance(position_ws, n, ng, 0.0, lit_with, turn);
    transmission_direct = vec4(irradiance * INV_PI * texelFetch(translucent_color, pixel, 0).rgb, 1.0);
}
