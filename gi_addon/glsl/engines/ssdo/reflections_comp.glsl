// Glossy reflections of what the screen shows: one ray per pixel and sub-frame, drawn by the lobe's visible normals (E. Heitz,
// JCGT 7(4), 2018), so that its weight is F G2/G1, and a lobe's width comes of the sub-frames' rays.
//
// Rays that leave the screen, or pass behind what it shows, bring nothing: E/π in their place, the light that the screen brings
// here on the whole, was tried and is worse (docs/techniques/ssdo.md). Lamps, and the world and emissive surfaces as lamps, are
// direct light already. Where those are taken from the screen (TRACE_…), rays that find nothing bring the world's light, and
// hits fade to it at the picture's edge: `reflected_sources`, Glossy Direct in Cycles' sense.

#include "engines/ssdo/trace_lib.glsl"
#include "lib/bsdf_lib.glsl"
#include "lib/sequence_lib.glsl"
#if TRACE_WORLD
#include "generated/world.glsl"
#endif

// Share of the picture's height over which hits fade at its edge, as K. Ahmed's and others' SSR do.
const float FADE = 0.05;

layout(local_size_x = 8, local_size_y = 8) in;

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, textureSize(gbuf_depth, 0)))) {
        return;
    }
    vec2 center = vec2(pixel) + 0.5;
    vec2 uv = center * view.inverse_resolution;
    vec3 indirect = vec3(0.0);
    vec3 sources = vec3(0.0);
    float depth = texelFetch(gbuf_depth, pixel, 0).r;
    Lobe lobe = lobe_unpack(texelFetch(gbuf_specular, pixel, 0), texelFetch(gbuf_lobe, pixel, 0));
    if (depth > 0.0 && lobe_reflects(lobe)) {
        vec4 normals = texelFetch(gbuf_normal, pixel, 0);
        vec3 n = octahedral_decode(normals.xy);
        vec3 ng = octahedral_decode(normals.zw);
        vec3 v = view_direction_ws(uv);
        mat3 frame = frame_from_normal(n);
        vec3 local_v = v * frame;
        local_v.z = max(local_v.z, 1e-4);
        float alpha = max(sqr(lobe.roughness), ALPHA_MIN);
        uint seed = hash_u32(uvec2(pixel + view.pixel_offset));
        vec2 u = fract(sobol_2d(view.subframe, 42u) + unit_shift(seed));
        vec3 h = ggx_sample_visible_normal(normalize(local_v), alpha, u);
        vec3 local_l = reflect(-normalize(local_v), h);
        vec3 l = frame * local_l;
        if (local_l.z > 0.0 && dot(l, ng) > 0.0) {
            float g = ggx_visible_weight(local_v.z, local_l.z, alpha);
            vec3 weight = fresnel(lobe, saturate(dot(normalize(local_v), h))) * g *
                          multiscatter_gain(brdf_energy, brdf_average, lobe, saturate(local_v.z));
            Traced hit = trace(position_ws_from_depth(uv, depth), l, 2.0 * view.scene_radius, ssdo_thickness);
            ivec2 met = ivec2(hit.at);
            bool front = hit.found && faces(texelFetch(ssdo_planes, met, 0), met, vec3(center, nearness(depth)));
            float known = 0.0; // fades towards the picture's edge, so that nothing pops in
            if (front) {
                vec2 inside = min(hit.at, view.resolution - hit.at) / (FADE * view.resolution.y);
                known = smoothstep(0.0, 1.0, min(inside.x, inside.y));
                indirect = weight * known * texelFetch(ssdo_shaded, met, 0).rgb;
#if TRACE_EMISSION
                sources += weight * known * texelFetch(gbuf_emission, met, 0).rgb;
#endif
            }
#if TRACE_WORLD
            if (!hit.found || front) {
                sources += weight * (1.0 - known) * world_radiance(l);
            }
#endif
        }
    }
#if HAS_INDIRECT_GLOSSY
    imageStore(indirect_glossy, pixel, vec4(indirect, 1.0));
#endif
#if HAS_REFLECTED_SOURCES
    imageStore(reflected_sources, pixel, vec4(sources, 1.0));
#endif
}
