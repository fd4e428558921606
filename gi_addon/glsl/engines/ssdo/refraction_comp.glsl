// What refracting surfaces show: a ray refracted where it enters and where it leaves, then traced through the opaque G-buffer,
// which sees through such surfaces (the paper's §IV-B). A rough surface bends each sub-frame's ray by another of its visible
// normals. Where the ray finds nothing on the screen, what is straight behind shows.

#include "engines/ssdo/trace_lib.glsl"
#include "engines/ssdo/met_lib.glsl"
#include "lib/bsdf_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "lib/refraction_lib.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, textureSize(translucent_depth, 0)))) {
        return;
    }
    vec4 seen = vec4(0.0);
    float depth = texelFetch(translucent_depth, pixel, 0).r;
    if (depth > 0.0 && texelFetch(translucent_medium, pixel, 0).g < 0.5) {
        uint seed = hash_u32(uvec2(pixel + view.pixel_offset));
        vec2 u = fract(sobol_2d(view.subframe, 44u) + unit_shift(seed));
        RefractedRay ray = refracted_ray(pixel, depth, u, pixel_width(depth));
        if (ray.passes) {
            Traced hit = trace(ray.position_ws, ray.direction, 2.0 * view.scene_radius, ssdo_thickness);
            if (hit.found && met_front(hit, screen_from_ws(ray.position_ws))) {
                vec3 radiance = met_light(hit);
#if HAS_GBUF_EMISSION
                radiance += hit.hidden ? vec3(0.0) : texelFetch(gbuf_emission, hit.pixel, 0).rgb;
#endif
                seen = vec4(radiance * texelFetch(gbuf_transmission, pixel, 0).rgb, 1.0);
            }
        }
    }
    imageStore(transmission_indirect, pixel, seen);
}
