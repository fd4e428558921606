// Ambient occlusion by points tested against the depth buffer: M. Mittring, "Finding Next Gen: CryEngine 2", SIGGRAPH
// course 2007, in the form of the paper's §IV-B: one set of samples for all pixels, turned by 4 × 4 rotations.
//
// Mittring counts single points of a ball. Here the points are strung along cosine-distributed directions and a direction
// is blocked by the first of its points that lies behind the depth buffer, so that the mean is Cycles' ambient
// occlusion, ∫ V cosθ dω / π within ao_distance, of what the screen knows.
//
// Where cells know the scene (occupancy_lib.glsl), the screen is asked only as far as the cells can't tell a direction's
// occluder from the surface itself: to the first free cell above the layer that the surface fills. Cells decide the rest, on
// the screen or not.
//
// The second channel is for indirect light that nothing else tests for visibility: an occluder at distance t dims it by
// 1 − (t/ao_contact)², gone at ao_contact.

#include "lib/view_lib.glsl"
#include "lib/math_lib.glsl"
#include "lib/sequence_lib.glsl"
#if HAS_OCCUPANCY
#include "lib/occupancy_lib.glsl"
#endif

#if HAS_OCCUPANCY
// Whether the way from `a_ws` to `b_ws` goes through the surface that the screen shows before `b_ws`, at `pixel`: through its
// plane from front to back, at a point where the screen shows that plane too. So walls seen edge-on block: behind one, a point
// is far behind the depth buffer at once.
bool through_seen_plane(vec3 a_ws, vec3 b_ws, ivec2 pixel, float depth, float width)
{
    vec3 on_ws = position_ws_from_depth((vec2(pixel) + 0.5) * view.inverse_resolution, depth);
    vec3 n = octahedral_decode(texelFetch(gbuf_normal, pixel, 0).zw);
    float before = dot(a_ws - on_ws, n);
    float after = dot(b_ws - on_ws, n);
    if (before <= 0.0 || after >= 0.0) {
        return false;
    }
    vec3 crossing = project_ws(mix(a_ws, b_ws, before / (before - after)));
    ivec2 q = clamp(ivec2(crossing.xy * view.resolution), ivec2(0), textureSize(gbuf_depth, 0) - 1);
    float seen = texelFetch(gbuf_depth, q, 0).r;
    vec3 seen_ws = position_ws_from_depth((vec2(q) + 0.5) * view.inverse_resolution, seen);
    return seen > 0.0 && abs(dot(seen_ws - on_ws, n)) < width;
}
#endif

// Distance (m) of the first test point between `from` and `to` that is behind the depth buffer, −1 if there is none: at most
// by the occluder's thickness; and whether the ray went through a surface by then.
float screen_hit(vec3 start_ws, vec3 direction, float from, float to, float jitter, float width, inout float through)
{
    float hit = -1.0;
    for (int k = 0; k < ao_steps && hit < 0.0; ++k) {
        // Quadratic spacing: finer near the surface, where contacts are.
        float t = (float(k) + jitter) / float(ao_steps);
        float reach = from + (to - from) * t * t;
        vec3 p = project_ws(start_ws + direction * reach);
        if (p.z <= view.clip_start || any(lessThan(p.xy, vec2(0.0))) || any(greaterThanEqual(p.xy, vec2(1.0)))) {
            break; // the screen does not know
        }
        ivec2 pixel = ivec2(p.xy * view.resolution);
        float scene = texelFetch(gbuf_depth, pixel, 0).r;
        float behind = p.z - scene;
        if (scene > 0.0 && behind > 0.5 * width) {
            // An occluder is taken to be as thick as the point is far along the ray: what is much nearer to the camera
            // than that hides the point from the camera, not the surface from the sky.
            hit = behind < max(reach, 2.0 * width) ? reach : hit;
#if HAS_OCCUPANCY
            if (through < 0.0 && through_seen_plane(start_ws, start_ws + direction * reach, pixel, scene, width)) {
                through = reach;
            }
#endif
        }
    }
    return hit;
}

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 uv = gl_FragCoord.xy * view.inverse_resolution;
    float depth = texelFetch(gbuf_depth, pixel, 0).r;
    if (depth <= 0.0) {
        ao_raw = vec2(0.0); // Cycles' pass is black where nothing is
        return;
    }
    vec4 normals = texelFetch(gbuf_normal, pixel, 0);
    vec3 n = octahedral_decode(normals.xy);
    vec3 ng = octahedral_decode(normals.zw);
    mat3 frame = frame_from_normal(n);
    float width = pixel_width(depth);
    // Off the surface by a pixel's width, which is what the depth buffer can't tell apart.
    vec3 start_ws = position_ws_from_depth(uv, depth) + ng * width;
    ivec2 kernel = (pixel + view.pixel_offset) & 3;
    float turn = float(kernel.y * 4 + kernel.x) / 16.0; // the 4 × 4 rotations
    float jitter = fract(turn * 7.0 + sobol_2d(view.subframe, 21u).x); // 7 is prime to 16: another order of the 16
    vec2 open_share = vec2(0.0);
#if HAS_OCCUPANCY
    float screen_reach = ao_contact;
    // How far above its own plane a ray has left the cells that the surface fills.
    float layer = dot(abs(ng), vec3(1.0)) * cell_size;
#else
    float screen_reach = max(ao_distance, ao_contact);
#endif
    for (int i = 0; i < ao_directions; ++i) {
        vec2 u = sobol_2d(view.subframe * uint(ao_directions) + uint(i), 20u);
        float radius = sqrt(u.x);
        float phi = TAU * (u.y + turn);
        vec3 direction = frame * vec3(radius * cos(phi), radius * sin(phi), sqrt(1.0 - u.x));
        float cos_g = dot(direction, ng);
        float through = -1.0;
        float hit = cos_g <= 0.0 ? 0.0 : screen_hit(start_ws, direction, 0.0, screen_reach, jitter, width, through);
        open_share.y += hit < 0.0 ? 1.0 : saturate(sqr(hit / max(ao_contact, 1e-20)));
#if HAS_OCCUPANCY
        hit = hit < 0.0 ? through : hit;
        if (hit < 0.0) {
            vec3 cells = cells_first(start_ws, direction, min(layer / cos_g, ao_distance));
            float near = min(cells.x, ao_distance);
            if (near > screen_reach) {
                hit = screen_hit(start_ws, direction, screen_reach, near, jitter, width, through);
                hit = hit < 0.0 ? through : hit;
            }
            hit = hit < 0.0 && cells.y >= 0.0 ? 0.5 * (cells.y + cells.z) : hit; // surfaces are in the middle, on the mean
        }
#endif
        open_share.x += hit < 0.0 || hit > ao_distance ? 1.0 : 0.0;
    }
    ao_raw = open_share / float(ao_directions);
}
