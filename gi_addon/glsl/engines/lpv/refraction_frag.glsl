// What refracting surfaces show: RSM's refracted ray, with bounces from the volume (bounces_lib.glsl), and what scatters light on
// the volume's of its far side. (The paper's §V sums the
// volume's harmonics along the ray refracted once; glossy_frag.glsl says why they are not looked at.)

#define RAY_BOUNCES 1
#include "engines/rsm/refraction_frag.glsl"
#include "engines/lpv/bounces_lib.glsl"

vec3 far_side_light(vec3 position_ws, vec3 ng, vec3 n, vec3 eye) { return volume_light(position_ws, ng, eye, n); }
