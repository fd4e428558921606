// Shadow map: depth along the view's axis, linear, world units, 32 bit, whatever the depth buffer holds. Only materials
// that let light through are evaluated.

#if SURFACE_FULL
#include "surface/surface_point.glsl"
#else
in vec3 vary_position_ws;
#endif

void main()
{
#if SURFACE_FULL
    vec3 to_light = light_perspective > 0.5 ? normalize(light_origin_ws - vary_position_ws) : -light_axis_ws;
    if (!surface_is_there(surface_opacity(surface_closure(surface_point(to_light))), 1u)) {
        discard;
    }
#endif
    shadow_depth = dot(vary_position_ws - light_origin_ws, light_axis_ws);
}
