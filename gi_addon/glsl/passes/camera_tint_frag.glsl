// Coloured transparent surfaces in front of the opaque G-buffer, in the sub-frames that look through them: what passes, over
// what passes of the brightest channel, which is the share of those sub-frames (surface_opacity). Each multiplies what is
// behind it.

#include "surface/surface_point.glsl"

void main()
{
    float depth = view_depth(vary_position_ws);
    Closure c = surface_closure(surface_point(view_direction_ws(gl_FragCoord.xy * view.inverse_resolution)));
    float opaque = texelFetch(gbuf_depth, ivec2(gl_FragCoord.xy), 0).r;
    float share = max3(c.transparent);
    if (depth < view.clip_start || depth > view.clip_end || (opaque > 0.0 && depth >= opaque) || share <= 0.0) {
        discard;
    }
    float opacity = surface_opacity(c);
    if (opacity > 0.0 && surface_is_there(opacity, 0u)) {
        discard;
    }
    // What also refracts has its tint there.
    gbuf_tint = vec4(max3(c.transmission + c.translucent) > 0.0 ? vec3(1.0) : c.transparent / share, 1.0);
}
