// View depth and normal of the farthest surface that light scatters below: the far side of what the G-buffer shows the near side of.

#include "surface/surface_point.glsl"

void main()
{
    float depth = view_depth(vary_position_ws);
    SurfacePoint p = surface_point(view_direction_ws(gl_FragCoord.xy * view.inverse_resolution));
    Closure c = surface_closure(p);
    if (depth < view.clip_start || depth > view.clip_end || max3(c.subsurface) <= 0.0) {
        discard;
    }
    subsurface_back = depth;
    subsurface_back_normal = octahedral_encode(p.geometric_normal_ws);
}
