// The world's radiance over equirectangular directions, each texel the mean of 4 × 4 points: W/(m²·sr).

#include "lib/view_lib.glsl"
#include "lib/math_lib.glsl"
#include "generated/world.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    vec2 size = vec2(imageSize(world_map));
    vec3 sum = vec3(0.0);
    for (int k = 0; k < 16; ++k) {
        vec2 uv = (vec2(pixel) + (vec2(k & 3, k >> 2) + 0.5) / 4.0) / size;
        // The inverse of node_equirect (nodes/texture.glsl).
        float phi = TAU * (0.5 - uv.x);
        float theta = PI * (uv.y - 0.5);
        vec3 radiance = world_radiance(vec3(cos(theta) * cos(phi), cos(theta) * sin(phi), sin(theta)));
        sum += is_finite(radiance) ? max(radiance, vec3(0.0)) : vec3(0.0);
    }
    imageStore(world_map, pixel, vec4(sum / 16.0, 1.0));
}
