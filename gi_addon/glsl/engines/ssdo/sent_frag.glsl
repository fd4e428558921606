// Radiance that each pixel's surface sends on, W/(m²·sr): what arrives, E/π, × albedo. The glossy lobe's share goes with it, as
// if it too were spread over all sides: what is taken as a source of light has no lobe (rsm_frag.glsl does the same).

#include "lib/view_lib.glsl"
#include "lib/bsdf_lib.glsl"
#include "engines/ssdo/layer_lib.glsl"

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec3 arriving = vec3(0.0);
#if HAS_DIRECT_DIFFUSE
    arriving += texelFetch(direct_diffuse, pixel, 0).rgb;
#endif
#if HAS_LAST_BOUNCE
    arriving += texelFetch(last_bounce, pixel, 0).rgb;
#endif
    vec3 albedo = texelFetch(gbuf_diffuse, pixel, 0).rgb;
#if HAS_GBUF_SPECULAR && HAS_GBUF_LOBE && HAS_BRDF_AVERAGE && HAS_BRDF_ENERGY
    Lobe lobe = lobe_unpack(texelFetch(gbuf_specular, pixel, 0), texelFetch(gbuf_lobe, pixel, 0));
    if (lobe_reflects(lobe)) {
        albedo += lobe_albedo_average(brdf_average, brdf_energy, lobe);
    }
#endif
    SENT_LIGHT = vec4(arriving * albedo, 1.0);
}
