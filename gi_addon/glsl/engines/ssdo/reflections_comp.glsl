// Glossy reflections of what the screen shows: one ray per pixel and sub-frame, drawn by the lobe's visible normals (E. Heitz,
// JCGT 7(4), 2018), so that its weight is F G2/G1, and a lobe's width comes of the sub-frames' rays.
//
// Rays that leave the screen, or pass behind what it shows, bring nothing: E/π in their place, the light that the screen brings
// here on the whole, was tried and is worse (docs/techniques/ssdo.md). Lamps, and the world and emissive surfaces as lamps, are
// direct light already. Where those are taken from the screen (TRACE_…), rays that find nothing bring the world's light, and
// hits fade to it at the picture's edge: `reflected_sources`, Glossy Direct in Cycles' sense.

#include "engines/ssdo/trace_lib.glsl"
#include "engines/ssdo/met_lib.glsl"
#include "lib/bsdf_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "lib/reflection_lib.glsl"
#if TRACE_WORLD
#include "generated/world.glsl"
#endif

const float NOT_FOUND = 1e30;
// Share of the picture's height over which hits fade at its edge, as K. Ahmed's and others' SSR do.
const float FADE = 0.05;

layout(local_size_x = 8, local_size_y = 8) in;

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, textureSize(gbuf_depth, 0)))) {
        return;
    }
    vec4 indirect = NO_LOBE;
    vec4 sources = NO_LOBE;
    vec4 way = vec4(0.0);
    float depth = texelFetch(gbuf_depth, pixel, 0).r;
    Lobe lobe = lobe_unpack(texelFetch(gbuf_specular, pixel, 0), texelFetch(gbuf_lobe, pixel, 0));
    if (depth > 0.0 && lobe_reflects(lobe)) {
        indirect = sources = NO_LIGHT;
        uint seed = hash_u32(uvec2(pixel + view.pixel_offset));
        ReflectedRay ray = reflected_ray(pixel, fract(sobol_2d(view.subframe, 42u) + unit_shift(seed)));
        way = vec4(ray.direction, ray.pdf);
        if (ray.passes) {
            Traced hit = trace(ray.position_ws, ray.direction, 2.0 * view.scene_radius, ssdo_thickness);
            float distance = hit.found ? hit.distance : NOT_FOUND;
            bool front = hit.found && met_front(hit, vec3(vec2(pixel) + 0.5, nearness(depth)));
            float known = 0.0; // fades towards the picture's edge, so that nothing pops in
            vec3 light = vec3(0.0);
            if (front) {
                vec2 inside = min(hit.at, view.resolution - hit.at) / (FADE * view.resolution.y);
                known = smoothstep(0.0, 1.0, min(inside.x, inside.y));
                indirect = traced_light(known * met_light(hit), distance);
#if TRACE_EMISSION
                light += hit.hidden ? vec3(0.0) : known * texelFetch(gbuf_emission, hit.pixel, 0).rgb;
#endif
            }
#if TRACE_WORLD
            if (!hit.found || front) {
                light += (1.0 - known) * world_radiance(ray.direction);
            }
#endif
            sources = traced_light(light, distance);
        }
    }
#if HAS_TRACED
    imageStore(traced, pixel, indirect);
#endif
#if HAS_TRACED_RAY
    imageStore(traced_ray, pixel, way);
#endif
#if HAS_TRACED_SOURCES
    imageStore(traced_sources, pixel, sources);
#endif
}
