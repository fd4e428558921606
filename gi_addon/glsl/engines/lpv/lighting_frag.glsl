// Indirect light of every pixel from the volume: one look-up half a cell in front of the surface (lookup_lib.glsl).

#include "lib/view_lib.glsl"
#include "engines/lpv/lookup_lib.glsl"

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 uv = gl_FragCoord.xy * view.inverse_resolution;
    float depth = texelFetch(gbuf_depth, pixel, 0).r;
    indirect_diffuse = vec4(0.0);
    if (depth <= 0.0) {
        return;
    }
    vec4 normals = texelFetch(gbuf_normal, pixel, 0);
    vec3 light = volume_light(position_ws_from_depth(uv, depth), octahedral_decode(normals.zw), view_direction_ws(uv),
                              octahedral_decode(normals.xy));
    indirect_diffuse = vec4(light, 1.0);
}
