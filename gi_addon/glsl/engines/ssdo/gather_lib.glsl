// Light from what the screen shows, over slices of the hemisphere with a visibility bitmask (slice_lib.glsl). Included where
// `ssdo_planes` and the radiance that leaves each pixel (`ssdo_sent`, or `gbuf_emission`) are declared.
//
// T. Ritschel et al., "Approximating Dynamic Global Illumination in Image Space", I3D 2009, take one point per direction, which
// is inside some geometry or not, and what light it then sends is a guess; a slice knows what it covers. A sender sends from its
// front only. Where GATHER_WORLD is 1 a direction that meets nothing takes the world's light: directional occlusion.

#include "engines/ssdo/scan_lib.glsl"
#include "lib/sequence_lib.glsl"
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

Gathered gather_screen(vec3 position_ws, vec3 n, vec3 ng, vec3 v, ivec2 place)
{
    Gathered g = Gathered(vec3(0.0), vec4(0.0));
    float reach = ssdo_radius > 0.0 ? ssdo_radius : 2.0 * view.scene_radius;
    vec3 origin = screen_from_ws(position_ws);
    // 2 × 2 neighbours and all sub-frames have parts of one set of slices.
    uint run = 4u * view.subframe + uint((place.x & 1) + 2 * (place.y & 1));
    mat3 frame = frame_from_normal(v);
    vec4 c = view.clip_from_world * vec4(position_ws, 1.0);
    for (int i = 0; i < ssdo_slices; ++i) {
        vec2 u = r2_sequence(run * uint(ssdo_slices) + uint(i));
        // Evenly about the eye's direction; each further run halves the gaps.
        float phi = PI * (float(i) + unit_float(bitfieldReverse(run))) / float(ssdo_slices);
        vec3 t = frame * vec3(cos(phi), sin(phi), 0.0);
        Slice slice = make_slice(n, v, t, u.y);
        uint mask = ~sectors_above(slice, ng, v, t);
        vec2 along = screen_direction(c, t);
        for (int turned = 0; turned < 2; ++turned) {
            vec2 side = along * (1.0 - 2.0 * float(turned));
            Scan scan = begin_scan(origin, v, t, side * pixels_to_edge(origin.xy, side), ssdo_steps,
                                   fract(u.x + 0.5 * float(turned)), ssdo_thickness);
            for (int k = 0; k <= ssdo_steps; ++k) {
                Covered r = scan_next(scan, slice, k);
                uint seen = r.sectors & ~mask;
                if (seen != 0u && r.distance <= reach) {
                    uint lit = r.lit & ~mask;
                    mask |= seen;
                    if (lit != 0u && faces(r.at.plane, r.at.pixel, origin)) {
                        vec3 direction = v * r.direction.x + t * r.direction.y;
                        float share = float(bitCount(lit)) / SECTORS * slice.weight;
                        add_light(g, sent_from(r.at.pixel) * share, direction, dot(direction, n));
                    }
                }
            }
        }
#if GATHER_WORLD
        // One of the open sectors stands for all of them.
        uint open = ~mask;
        int count = bitCount(open);
        int pick = int(fract(u.y + 0.5) * float(count));
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
            vec2 middle = slice_middle(slice, found);
            vec3 direction = v * middle.x + t * middle.y;
            add_light(g, world_radiance(direction) * (float(count) / SECTORS * slice.weight), direction, dot(direction, n));
        }
#endif
    }
    g.radiance /= float(ssdo_slices);
    g.direction /= float(ssdo_slices);
    return g;
}
