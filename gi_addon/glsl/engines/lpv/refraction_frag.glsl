// What refracting surfaces show: a refracted ray per pixel, carried through the grid to the wall it meets (the paper's §V sums
// harmonics along the ray refracted once; here both interfaces bend it). Walls are as blurred as a cell; where the ray leaves
// the grid alpha stays 0, and the pixel shows what is straight behind.

#include "lib/view_lib.glsl"
#include "lib/bsdf_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "lib/refraction_lib.glsl"
#include "engines/lpv/geometry_lib.glsl"
#include "engines/lpv/march_lib.glsl"

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float depth = texelFetch(translucent_depth, pixel, 0).r;
    transmission_indirect = vec4(0.0);
    if (depth <= 0.0 || texelFetch(translucent_medium, pixel, 0).g > 0.5) {
        return;
    }
    uint seed = hash_u32(uvec2(pixel + view.pixel_offset));
    vec2 u = fract(sobol_2d(view.subframe, 41u) + unit_shift(seed));
    RefractedRay ray = refracted_ray(pixel, depth, u, 1e-4 * depth);
    if (!ray.passes) {
        return;
    }
    March m = march_walls((ray.position_ws - grid_origin) / grid_cell, ray.direction, 1e9);
    if (m.open_share < 0.5) {
        vec3 radiance = m.radiance / (1.0 - m.open_share); // all of the ray ends on what it met
        transmission_indirect = vec4(radiance * texelFetch(gbuf_transmission, pixel, 0).rgb, 1.0);
    }
}
