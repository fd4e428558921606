// Indirect light per pixel: interpolated from the low resolution where that holds the pixel's surface, gathered afresh
// where it does not (Dachsbacher and Stamminger 2005, §4.3; paper §IV-B).

#include "lib/view_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "engines/rsm/gather_all_lib.glsl"
#if HAS_LOW_INDIRECT
#include "passes/interpolate.glsl"
#endif

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 uv = gl_FragCoord.xy * view.inverse_resolution;
    float depth = texelFetch(gbuf_depth, pixel, 0).r;
    indirect_diffuse = vec4(0.0);
    if (depth <= 0.0) {
        return;
    }
    vec3 position_ws = position_ws_from_depth(uv, depth);
    vec4 normals = texelFetch(gbuf_normal, pixel, 0);
    vec3 n = octahedral_decode(normals.xy);
    vec3 ng = octahedral_decode(normals.zw);
    vec3 radiance = vec3(0.0);
    bool found = false;
#if HAS_LOW_INDIRECT
    found = interpolated_indirect(position_ws, n, ng, depth, radiance);
#endif
    if (!found) {
        radiance = gather_vpls(position_ws, n, ng, view_direction_ws(uv)).radiance;
    }
#if HAS_AO
    radiance *= texelFetch(ao, pixel, 0).g; // nearer than visibility is tested, or everywhere if it is not
#endif
    indirect_diffuse = vec4(radiance, 1.0);
}
