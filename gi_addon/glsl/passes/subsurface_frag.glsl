// Light that entered elsewhere and leaves here: the random walk that Cycles takes (M. Chiang, P. Kutz and B. Burley,
// "Practical and Controllable Subsurface Scattering for Production Path Tracing", SIGGRAPH 2016), on what rasterisation knows
// of the object: the near side that the picture shows, its far side along the pixel, and the side that the lights' maps
// show, which are translucent shadow maps then (C. Dachsbacher and M. Stamminger, EGSR 2003).
//
// A walk goes in by the eye's ray, refracted by a rough surface, goes free paths of mean ℓ (Cycles' radius) and turns any way,
// and keeps the share α of its light at each turn; where it leaves, it takes that place's E/π. A half space lit from all sides
// returns the albedo A, by which Cycles divides its pass, and so is this divided.
//
// Deep inside (more than DEEP free paths, lib/subsurface_lib.glsl, from all known sides) light diffuses, and a walk leaves the largest empty sphere of
// radius ρ anywhere on it, with the share κρ/sinh(κρ) (M. Muller, "Some Continuous Monte Carlo Methods for the Dirichlet
// Problem", 1956, with absorption), whatever its steps.
//
// A channel with its own ℓ has walks of its own. Indirect light is known where the picture shows it; light that enters where
// the picture does not look is taken to be as much as at the walk's start.

#include "lib/view_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "lib/bsdf_lib.glsl"
#include "lib/subsurface_lib.glsl"
#if HAS_RSM_DEPTH
#include "engines/rsm/rsm_lib.glsl"
#endif

const int WALKS = 3;       // a sub-frame's; one for each channel
const int STEPS = 64;      // what is under way after these is lost
const int HALVINGS = 4;    // of the step that leaves
const float EMPTY = 0.75;  // of the distance to the nearest known side
const float FAR = 1e30;

// How far inside the known sides a point is, along their normals, m; negative outside.
struct Inside {
    float near;    // the side in the picture
    float far;     // the far side of what the picture shows
    float lit;     // the side that the chosen light sees
    ivec2 pixel;   // that shows the point, or (-1)
    ivec2 texel;   // of the light's map
    int view;      // of the lights' maps, or -1 where they show nothing
};

Inside inside_at(vec3 offset, vec3 start_ws, ivec2 start, int light)
{
    Inside r = Inside(FAR, FAR, FAR, ivec2(-1), ivec2(0), -1);
    vec3 p = start_ws + offset;
    vec3 s = project_ws(p);
    // Beyond its edge the picture is taken to go on as it ends.
    ivec2 pixel = ivec2(clamp(floor(s.xy * view.resolution), vec2(0.0), view.resolution - 1.0));
    if (s.z > view.clip_start) {
        float back = texelFetch(subsurface_back, pixel, 0).r;
        vec2 uv = (vec2(pixel) + 0.5) * view.inverse_resolution;
        float depth = texelFetch(gbuf_depth, pixel, 0).r;
        vec3 ng = octahedral_decode(texelFetch(gbuf_normal, pixel, 0).zw);
        if (back <= 0.0) {
            r.far = -length(offset); // beside the object
        } else if (pixel == start) {
            r.near = -dot(offset, ng); // free of the rounding of places
            r.pixel = pixel;
        } else if (texelFetch(gbuf_subsurface, pixel, 0).a > 0.0) {
            r.near = dot(position_ws_from_depth(uv, depth) - p, ng);
            r.pixel = pixel;
        }
        // An open surface has no far side.
        if (back > 0.0 && (back > depth * (1.0 + 1e-5) || r.pixel.x < 0)) {
            vec3 back_ng = octahedral_decode(texelFetch(subsurface_back_normal, pixel, 0).rg);
            r.far = dot(p - position_ws_from_depth(uv, back), back_ng);
        }
    }
#if HAS_RSM_DEPTH
    if (light >= 0) {
        int index = rsm_view_of(rsm_lights[light], p);
        LightView v = rsm_views[index];
        vec3 q = light_view_project(v, p);
        if ((q.z > v.near || v.perspective < 0.5) && all(lessThan(abs(q.xy), vec2(1.0)))) {
            ivec2 texel = ivec2(v.rect.xy + (q.xy / v.guard * 0.5 + 0.5) * v.rect.zw);
            float depth = texelFetch(rsm_depth, texel, 0).r;
            if (depth > 0.0) {
                r.view = index;
                r.texel = texel;
                vec2 xy = ((vec2(texel) + 0.5 - v.rect.xy) / v.rect.zw * 2.0 - 1.0) * v.guard;
                vec3 ng = octahedral_decode(texelFetch(rsm_normal, texel, 0).zw);
                vec3 shown_ws = light_view_position(v, xy, depth);
                r.lit = dot(shown_ws - p, ng);
            } else {
                r.lit = -length(offset);
            }
        }
    }
#endif
    return r;
}

float depth_inside(Inside r) { return min(r.near, min(r.far, r.lit)); }

#if HAS_RSM_DEPTH
// Texels of the light's map are this wide at a point, m.
float texel_width_at(int index, vec3 position_ws)
{
    LightView v = rsm_views[index];
    return light_view_texel_width(v, dot(position_ws - v.origin_ws, v.axis_z));
}

// Whether the light shines on the back of a sheet without thickness: as far below as can be told, its map says outside, and
// the picture does not. Such a sheet has no inside that ends there; Cycles' walk goes on into the void.
bool behind_a_sheet(int light, vec3 position_ws, vec3 ng, ivec2 pixel)
{
    int index = rsm_view_of(rsm_lights[light], position_ws);
    float doubt = pixel_width(view_depth(position_ws)) + texel_width_at(index, position_ws);
    Inside below = inside_at(-2.0 * doubt * ng, position_ws, pixel, light);
    return below.lit < 0.0 && below.far >= 0.0;
}

float arriving_here(int light, vec3 position_ws)
{
    vec3 l;
    float angle;
    return rsm_lights[light].views > 0 ? luminance(light_arriving(rsm_lights[light], position_ws, l, angle)) : 0.0;
}
#endif

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 uv = gl_FragCoord.xy * view.inverse_resolution;
    float depth = texelFetch(gbuf_depth, pixel, 0).r;
    vec4 medium = texelFetch(gbuf_subsurface, pixel, 0);
    vec3 direct = vec3(0.0);
    vec3 indirect = vec3(0.0);
    bool scatters = depth > 0.0 && medium.a > 0.0 && max3(medium.rgb) > 0.0;
    if (scatters) {
        vec3 position_ws = position_ws_from_depth(uv, depth);
        vec4 normals = texelFetch(gbuf_normal, pixel, 0);
        vec3 n = octahedral_decode(normals.xy);
        vec3 ng = octahedral_decode(normals.zw);
        mat3 frame = frame_from_normal(n);
        vec3 v = view_direction_ws(uv) * frame;
        v = normalize(vec3(v.xy, max(v.z, 1e-3)));
        vec3 entry = texelFetch(gbuf_entry, pixel, 0).rgb;
        float rough = max(sqr(entry.x), ALPHA_MIN);
        float eta = entry.y;
        // Without what layers above take.
        vec3 color = texelFetch(gbuf_diffuse, pixel, 0).rgb;
        vec3 surface_albedo = clamp(color * (entry.z / max(luminance(color), 1e-6)), vec3(1e-3), vec3(1.0));
        vec3 alpha = single_scattering_albedo(surface_albedo);
        vec3 decay = vec3(diffuse_decay(alpha.r), diffuse_decay(alpha.g), diffuse_decay(alpha.b));
        bool together = max3(medium.rgb) - min3(medium.rgb) <= 1e-3 * max3(medium.rgb);
        uint seed = hash_u32(uvec2(pixel + view.pixel_offset));
        vec2 turn = unit_shift(seed);
        for (int k = 0; k < WALKS; ++k) {
            int channel = k % 3;
            float path = medium[channel];
            vec3 weight = together ? vec3(1.0) : vec3(3.0 * float(channel == 0), 3.0 * float(channel == 1), 3.0 * float(channel == 2));
            uint state = hash_u32(uvec3(seed, view.subframe, uint(k)));
            int light = -1;
            float light_share = 1.0;
#if HAS_RSM_DEPTH
            // One of the lights: half by what arrives here, half any, since one may shine elsewhere only.
            float total = 0.0;
            float count = 0.0;
            for (int i = 0; i < rsm_light_count; ++i) {
                total += arriving_here(i, position_ws);
                count += rsm_lights[i].views > 0 ? 1.0 : 0.0;
            }
            float choice = draw(state);
            for (int i = 0; i < rsm_light_count; ++i) {
                float share = rsm_lights[i].views > 0 ? 0.5 / count : 0.0;
                share = total > 0.0 ? share + 0.5 * arriving_here(i, position_ws) / total : share * 2.0;
                if (choice >= 0.0 && share > 0.0) {
                    light = i;
                    light_share = share;
                    choice -= share;
                }
            }
#endif
#if HAS_RSM_DEPTH
            light = light >= 0 && behind_a_sheet(light, position_ws, ng, pixel) ? -1 : light;
#endif
            vec2 u = fract(sobol_2d(view.subframe * uint(WALKS) + uint(k), 42u) + turn);
            vec3 direction = frame * refract(-v, ggx_sample_visible_normal(v, rough, u), 1.0 / eta);
            vec3 offset = vec3(0.0);
            vec3 before = vec3(0.0);
            bool walking = path > 0.0 && dot(direction, ng) < 0.0;
            bool left = false;
            int turns = 0;
            if (path <= 0.0) {
                // No medium in this channel: light leaves where it enters.
                left = true;
                weight *= surface_albedo;
            }
            for (int i = 0; i < STEPS; ++i) {
                if (walking) {
                    before = offset;
                    offset += direction * (-path * log(1.0 - draw(state)));
                    float inside = depth_inside(inside_at(offset, position_ws, pixel, light));
                    if (inside < 0.0) {
                        walking = false;
                        left = true;
                    } else {
                        weight *= alpha;
                        ++turns;
                        if (inside > DEEP * path && inside < FAR) {
                            float radius = EMPTY * inside;
                            offset += draw_direction(state) * radius;
                            weight *= share_across_sphere(decay, radius / path);
                        }
                        direction = draw_direction(state);
                        walking = max3(weight) > 1e-3;
                    }
                } else {
                    break;
                }
            }
            if (left) {
                vec3 after = offset;
                for (int i = 0; i < HALVINGS; ++i) {
                    vec3 middle = 0.5 * (before + after);
                    bool out_ = depth_inside(inside_at(middle, position_ws, pixel, light)) < 0.0;
                    after = out_ ? middle : after;
                    before = out_ ? before : middle;
                }
                // Which side that is, whatever light was chosen: the picture shows it with all of them.
                Inside at = inside_at(before, position_ws, pixel, light);
                Inside beyond = inside_at(after, position_ws, pixel, light);
                vec3 y = position_ws + before;
                float doubt = pixel_width(view_depth(y));
#if HAS_RSM_DEPTH
                doubt += at.view >= 0 ? texel_width_at(at.view, y) : 0.0;
#endif
                weight /= surface_albedo * float(WALKS);
                // No nearer than can be told, by the light's map alone, and before it turned: the surface that it entered by.
                if (turns == 0 && path > 0.0 && beyond.lit < 0.0 && beyond.far >= 0.0 && length(before) < doubt) {
                    weight = vec3(0.0);
                }
                if (at.pixel.x >= 0 && (beyond.near < 0.0 || (at.near <= min(doubt, at.far) && beyond.far >= 0.0))) {
#if HAS_DIRECT_DIFFUSE
                    direct += weight * texelFetch(direct_diffuse, at.pixel, 0).rgb;
#endif
#if HAS_INDIRECT_DIFFUSE
                    indirect += weight * texelFetch(indirect_diffuse, at.pixel, 0).rgb;
#endif
                } else {
#if HAS_RSM_DEPTH
                    if (at.view >= 0 && beyond.lit < 0.0) {
                        vec3 l;
                        float angle;
                        Light from = rsm_lights[light];
                        vec3 arriving = light_arriving(from, y, l, angle);
                        arriving *= from.diffuse * saturate(dot(octahedral_decode(texelFetch(rsm_normal, at.texel, 0).xy), l));
#if HAS_MEDIUM
                        arriving *= medium_transmittance(y, l, light_distance(from, y));
#endif
                        direct += weight * arriving * (INV_PI / light_share);
                    }
#endif
#if HAS_INDIRECT_DIFFUSE
                    indirect += weight * texelFetch(indirect_diffuse, pixel, 0).rgb;
#endif
                }
            }
        }
    }
#if HAS_SUBSURFACE_DIRECT
    subsurface_direct = vec4(direct, scatters ? medium.a : 0.0);
#endif
#if HAS_SUBSURFACE_INDIRECT
    subsurface_indirect = vec4(indirect, scatters ? medium.a : 0.0);
#endif
}
