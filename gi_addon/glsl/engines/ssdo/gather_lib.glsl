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

// Whether light is wanted at a pixel: what is drawn beyond the picture (by more than `beyond` pixels) only sends.
bool receives(ivec2 pixel, int beyond)
{
#if MARGIN_RECEIVES
    return true;
#else
    ivec2 low = ivec2(view.margin - beyond);
    ivec2 high = ivec2(view.resolution) - low;
    return all(greaterThanEqual(pixel, low)) && all(lessThan(pixel, high));
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

// A sample's light, in the sectors in which it is the first to be seen; what it fills is added to `filled`, for after the samples
// of all layers at this place: a thing is filled from its front to its back, which must not hide the back.
void take(inout Gathered g, inout uint mask, inout uint filled, Covered r, float reach, bool sends, vec3 sent, Slice slice, vec3 n,
          vec3 v, vec3 t)
{
    if (r.distance > reach) {
        return;
    }
    filled |= r.sectors;
    uint lit = r.lit & ~mask;
    if (lit != 0u && sends) {
        mask |= lit;
        vec3 direction = v * r.direction.x + t * r.direction.y;
        add_light(g, sent * (float(bitCount(lit)) / SECTORS * slice.weight), direction, dot(direction, n));
    }
}

const vec4 NOT_KNOWN = vec4(NOTHING, 0.0, 0.0, 0.0);
#if LAYERS > 1
// The plane in which a thing ends that begins at a surface: the next layer's, if that shows a back there; else it is a sheet.
vec4 thing_ends(vec4 here, vec4 next) { return here.w > 0.0 && next.w < 0.0 ? next : here; }
// The same for the last layer: a back ends what it belongs to, of a front it is not known.
vec4 last_thing_ends(vec4 here) { return here.w < 0.0 ? here : NOT_KNOWN; }
#endif

const float GOLDEN_SECTION = 0.618033989;

Gathered gather_screen(vec3 position_ws, vec3 n, vec3 ng, vec3 v, ivec2 place, int slices)
{
    Gathered g = Gathered(vec3(0.0), vec4(0.0));
    float reach = ssdo_radius > 0.0 ? ssdo_radius : 2.0 * view.scene_radius;
    vec3 origin = screen_from_ws(position_ws);
    // Slices are turned by shares of the gap between them. 2 × 2 neighbours have a quarter of the gap each, and another in each of four
    // sub-frames, so that all have all; within its quarter each begins elsewhere and goes on by the golden section, which fills it
    // evenly (H. Weyl, Math. Ann. 77, 1916). With a quarter of their own for good, neighbours never agreed: a pattern that stayed.
    uint quarter = uint((place.x & 1) + 2 * (place.y & 1));
    uint run = 4u * view.subframe + quarter;
    float turn = unit_float(bitfieldReverse(quarter ^ (view.subframe & 3u)))
               + 0.25 * fract(unit_float(bitfieldReverse(quarter)) + GOLDEN_SECTION * float(view.subframe >> 2u));
    mat3 frame = frame_from_normal(v);
    vec4 c = view.clip_from_world * vec4(position_ws, 1.0);
    for (int i = 0; i < slices; ++i) {
        vec2 u = r2_sequence(run * uint(slices) + uint(i));
        // Evenly about the eye's direction.
        float phi = PI * (float(i) + turn) / float(slices);
        vec3 t = frame * vec3(cos(phi), sin(phi), 0.0);
        Slice slice = make_slice(n, v, t, u.y);
        uint mask = ~sectors_above(slice, ng, v, t);
        vec2 along = screen_direction(c, t);
        for (int turned = 0; turned < 2; ++turned) {
            vec2 side = along * (1.0 - 2.0 * float(turned));
            vec2 way = side * pixels_to_edge(origin.xy, side);
            float jitter = fract(u.x + 0.5 * float(turned));
            Scan scan = begin_scan(ssdo_planes, origin, v, t, way, ssdo_steps, jitter, ssdo_thickness);
#if LAYERS > 1
            Scan scan_2 = begin_scan(ssdo_planes_2, origin, v, t, way, ssdo_steps, jitter, ssdo_thickness);
#endif
#if LAYERS > 2
            Scan scan_3 = begin_scan(ssdo_planes_3, origin, v, t, way, ssdo_steps, jitter, ssdo_thickness);
#endif
            for (int k = 0; k <= ssdo_steps; ++k) {
                ivec2 at = scan.last.pixel;
                vec4 plane = scan.last.plane;
                uint filled = 0u;
#if LAYERS > 1
                vec4 behind = texelFetch(ssdo_planes_2, at, 0);
                vec4 end = thing_ends(plane, behind);
#else
                vec4 end = NOT_KNOWN;
#endif
                Covered r = scan_next(ssdo_planes, scan, slice, k, end);
                if (r.sectors != 0u) {
                    take(g, mask, filled, r, reach, faces(plane, at, origin), sent_from(at), slice, n, v, t);
                }
#if LAYERS > 1
                plane = behind;
#if LAYERS > 2
                behind = texelFetch(ssdo_planes_3, at, 0);
                end = thing_ends(plane, behind);
#else
                end = last_thing_ends(plane);
#endif
                r = scan_next(ssdo_planes_2, scan_2, slice, k, end);
                if (r.sectors != 0u) {
                    take(g, mask, filled, r, reach, faces(plane, at, origin), texelFetch(ssdo_layer2_sent, at, 0).rgb, slice, n, v, t);
                }
#endif
#if LAYERS > 2
                r = scan_next(ssdo_planes_3, scan_3, slice, k, last_thing_ends(behind));
                if (r.sectors != 0u) {
                    take(g, mask, filled, r, reach, faces(behind, at, origin), texelFetch(ssdo_layer3_sent, at, 0).rgb, slice, n, v, t);
                }
#endif
                mask |= filled;
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
    g.radiance /= float(slices);
    g.direction /= float(slices);
    return g;
}
