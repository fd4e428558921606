// The colour of light that has come through coloured see-through surfaces. Included where HAS_SHADOW_TINT says whether there
// are any; after shadow_lib.glsl.

#if HAS_SHADOW_TINT
// One texel's tint, for a point at `depth`: 1 for what is nearer to the light than the surfaces that tint.
vec3 tint_texel(ivec2 texel, float depth, float width)
{
    vec4 tint = texelFetch(shadow_tint, texel, 0);
    return depth > tint.a + width ? tint.rgb : vec3(1.0);
}
#endif

// Share of a light that what it passes on its way to a point leaves, by channel, where any arrives; bilinear over the map.
vec3 light_tint(Light light, vec3 position_ws)
{
#if HAS_SHADOW_TINT
    if (light.views > 0) {
        LightView v = light_views[light_view_of(light, position_ws)];
        vec3 p = light_view_project(v, position_ws);
        vec2 unit = p.xy / v.guard;
        if (v.map == MAP_SHADOW && all(lessThanEqual(abs(unit), vec2(1.0))) && p.z > v.near) {
            vec2 low = v.rect.xy;
            vec2 high = v.rect.xy + v.rect.zw - 1.0;
            vec2 at = v.rect.xy + (unit * 0.5 + 0.5) * v.rect.zw - 0.5;
            vec2 base = floor(at);
            vec2 f = at - base;
            // Depths are halves: 11 bits.
            float width = light_view_texel_width(v, p.z) + p.z / 1024.0;
            vec3 a = tint_texel(ivec2(clamp(base, low, high)), p.z, width);
            vec3 b = tint_texel(ivec2(clamp(base + vec2(1.0, 0.0), low, high)), p.z, width);
            vec3 c = tint_texel(ivec2(clamp(base + vec2(0.0, 1.0), low, high)), p.z, width);
            vec3 d = tint_texel(ivec2(clamp(base + 1.0, low, high)), p.z, width);
            return mix(mix(a, b, f.x), mix(c, d, f.x), f.y);
        }
    }
#endif
    return vec3(1.0);
}
