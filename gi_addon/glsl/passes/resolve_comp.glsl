// The film: what each pass of the picture adds in this sub-frame.
//
// Light passes hold light × colour; the colours have layers of their own and the division comes at the end
// (gi_addon/outputs.py). Combined is the sum of all of them by construction.

#include "lib/view_lib.glsl"
#include "lib/bsdf_lib.glsl"
#include "generated/world.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void add(int layer, ivec2 pixel, vec4 value)
{
    ivec3 at = ivec3(pixel - view.margin, layer);
    // A number that is not one would stay in the film for good. Nothing upstream should make one; the non-finite scan of
    // the stability suite reads the passes before this point.
    value = mix(value, vec4(0.0), bvec4(!is_finite(value.x), !is_finite(value.y), !is_finite(value.z), !is_finite(value.w)));
    imageStore(film, at, first_subframe == 1 ? value : imageLoad(film, at) + value);
}

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(film).xy))) {
        return;
    }
    pixel += view.margin; // the film holds the picture alone
    vec2 uv = (vec2(pixel) + 0.5) * view.inverse_resolution;
    float depth = 0.0;
    bool held = false;
    bool catcher = false;
#if HAS_GBUF_DEPTH
    depth = texelFetch(gbuf_depth, pixel, 0).r;
    float mark = texelFetch(gbuf_depth, pixel, 0).g;
    held = mark == -1.0;
    catcher = mark == -2.0;
#endif
    bool surface = depth > 0.0 && !catcher;
    bool glass = false;
    // A shadow catcher is not there but for its shadow: over the world, or as the picture's alpha.
    vec3 lit_share = vec3(1.0);
#if HAS_DIRECT_SHADOW
    lit_share = catcher ? texelFetch(direct_shadow, pixel, 0).rgb : lit_share;
#endif

    vec3 diffuse_color = vec3(0.0);
    vec3 diffuse_direct = vec3(0.0);
    vec3 diffuse_indirect = vec3(0.0);
    vec3 glossy_direct = vec3(0.0);
    vec3 glossy_indirect = vec3(0.0);
    vec3 through_direct = vec3(0.0);
    vec3 through_indirect = vec3(0.0);
    vec3 through_color = vec3(0.0);
    vec3 emission = vec3(0.0);
    vec3 environment = vec3(0.0);
    vec3 volume = vec3(0.0);
    vec3 volume_bounced = vec3(0.0);

    if (surface) {
#if HAS_GBUF_DIFFUSE
        diffuse_color = texelFetch(gbuf_diffuse, pixel, 0).rgb;
#endif
#if HAS_DIRECT_DIFFUSE
        diffuse_direct = texelFetch(direct_diffuse, pixel, 0).rgb;
#if HAS_SUBSURFACE_DIRECT
        vec4 below_direct = texelFetch(subsurface_direct, pixel, 0);
        diffuse_direct = mix(diffuse_direct, below_direct.rgb, below_direct.a);
#endif
        diffuse_direct *= diffuse_color;
#endif
#if HAS_INDIRECT_DIFFUSE
        diffuse_indirect = texelFetch(indirect_diffuse, pixel, 0).rgb;
#if HAS_SUBSURFACE_INDIRECT
        vec4 below_indirect = texelFetch(subsurface_indirect, pixel, 0);
        diffuse_indirect = mix(diffuse_indirect, below_indirect.rgb, below_indirect.a);
#endif
        diffuse_indirect *= diffuse_color;
#endif
#if HAS_DIRECT_GLOSSY
        glossy_direct = texelFetch(direct_glossy, pixel, 0).rgb;
#endif
#if HAS_REFLECTED_SOURCES
        glossy_direct += texelFetch(reflected_sources, pixel, 0).rgb;
#endif
#if HAS_INDIRECT_GLOSSY
        glossy_indirect = texelFetch(indirect_glossy, pixel, 0).rgb;
#endif
#if HAS_GBUF_EMISSION
        emission = texelFetch(gbuf_emission, pixel, 0).rgb;
#endif
    } else if (WORLD_VISIBLE != 0) {
        environment = world_radiance(normalize(ray_direction_ws(uv))) * lit_share;
    }
#if HAS_GBUF_TRANSMISSION
    // Behind a refracting surface everything belongs to Transmission: what the technique found along the refracted ray, or
    // what lies straight behind. Direct is what shines by itself (Cycles counts one refraction, then the light).
    vec4 tint = texelFetch(gbuf_transmission, pixel, 0);
    through_color = tint.rgb;
    glass = tint.a < 0.5;
    if (glass) {
        through_direct = (emission + environment) * through_color;
        through_indirect = (diffuse_direct + diffuse_indirect + glossy_direct + glossy_indirect) * through_color;
#if HAS_TRANSMISSION_INDIRECT
        vec4 refracted = texelFetch(transmission_indirect, pixel, 0);
        if (refracted.a > 0.0) {
            through_indirect = refracted.rgb;
            through_direct = vec3(0.0);
        }
#endif
        diffuse_color = diffuse_direct = diffuse_indirect = glossy_direct = glossy_indirect = vec3(0.0);
        emission = environment = vec3(0.0);
#if HAS_TRANSMISSION_DIRECT
        // What scatters light is diffuse to Cycles, and shows nothing of what is straight behind.
        vec4 scattered = texelFetch(transmission_direct, pixel, 0);
        if (scattered.a > 0.0) {
            diffuse_direct = scattered.rgb;
            diffuse_color = through_color;
#if HAS_TRANSMISSION_INDIRECT
            diffuse_indirect = refracted.a > 0.0 ? refracted.rgb : vec3(0.0);
#endif
            through_color = through_direct = through_indirect = vec3(0.0);
        }
#endif
    } else {
        through_color = vec3(0.0);
    }
#endif
    // What is behind a medium or a coloured film arrives dimmed, in every pass, the colours too, as in Cycles.
    vec3 passes = vec3(1.0);
#if HAS_VOLUME_LIGHT
    volume = texelFetch(volume_light, pixel, 0).rgb;
#endif
#if HAS_VOLUME_TRANSMITTANCE
    passes = texelFetch(volume_transmittance, pixel, 0).rgb;
#elif HAS_VOLUME_LIGHT
    passes = vec3(texelFetch(volume_light, pixel, 0).a);
#endif
#if HAS_GBUF_TINT
    passes *= texelFetch(gbuf_tint, pixel, 0).rgb;
#endif
#if HAS_VOLUME_INDIRECT
    volume_bounced = texelFetch(volume_indirect, pixel, 0).rgb;
#endif
    diffuse_color *= passes;
    through_color *= passes;
    diffuse_direct *= passes;
    diffuse_indirect *= passes;
    glossy_direct *= passes;
    glossy_indirect *= passes;
    through_direct *= passes;
    through_indirect *= passes;
    emission *= passes;
    environment *= passes;

#if LAYER_COMBINED >= 0
    // As in Cycles, a transparent film leaves the world out of the picture but not out of its pass.
    vec3 behind = view.film_transparent < 0.5 ? environment : vec3(0.0);
    float alpha = !held && (surface || glass || view.film_transparent < 0.5) ? 1.0 : catcher ? saturate(1.0 - vector_mean(lit_share)) : 0.0;
    add(LAYER_COMBINED, pixel, vec4(diffuse_direct + diffuse_indirect + glossy_direct + glossy_indirect +
                                        through_direct + through_indirect + volume + volume_bounced + emission + behind,
                                    alpha));
#endif
#if LAYER_DEPTH >= 0
    // The first sub-frame's depth, as Cycles keeps its first sample's: a mean of depths is no depth. Nothing is 1e10.
    if (first_subframe == 1) {
        imageStore(film, ivec3(pixel - view.margin, LAYER_DEPTH), vec4(surface ? depth : 1e10));
    }
#endif
#if LAYER_NORMAL >= 0
    vec3 normal_ws = vec3(0.0);
#if HAS_GBUF_NORMAL
    if (surface) {
        normal_ws = octahedral_decode(texelFetch(gbuf_normal, pixel, 0).xy);
    }
#endif
    add(LAYER_NORMAL, pixel, vec4(normal_ws, 1.0));
#endif
#if LAYER_DIFFUSE_DIRECT >= 0
    add(LAYER_DIFFUSE_DIRECT, pixel, vec4(diffuse_direct, 1.0));
#endif
#if LAYER_DIFFUSE_INDIRECT >= 0
    add(LAYER_DIFFUSE_INDIRECT, pixel, vec4(diffuse_indirect, 1.0));
#endif
#if LAYER_DIFFUSE_COLOR >= 0
    add(LAYER_DIFFUSE_COLOR, pixel, vec4(diffuse_color, 1.0));
#endif
#if LAYER_GLOSSY_DIRECT >= 0
    add(LAYER_GLOSSY_DIRECT, pixel, vec4(glossy_direct, 1.0));
#endif
#if LAYER_GLOSSY_INDIRECT >= 0
    add(LAYER_GLOSSY_INDIRECT, pixel, vec4(glossy_indirect, 1.0));
#endif
#if LAYER_GLOSSY_COLOR >= 0
    vec3 glossy_color = vec3(0.0);
#if HAS_GBUF_SPECULAR && HAS_GBUF_LOBE && HAS_BRDF_ALBEDO
    if (surface) {
        Lobe lobe = lobe_unpack(texelFetch(gbuf_specular, pixel, 0), texelFetch(gbuf_lobe, pixel, 0));
        vec3 n = octahedral_decode(texelFetch(gbuf_normal, pixel, 0).xy);
        float cos_v = saturate(abs(dot(n, view_direction_ws(uv))));
        glossy_color = lobe_albedo(brdf_albedo, brdf_average, brdf_energy, lobe, cos_v) * passes;
    }
#endif
    add(LAYER_GLOSSY_COLOR, pixel, vec4(glossy_color, 1.0));
#endif
#if LAYER_TRANSMISSION_DIRECT >= 0
    add(LAYER_TRANSMISSION_DIRECT, pixel, vec4(through_direct, 1.0));
#endif
#if LAYER_TRANSMISSION_INDIRECT >= 0
    add(LAYER_TRANSMISSION_INDIRECT, pixel, vec4(through_indirect, 1.0));
#endif
#if LAYER_TRANSMISSION_COLOR >= 0
    add(LAYER_TRANSMISSION_COLOR, pixel, vec4(through_color, 1.0));
#endif
#if LAYER_VOLUME_DIRECT >= 0
    add(LAYER_VOLUME_DIRECT, pixel, vec4(volume, 1.0));
#endif
#if LAYER_VOLUME_INDIRECT >= 0
    add(LAYER_VOLUME_INDIRECT, pixel, vec4(volume_bounced, 1.0));
#endif
#if LAYER_EMISSION >= 0
    add(LAYER_EMISSION, pixel, vec4(emission, 1.0));
#endif
#if LAYER_ENVIRONMENT >= 0
    add(LAYER_ENVIRONMENT, pixel, vec4(environment, 1.0));
#endif
#if LAYER_AO >= 0
    float occlusion = 0.0;
#if HAS_AO
    occlusion = texelFetch(ao, pixel, 0).r;
#endif
    add(LAYER_AO, pixel, vec4(vec3(occlusion), 1.0));
#endif
#if LAYER_SHADOW >= 0
    vec3 shadow = vec3(surface ? 0.0 : 1.0);
#if HAS_DIRECT_SHADOW
    shadow = texelFetch(direct_shadow, pixel, 0).rgb;
#endif
    add(LAYER_SHADOW, pixel, vec4(shadow, 1.0));
#endif
}
