// What a ray through the depth buffer met: which side of it, and the light that leaves it. Included after trace_lib.glsl.

#include "lib/sequence_lib.glsl"
#if LAMPS_AT_HITS
#include "lib/lamps_lib.glsl"
#endif

// Whether what was met shows its front to a point of screen coordinates `from`.
bool met_front(Traced hit, vec3 from)
{
    vec4 plane = texelFetch(ssdo_planes, hit.pixel, 0);
#if HAS_SSDO_PLANES_2
    plane = hit.hidden ? texelFetch(ssdo_planes_2, hit.pixel, 0) : plane;
#endif
    return faces(plane, hit.pixel, from);
}

// Radiance that leaves it, without its emission, W/(m²·sr).
vec3 met_light(Traced hit)
{
    if (hit.hidden) {
#if HAS_SSDO_LAYER2_SENT
        return texelFetch(ssdo_layer2_sent, hit.pixel, 0).rgb;
#else
        return vec3(0.0);
#endif
    }
    vec3 radiance = texelFetch(ssdo_shaded, hit.pixel, 0).rgb;
#if LAMPS_AT_HITS
    // A pixel is lit at its middle, up to half a pixel from the hit, and shadows' edges lie as far off: what lamps send to the
    // middle is exchanged for what they send to the hit. (Light read between the middles, bilinear, was worse: a mirror's relMSE .32
    // beside .29.)
    vec2 depth_bulge = max(texelFetch(gbuf_depth, hit.pixel, 0).rg, 0.0);
    vec4 normals = texelFetch(gbuf_normal, hit.pixel, 0);
    vec3 n = octahedral_decode(normals.xy);
    vec3 ng = octahedral_decode(normals.zw);
    uint lit_with = 0u;
#if HAS_GBUF_SET
    lit_with = set_at(gbuf_set, hit.pixel);
#endif
    float turn = shadow_turn(hit.pixel);
    vec4 plane = texelFetch(ssdo_planes, hit.pixel, 0);
    vec3 at_ws = ws_from_screen(vec3(hit.at, plane_near(plane, hit.pixel, hit.at)));
    vec3 middle_ws = position_ws_from_depth((vec2(hit.pixel) + 0.5) * view.inverse_resolution, depth_bulge.r);
    vec3 more = lamps_irradiance(at_ws, n, ng, depth_bulge.g, lit_with, turn)
              - lamps_irradiance(middle_ws, n, ng, depth_bulge.g, lit_with, turn);
    radiance = max(radiance + texelFetch(gbuf_diffuse, hit.pixel, 0).rgb * more * INV_PI, 0.0);
#endif
    return radiance;
}
