// View depth of the farthest surface that light scatters below: the far side of what the G-buffer shows the near side of.

#include "surface/surface_point.glsl"

void main()
{
    float depth = view_depth(vary_position_ws);
    Closure c = surface_closure(surface_point(view_direction_ws(gl_FragCoord.xy * view.inverse_resolution)));
    if (depth < view.clip_start || depth > view.clip_end || max3(c.subsurface) <= 0.0) {
        discard;
    }
    subsurface_back = depth;
}
