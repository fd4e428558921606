// Shadows by rays through the depth buffer (the paper's §V-D, after Ritschel et al.): over the shadow map for what is nearer
// than its texels resolve, or in its place. Included where `ssdo_planes` and the uniforms are declared.

#include "engines/ssdo/march_lib.glsl"

// 1 where nothing on the screen lies between a point and its light, within `ssdo_shadow_reach`.
float screen_visibility(Light light, vec3 position_ws, vec3 l, float jitter)
{
    if ((light.flags & LIGHT_FLAG_SHADOW) == 0) {
        return 1.0;
    }
    float reach = light_distance(light, position_ws);
    reach = min(reach, ssdo_shadow_reach);
    return march(position_ws, l, reach, ssdo_shadow_steps, ssdo_thickness, jitter).found ? 0.0 : 1.0;
}
