// Radiance that leaves each pixel's surface after diffuse reflection, W/(m²·sr): what arrives, E/π, × albedo.

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
    ssdo_sent = vec4(arriving * texelFetch(gbuf_diffuse, pixel, 0).rgb, 1.0);
}
