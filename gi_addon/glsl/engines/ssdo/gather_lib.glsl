// Light from what the screen shows: over cosine-distributed rays, or over slices with a visibility bitmask. Included where
// `ssdo_planes` and the radiance that leaves each pixel (`ssdo_sent`, or `gbuf_emission`) are declared.
//
// Rays: direction pdf cosθ/π, so E/π is the mean radiance the rays find (T. Ritschel et al., "Approximating Dynamic Global
// Illumination in Image Space", I3D 2009, with a march in place of one point per ray: their point is inside some geometry
// or not, and what light it then sends is a guess). A sender sends from its front only. Where GATHER_WORLD is 1 a direction
// that meets nothing takes the world's light: directional occlusion.

#include "engines/ssdo/screen_lib.glsl"
#include "lib/sequence_lib.glsl"
#if SSDO_RAYS
#include "engines/ssdo/march_lib.glsl"
#else
#include "engines/ssdo/scan_lib.glsl"
#endif
#if GATHER_WORLD
#include "generated/world.glsl"
#endif

// Radiance that leaves a pixel's surface towards any side, W/(m²·sr).
vec3 sent_from(ivec2 pixel)
{
#if SENT == SENT_BOUNCE
    return texelFetch(ssdo_sent, pixel, 0).rgb;
#elif SENT == SENT_EMISSION
    return texelFetch(gbuf_emission, pixel, 0).rgb;
#else
    return vec3(0.0);
#endif
}

struct Gathered {
    vec3 radiance;    // E/π, W/(m²·sr)
    vec4 direction;   // Σ luminance × direction; Σ luminance
};

// Light per direction is light per projected direction over the cosine. That only steers the interpolation between normals
// 25° apart, so it need not follow the last 3° above the horizon, where it is all noise.
const float LEAST_COS = 0.05;

void add_light(inout Gathered g, vec3 light, vec3 direction, float cos_n)
{
    g.radiance += light;
    g.direction += vec4(direction, 1.0) * (luminance(light) * PI / max(cos_n, LEAST_COS));
}

Gathered gather_screen(vec3 position_ws, vec3 n, vec3 ng, vec3 v, uint seed)
{
    Gathered g = Gathered(vec3(0.0), vec4(0.0));
    float reach = ssdo_radius > 0.0 ? ssdo_radius : 2.0 * view.scene_radius;
    vec2 turn = unit_shift(seed);
    vec3 origin = screen_from_ws(position_ws);
    vec2 jitters = sobol_2d(view.subframe, 41u);
#if SSDO_RAYS
    mat3 frame = frame_from_normal(n);
    for (int i = 0; i < ssdo_directions; ++i) {
        vec3 local = warp_cosine_hemisphere(fract(sobol_2d(view.subframe * uint(ssdo_directions) + uint(i), 40u) + turn));
        vec3 direction = frame * local;
        if (dot(direction, ng) > 0.0) {
            float jitter = fract(jitters.x + turn.x + 0.618034 * float(i)); // golden ratio: even at every count
            ScreenHit hit = march(position_ws, direction, reach, ssdo_steps, ssdo_thickness, jitter);
            if (hit.found && faces(texelFetch(ssdo_planes, hit.pixel, 0), hit.pixel, origin)) {
                add_light(g, sent_from(hit.pixel), direction, local.z);
            }
#if GATHER_WORLD
            if (!hit.found) {
                add_light(g, world_radiance(direction), direction, local.z);
            }
#endif
        }
    }
#else
    mat3 frame = frame_from_normal(v);
    vec4 c = view.clip_from_world * vec4(position_ws, 1.0);
    for (int i = 0; i < ssdo_directions; ++i) {
        vec2 u = fract(sobol_2d(view.subframe * uint(ssdo_directions) + uint(i), 40u) + turn);
        float phi = PI * u.x;
        vec3 t = frame * vec3(cos(phi), sin(phi), 0.0);
        Slice slice = make_slice(n, v, t, u.y);
        float horizon = atan(dot(ng, t), max(dot(ng, v), 1e-6));
        uint mask = ~sectors_between(slice, horizon - 0.5 * PI, horizon + 0.5 * PI);
        vec2 along = screen_direction(c, t);
        for (int k = 0; k < 2 * ssdo_steps; ++k) {
            bool turned = k >= ssdo_steps;
            float side = turned ? -1.0 : 1.0;
            int step_ = turned ? k - ssdo_steps : k;
            float jitter = fract(jitters.x + turn.y + 0.618034 * float(2 * i + int(turned)));
            vec2 way = along * (side * pixels_to_edge(origin.xy, along * side));
            SliceSample s = slice_sample(slice, origin, position_ws, v, way, side, step_, ssdo_steps, jitter, ssdo_thickness);
            uint seen = s.sectors & ~mask;
            if (seen != 0u && s.distance <= reach) {
                mask |= seen;
                if (faces(s.plane, s.pixel, origin)) {
                    float share = float(bitCount(seen)) / SECTORS * slice.weight;
                    add_light(g, sent_from(s.pixel) * share, s.direction, dot(s.direction, n));
                }
            }
        }
#if GATHER_WORLD
        // One of the open sectors stands for all of them.
        uint open = ~mask;
        int count = bitCount(open);
        int pick = int(fract(u.y + 0.5 + turn.x) * float(count));
        int found = 0;
        for (int bit = 0; bit < 32; ++bit) {
            if ((open >> uint(bit) & 1u) != 0u) {
                if (pick == 0) {
                    found = bit;
                }
                --pick;
            }
        }
        if (count > 0) {
            float theta = slice_middle(slice, found);
            vec3 direction = v * cos(theta) + t * sin(theta);
            add_light(g, world_radiance(direction) * (float(count) / SECTORS * slice.weight), direction, dot(direction, n));
        }
#endif
    }
#endif
    g.radiance /= float(ssdo_directions);
    g.direction /= float(ssdo_directions);
    return g;
}
