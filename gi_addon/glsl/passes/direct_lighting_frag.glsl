// Direct light: Lambert and GGX (lib/bsdf_lib.glsl) under every light's point of this sub-frame, through its shadow map.
//
// direct_diffuse is E/π, W/(m²·sr): Cycles' Diffuse Direct, without the surface's colour.
// direct_glossy is ∫ L f cosθ dω of the glossy lobe, with its colour. A light's point stands for a patch of its source;
// the lobe is widened by that patch, so that highlights of large lights are smooth at any number of sub-frames.

#include "lib/view_lib.glsl"
#include "lib/bsdf_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "lib/lamps_lib.glsl"
#if HAS_SSDO_PLANES
#include "engines/ssdo/shadow_lib.glsl"
#endif

// GGX alpha after convolution with a uniform disc of angular radius θ: the half vector turns half as far as the light,
// whose variance per axis is θ²/4, so slopes gain θ²/16; α² is twice the slopes' variance (Beckmann's relation).
float widened_alpha(float alpha, float angle) { return min(sqrt(alpha * alpha + angle * angle / 8.0), 1.0); }

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 uv = gl_FragCoord.xy * view.inverse_resolution;
    vec2 depth_bulge = max(texelFetch(gbuf_depth, pixel, 0).rg, 0.0); // below 0 are marks
    float depth = depth_bulge.r;
    float turn = shadow_turn(pixel);
    vec3 diffuse = vec3(0.0);
    vec3 glossy = vec3(0.0);
    vec3 open_light = vec3(0.0);
    vec3 lit_light = vec3(0.0);
    if (depth > 0.0) {
        vec3 position_ws = position_ws_from_depth(uv, depth);
        vec4 normals = texelFetch(gbuf_normal, pixel, 0);
        vec3 n = octahedral_decode(normals.xy);
        vec3 ng = octahedral_decode(normals.zw);
        vec3 v = view_direction_ws(uv);
#if HAS_DIRECT_GLOSSY
        Lobe lobe = lobe_unpack(texelFetch(gbuf_specular, pixel, 0), texelFetch(gbuf_lobe, pixel, 0));
        float alpha = max(sqr(lobe.roughness), ALPHA_MIN);
        bool has_lobe = lobe_reflects(lobe);
        vec3 gain = has_lobe ? multiscatter_gain(brdf_energy, brdf_average, lobe, saturate(abs(dot(n, v)))) : vec3(0.0);
#endif
#if HAS_GBUF_SET
        uint lit_with = set_at(gbuf_set, pixel);
#else
        uint lit_with = 0u;
#endif
        for (int i = 0; i < light_count; ++i) {
            Light light = lights[i];
            LampLight lamp = lamp_light(light, position_ws, n, ng, depth_bulge.g);
            if (lamp.cosine <= 0.0 || !lamp_lights(light, lit_with)) {
                continue;
            }
            vec3 l = lamp.direction;
            vec3 arriving = lamp.arriving;
            float visible = 1.0;
#if HAS_SHADOW_CONES
            visible = texelFetch(shadow_cones, ivec3(pixel, i), 0).r;
#else
            visible = light_share(light, lamp.receiver_ws, lamp.receiver_ng, softness, turn);
#endif
#if HAS_MEDIUM
            arriving *= medium_transmittance(position_ws, l, light_distance(light, position_ws));
#endif
#if HAS_SSDO_PLANES
            if (visible > 0.0) {
                visible *= screen_visibility(light, lamp.receiver_ws, l, fract(turn * 0.159154943 + 0.618034 * float(i))); // 1/2π
            }
#endif
            open_light += arriving * lamp.cosine * light.diffuse;
            arriving *= light_tint(light, position_ws);
            vec3 irradiance = arriving * lamp.cosine;
            lit_light += irradiance * visible * light.diffuse;
#if HAS_DIRECT_GLOSSY
            if (has_lobe && visible > 0.0) {
                glossy += light.glossy * arriving * visible * gain * ggx_eval(lobe, widened_alpha(alpha, lamp.angle), n, v, l);
            }
#endif
        }
#if HAS_WORLD_DIFFERENCE
        lit_light += PI * texelFetch(world_difference, pixel, 0).rgb;
#endif
#if HAS_SCREEN_LIGHT
        // The world and emissive pixels, where screen space gathers them; of that only what arrives is known.
        vec3 gathered = PI * texelFetch(screen_light, pixel, 0).rgb;
        lit_light += gathered;
        open_light += gathered;
#endif
        diffuse = lit_light * INV_PI;
    }
#if HAS_DIRECT_DIFFUSE
    direct_diffuse = vec4(diffuse, 1.0);
#endif
#if HAS_DIRECT_GLOSSY
    direct_glossy = vec4(glossy, 1.0);
#endif
#if HAS_DIRECT_SHADOW
    float open_luminance = luminance(open_light);
    vec3 share = open_luminance > 0.0 ? lit_light / max(open_light, vec3(1e-6 * open_luminance)) : vec3(1.0);
    direct_shadow = vec4(depth > 0.0 ? share : vec3(1.0), 1.0);
#endif
}
