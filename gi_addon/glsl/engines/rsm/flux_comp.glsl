// Luminance of each texel's reflected flux (W): what samples are drawn by.

#include "engines/rsm/rsm_lib.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main()
{
    vec4 rect = rsm_views[tile].rect;
    if (any(greaterThanEqual(vec2(gl_GlobalInvocationID.xy), rect.zw))) {
        return;
    }
    ivec2 pixel = ivec2(rect.xy) + ivec2(gl_GlobalInvocationID.xy);
    RsmTexel t = rsm_texel(tile, pixel);
    float flux = luminance(t.flux);
    imageStore(rsm_flux, pixel, vec4(is_finite(flux) ? flux : 0.0));
}
