// Reflective shadow map: depth, normals, and the share of the arriving light that is reflected, averaged over all sides:
// C. Dachsbacher and M. Stamminger, "Reflective Shadow Maps", I3D 2005. A texel's flux is its share of the light's power
// × that albedo (engines/rsm/rsm_lib.glsl). Depth as in shadow_map_frag.glsl.

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
#if HAS_RSM_NORMAL
    rsm_normal = vec4(octahedral_encode(n), octahedral_encode(p.geometric_normal_ws));
#endif
#if HAS_RSM_ALBEDO
    vec3 albedo = c.diffuse;
#if SURFACE_TABLES > 0
    albedo += lobe_albedo(brdf_albedo, brdf_average, brdf_energy, closure_lobe(c), saturate(dot(n, to_light)));
#endif
    rsm_albedo = vec4(albedo * gain, 1.0);
#endif
#if HAS_RSM_DEPTH
    rsm_depth = dot(vary_position_ws - light_origin_ws, light_axis_ws);
#endif
}
