// Indirect light per pixel: interpolated from the low resolution where that holds the pixel's surface, by cones of its
// own where it does not (paper §IV-B, §IV-D).

#include "lib/view_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "engines/vct/diffuse_lib.glsl"
#if HAS_LOW_INDIRECT
#include "passes/interpolate.glsl"
#endif

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float depth = texelFetch(gbuf_depth, pixel, 0).r;
    indirect_diffuse = vec4(0.0);
    if (depth <= 0.0) {
        return;
    }
    vec3 position_ws = position_ws_from_depth(gl_FragCoord.xy * view.inverse_resolution, depth);
    vec4 normals = texelFetch(gbuf_normal, pixel, 0);
    vec3 n = octahedral_decode(normals.xy);
    vec3 ng = octahedral_decode(normals.zw);
    vec3 radiance = vec3(0.0);
    bool found = false;
#if HAS_LOW_INDIRECT
    found = interpolated_indirect(position_ws, n, ng, depth, radiance);
#endif
    if (!found) {
        radiance = gather_cones(position_ws, n, ng).radiance;
    }
    indirect_diffuse = vec4(radiance, 1.0);
}
