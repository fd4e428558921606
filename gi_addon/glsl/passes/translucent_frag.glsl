// Refracting surfaces in front of the opaque G-buffer. A surface that refracts a share t of the light is there in a share t
// of the sub-frames: those in which the opaque G-buffer looks through it (the same threshold, surface_is_there).

#include "surface/surface_point.glsl"

void main()
{
    float depth = view_depth(vary_position_ws);
    vec2 uv = gl_FragCoord.xy * view.inverse_resolution;
    SurfacePoint p = surface_point(view_direction_ws(uv));
    Closure c = surface_closure(p);
    float opaque = texelFetch(gbuf_depth, ivec2(gl_FragCoord.xy), 0).r;
    float through = vector_mean(c.transmission) + vector_mean(c.translucent);
    if (depth < view.clip_start || depth > view.clip_end || (opaque > 0.0 && depth >= opaque) || through <= 0.0) {
        discard;
    }
    // The part that the opaque G-buffer drew in this sub-frame is not refracted in it.
    float opacity = surface_opacity(c);
    if (opacity > 0.0 && surface_is_there(opacity, 0u)) {
        discard;
    }
    // The chosen share is seen whole: its tint is that of what passes, not of how much does.
    float share = max(1.0 - opacity - max3(c.transparent), 1e-4);
    vec3 color = (c.transmission + c.translucent) / share;
#if TINT_ONLY
    gbuf_transmission = vec4(color, 0.0); // alpha says that there is one: clear glass has tint 1
#else
    vec3 n = safe_normalize(c.normal_ws);
    n = dot(n, n) < 0.5 ? p.normal_ws : n;
    float weight = luminance(c.transmission);
    float eta = weight > 0.0 ? max(c.transmission_eta / weight, 1e-3) : 1.0;
#if HAS_TRANSLUCENT_BACK_DEPTH
    translucent_back_depth = depth;
#endif
#if HAS_TRANSLUCENT_BACK_NORMAL
    translucent_back_normal = vec4(octahedral_encode(n), octahedral_encode(p.geometric_normal_ws));
#endif
#if HAS_TRANSLUCENT_SET
    translucent_set = object_set;
#endif
#if HAS_TRANSLUCENT_DEPTH
    translucent_depth = depth;
#endif
#if HAS_TRANSLUCENT_NORMAL
    translucent_normal = vec4(octahedral_encode(n), octahedral_encode(p.geometric_normal_ws));
#endif
#if HAS_TRANSLUCENT_COLOR
    translucent_color = vec4(color, weight > 0.0 ? c.transmission_roughness / weight : 1.0);
#endif
#if HAS_TRANSLUCENT_MEDIUM
    translucent_medium = vec2(p.backfacing > 0.5 ? 1.0 / eta : eta, vector_mean(c.translucent) > weight ? 1.0 : 0.0);
#endif
#endif
}
