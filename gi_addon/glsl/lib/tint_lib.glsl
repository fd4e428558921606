// The colour of light that has come through coloured see-through surfaces. Included where HAS_SHADOW_TINT says whether there
// are any; after shadow_lib.glsl.

#if HAS_SHADOW_TINT
// One texel's tint, for a point at `depth`, and whether light comes as far there: 1 for what is nearer to the light than the
// surfaces that tint.
vec4 tint_texel(ivec2 texel, float depth, float width)
{
    vec4 tint = texelFetch(shadow_tint, texel, 0);
    float lit = texelFetch(shadow_depth, texel, 0).r >= depth - width ? 1.0 : 0.0;
    return vec4(depth > tint.a + width ? tint.rgb * lit : vec3(lit), lit);
}
#endif

// Share of a light that what it passes on its way to a point leaves, by channel, where any arrives: the
// mean over the texels that show the point lit, by their nearness.
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
            // All four texels around the point may show the share of a film that stops the light: the next ones tell then,
            // by a weight that is nothing beside those of the four.
            vec4 sum = vec4(0.0);
            for (int y = -1; y <= 2; ++y) {
                for (int x = -1; x <= 2; ++x) {
                    vec2 near = max(1.0 - abs(vec2(x, y) - f), 1e-3);
                    vec4 texel = tint_texel(ivec2(clamp(base + vec2(x, y), low, high)), p.z, width);
                    sum += texel * (near.x * near.y);
                }
            }
            return sum.a > 0.0 ? sum.rgb / sum.a : vec3(1.0);
        }
    }
#endif
    return vec3(1.0);
}
