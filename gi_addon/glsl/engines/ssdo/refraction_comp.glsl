// What refracting surfaces show: a ray refracted where it enters and where it leaves (C. Wyman, "An Approximate Image-Space
// Approach for Interactive Refraction", SIGGRAPH 2005: the way inside is as long as the object is deep along the view ray),
// then traced through the opaque G-buffer, which sees through such surfaces (the paper's §IV-B). A rough surface bends each
// sub-frame's ray by another of its visible normals. Where the ray finds nothing on the screen, what is straight behind shows.

#include "engines/ssdo/trace_lib.glsl"
#include "lib/bsdf_lib.glsl"
#include "lib/sequence_lib.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, textureSize(translucent_depth, 0)))) {
        return;
    }
    vec2 uv = (vec2(pixel) + 0.5) * view.inverse_resolution;
    vec4 seen = vec4(0.0);
    float depth = texelFetch(translucent_depth, pixel, 0).r;
    vec2 medium = texelFetch(translucent_medium, pixel, 0).rg;
    if (depth > 0.0 && medium.y < 0.5) {
        vec4 normals = texelFetch(translucent_normal, pixel, 0);
        vec3 n = octahedral_decode(normals.xy);
        vec3 eye = view_direction_ws(uv);
        mat3 frame = frame_from_normal(n);
        vec3 v = eye * frame;
        v = normalize(vec3(v.xy, max(v.z, 1e-3)));
        float alpha = max(sqr(texelFetch(translucent_color, pixel, 0).a), ALPHA_MIN);
        uint seed = hash_u32(uvec2(pixel + view.pixel_offset));
        vec2 u = fract(sobol_2d(view.subframe, 44u) + vec2(unit_float(seed), unit_float(hash_u32(seed))));
        vec3 direction = refract(-eye, frame * ggx_sample_visible_normal(v, alpha, u), 1.0 / medium.x);
        bool passes = dot(direction, direction) > 0.5 && dot(direction, octahedral_decode(normals.zw)) < 0.0;
        vec3 position_ws = position_ws_from_depth(uv, depth);
        float way_inside = (texelFetch(translucent_back_depth, pixel, 0).r - depth) * length(ray_direction_ws(uv));
        if (passes && way_inside > pixel_width(depth)) {
            position_ws += direction * way_inside;
            ivec2 there = clamp(ivec2(screen_from_ws(position_ws).xy), ivec2(0), textureSize(translucent_depth, 0) - 1);
            there = texelFetch(translucent_back_depth, there, 0).r > 0.0 ? there : pixel;
            // Normals face the eye: the way out is against them. A totally reflected ray is let through.
            vec3 out_n = -octahedral_decode(texelFetch(translucent_back_normal, there, 0).xy);
            vec3 outside = refract(direction, dot(direction, out_n) > 0.0 ? -out_n : out_n, medium.x);
            direction = dot(outside, outside) > 0.5 ? outside : direction;
        }
        if (passes) {
            Traced hit = trace(position_ws, direction, 2.0 * view.scene_radius, ssdo_thickness);
            ivec2 met = ivec2(hit.at);
            if (hit.found && faces(texelFetch(ssdo_planes, met, 0), met, screen_from_ws(position_ws))) {
                vec3 radiance = texelFetch(ssdo_shaded, met, 0).rgb;
#if HAS_GBUF_EMISSION
                radiance += texelFetch(gbuf_emission, met, 0).rgb;
#endif
                seen = vec4(radiance * texelFetch(gbuf_transmission, pixel, 0).rgb, 1.0);
            }
        }
    }
    imageStore(transmission_indirect, pixel, seen);
}
