// What coloured see-through surfaces leave of a light, by channel, over what they leave of the brightest one: that one is the
// share of the texels and sub-frames in which the light passes at all (surface_opacity). Multiplied over all such surfaces
// before the map's first solid one. Of shadow maps the alpha is the surface's depth, and the least is kept.

#include "surface/surface_point.glsl"

void main()
{
    vec3 to_light = light_perspective > 0.5 ? normalize(light_origin_ws - vary_position_ws) : -light_axis_ws;
    Closure c = surface_closure(surface_point(to_light));
    vec3 through = c.transparent + c.transmission;
    float share = max3(through);
    float depth = dot(vary_position_ws - light_origin_ws, light_axis_ws);
#if HAS_SHADOW_DEPTH
    if (depth >= texelFetch(shadow_depth, ivec2(gl_FragCoord.xy), 0).r) {
        discard;
    }
#endif
    if (share <= 0.0) {
        discard;
    }
#if HAS_SHADOW_TINT
    shadow_tint = vec4(through / share, depth);
#else
    rsm_albedo = vec4(through / share, 1.0);
#endif
}
