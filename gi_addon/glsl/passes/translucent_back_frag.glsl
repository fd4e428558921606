// The farthest refracting surface of each pixel: where a refracted ray leaves.

#define translucent_depth translucent_back_depth
#define translucent_normal translucent_back_normal
#define HAS_TRANSLUCENT_DEPTH 1
#define HAS_TRANSLUCENT_NORMAL 1
#define HAS_TRANSLUCENT_COLOR 0
#define HAS_TRANSLUCENT_MEDIUM 0
#include "passes/translucent_frag.glsl"
