// Ambient occlusion by visibility bitmask (scan_lib.glsl): the share of cosine-weighted directions in which nothing that the
// screen shows lies within ao_distance, Cycles' ambient occlusion. For the same depth tests as passes/ao_frag.glsl.

#include "engines/ssdo/scan_lib.glsl"
#include "lib/sequence_lib.glsl"

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 uv = gl_FragCoord.xy * view.inverse_resolution;
    float depth = texelFetch(gbuf_depth, pixel, 0).r;
    ao_raw = vec2(0.0); // Cycles' pass is black where nothing is
    if (depth <= 0.0) {
        return;
    }
    vec4 normals = texelFetch(gbuf_normal, pixel, 0);
    vec3 n = octahedral_decode(normals.xy);
    vec3 ng = octahedral_decode(normals.zw);
    vec3 v = view_direction_ws(uv);
    mat3 frame = frame_from_normal(v);
    vec3 position_ws = position_ws_from_depth(uv, depth);
    vec3 origin = screen_from_ws(position_ws);
    vec4 c = view.clip_from_world * vec4(position_ws, 1.0);
    // The 4 × 4 rotations that the blur afterwards is made for.
    ivec2 kernel = (pixel + view.pixel_offset) & 3;
    float turn = float(kernel.y * 4 + kernel.x) / 16.0;
    vec2 jitters = sobol_2d(view.subframe, 21u);
    float radius = ao_distance / pixel_width(depth);
    float open_share = 0.0;
    for (int i = 0; i < ao_slices; ++i) {
        vec2 u = fract(sobol_2d(view.subframe * uint(ao_slices) + uint(i), 20u) + vec2(turn, 7.0 * turn)); // 7 is prime to 16
        float phi = PI * u.x;
        vec3 t = frame * vec3(cos(phi), sin(phi), 0.0);
        Slice slice = make_slice(n, v, t, u.y);
        uint mask = ~sectors_above(slice, ng, v, t);
        vec2 along = screen_direction(c, t);
        for (int turned = 0; turned < 2; ++turned) {
            vec2 side = along * (1.0 - 2.0 * float(turned));
            Scan scan = begin_scan(ssdo_planes, origin, v, t, side * min(pixels_to_edge(origin.xy, side), radius), ao_steps,
                                   fract(jitters.x + 7.0 * turn + 0.618034 * float(2 * i + turned)), ao_thickness);
            for (int k = 0; k <= ao_steps; ++k) {
                Covered r = scan_next(ssdo_planes, scan, slice, k, vec4(NOTHING));
                mask |= r.distance > 0.0 && r.distance <= ao_distance ? r.sectors : 0u;
            }
        }
        open_share += float(bitCount(~mask)) / SECTORS * slice.weight;
    }
    ao_raw = vec2(open_share / float(ao_slices));
}
