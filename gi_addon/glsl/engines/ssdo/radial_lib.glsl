// How much of a light gets to a pixel's air, by the paper's screen-space mode: K. Mitchell, "Volumetric Light Scattering as a
// Post-Process", GPU Gems 3, 2007, ch. 13. The share of the pixels between this one and the light's place on the screen that
// do not hide the light. Mitchell's exposure, decay and weight are left out: scattering and extinction are the medium's
// (volumetric_frag.glsl), this is their visibility. A light that is not on the screen gives nothing.

const int RADIAL_SAMPLES = 32;

float radial_visibility(Light light, float offset)
{
    vec4 place = light_is_directional(light) ? vec4(-light.axis_ws, 0.0) : vec4(light.position_ws, 1.0);
    vec4 clip = view.clip_from_world * place;
    vec2 to = clip.xy / max(clip.w, 1e-20) * 0.5 + 0.5;
    if (clip.w <= 0.0 || any(lessThan(to, vec2(0.0))) || any(greaterThan(to, vec2(1.0)))) {
        return 0.0;
    }
    float light_depth = light_is_directional(light) ? 1e30 : view_depth(light.position_ws);
    vec2 from = gl_FragCoord.xy * view.inverse_resolution;
    float open_count = 0.0;
    for (int k = 0; k < RADIAL_SAMPLES; ++k) {
        vec2 p = mix(from, to, (float(k) + offset) / float(RADIAL_SAMPLES));
        float depth = texelFetch(gbuf_depth, ivec2(min(p, vec2(0.99999)) * view.resolution), 0).r;
        open_count += depth <= 0.0 || depth >= light_depth ? 1.0 : 0.0;
    }
    return open_count / float(RADIAL_SAMPLES);
}
