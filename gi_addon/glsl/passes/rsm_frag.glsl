// Reflective shadow map: depth, normals, and the share of the arriving light that is reflected, averaged over all sides:
// C. Dachsbacher and M. Stamminger, "Reflective Shadow Maps", I3D 2005. A texel's flux is its share of the light's power
// × that albedo (engines/rsm/rsm_lib.glsl). Normals point to the side that the light leaves by: away from the light where it
// shines through. Depth as in shadow_map_frag.glsl.

#include "surface/surface_point.glsl"

void main()
{
    vec3 to_light = light_perspective > 0.5 ? normalize(light_origin_ws - vary_position_ws) : -light_axis_ws;
    SurfacePoint p = surface_point(to_light);
    Closure c = surface_closure(p);
    float opacity = surface_opacity(c);
#if SURFACE_TRANSPARENT
    if (!surface_is_there(opacity, 1u)) {
        discard;
    }
#endif
    float gain = opacity > 0.0 ? 1.0 / opacity : 1.0;
    vec3 n = safe_normalize(c.normal_ws);
    n = dot(n, n) < 0.5 ? p.normal_ws : n;
    vec3 ng = p.geometric_normal_ws;
    vec3 albedo = c.diffuse;
#if SURFACE_TABLES > 0
    albedo += lobe_albedo(brdf_albedo, brdf_average, brdf_energy, closure_lobe(c), saturate(dot(n, to_light)));
#endif
    // What goes through to the far side leaves there: a texel stands for one of the sides, by their shares, for both.
    float through = luminance(c.translucent);
    if (through > 0.0) {
        float share = through / (through + luminance(albedo));
        bool far = unit_float(hash_u32(uvec3(uvec2(gl_FragCoord.xy), 3u))) < share;
        albedo = far ? c.translucent / share : albedo / (1.0 - share);
        n = far ? -n : n;
        ng = far ? -ng : ng;
    }
#if HAS_RSM_NORMAL
    rsm_normal = vec4(octahedral_encode(n), octahedral_encode(ng));
#endif
#if HAS_RSM_ALBEDO
    rsm_albedo = vec4(albedo * gain * light_reaches, 1.0); // light linking: it may only be in the way
#endif
#if HAS_RSM_DEPTH
    rsm_depth = dot(vary_position_ws - light_origin_ws, light_axis_ws);
#endif
}
