// Radiance that leaves each pixel's surface towards the eye, W/(m²·sr): what reflections and refractions show of it. A glossy
// surface shows them its highlight as the eye sees it, for want of another.

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec3 radiance = vec3(0.0);
#if HAS_GBUF_DIFFUSE
    vec3 arriving = vec3(0.0);
#if HAS_DIRECT_DIFFUSE
    arriving += texelFetch(direct_diffuse, pixel, 0).rgb;
#endif
#if HAS_INDIRECT_DIFFUSE
    arriving += texelFetch(indirect_diffuse, pixel, 0).rgb;
#endif
    radiance += arriving * texelFetch(gbuf_diffuse, pixel, 0).rgb;
#endif
#if HAS_DIRECT_GLOSSY
    radiance += texelFetch(direct_glossy, pixel, 0).rgb;
#endif
    ssdo_shaded = vec4(radiance, 1.0);
}
