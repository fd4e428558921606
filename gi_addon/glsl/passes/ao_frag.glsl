// Ambient occlusion by points tested against the depth buffer: M. Mittring, "Finding Next Gen: CryEngine 2", SIGGRAPH
// course 2007, in the form of the paper's §IV-B: one set of samples for all pixels, turned by 4 × 4 rotations.
//
// Mittring counts single points of a ball. Here the points are strung along cosine-distributed directions and a direction
// is blocked by the first of its points that lies behind the depth buffer, so that the mean is Cycles' ambient
// occlusion, ∫ V cosθ dω / π within ao_distance, of what the screen knows.
//
// The second channel is for indirect light that nothing else tests for visibility: an occluder at distance t dims it by
// 1 − (t/ao_contact)², gone at ao_contact.

#include "lib/view_lib.glsl"
#include "lib/math_lib.glsl"
#include "lib/sequence_lib.glsl"

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
    float reach_of_steps = max(ao_distance, ao_contact);
    for (int i = 0; i < ao_directions; ++i) {
        vec2 u = sobol_2d(view.subframe * uint(ao_directions) + uint(i), 20u);
        float radius = sqrt(u.x);
        float phi = TAU * (u.y + turn);
        vec3 direction = frame * vec3(radius * cos(phi), radius * sin(phi), sqrt(1.0 - u.x));
        float hit = dot(direction, ng) <= 0.0 ? 0.0 : -1.0;
        for (int k = 0; k < ao_steps && hit < 0.0; ++k) {
            // Quadratic spacing: finer near the surface, where contacts are.
            float t = (float(k) + jitter) / float(ao_steps);
            float reach = reach_of_steps * t * t;
            vec3 p = project_ws(start_ws + direction * reach);
            if (p.z <= view.clip_start || any(lessThan(p.xy, vec2(0.0))) || any(greaterThanEqual(p.xy, vec2(1.0)))) {
                break; // the screen does not know
            }
            float scene = texelFetch(gbuf_depth, ivec2(p.xy * view.resolution), 0).r;
            float behind = p.z - scene;
            // An occluder is taken to be as thick as the point is far along the ray: what is much nearer to the camera
            // than that hides the point from the camera, not the surface from the sky.
            if (scene > 0.0 && behind > 0.5 * width && behind < max(reach, 2.0 * width)) {
                hit = reach;
            }
        }
        open_share.x += hit < 0.0 || hit > ao_distance ? 1.0 : 0.0;
        open_share.y += hit < 0.0 ? 1.0 : saturate(sqr(hit / max(ao_contact, 1e-20)));
    }
    ao_raw = open_share / float(ao_directions);
}
