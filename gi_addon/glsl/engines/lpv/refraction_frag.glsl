// What refracting surfaces show: RSM's refracted ray, with bounces from the volume (bounces_lib.glsl). (The paper's §V sums the
// volume's harmonics along the ray refracted once; glossy_frag.glsl says why they are not looked at.)

#define RAY_BOUNCES 1
#include "engines/rsm/refraction_frag.glsl"
#include "engines/lpv/bounces_lib.glsl"
