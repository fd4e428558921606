// What a block of RSM texels sends to points that the camera sees, and to surface points where light bounces on: the first of the
// steps by which virtual lights are drawn where they tell (importance_mean_comp.glsl, importance_share_comp.glsl).
//
// A block i of flux F_i stands at one texel of its own for each receiver j, drawn by flux, as a disc of the area that flux F_i has
// there: f_ij = F_i V_ij cosθ_i cosθ_j / (π d² + cosθ_i cosθ_j A_i), the gather's own form (gather_lib.glsl).

#include "engines/rsm/rsm_lib.glsl"
#include "lib/view_lib.glsl"
#include "lib/sequence_lib.glsl"
#if HAS_OCCUPANCY
#include "lib/occupancy_lib.glsl"
#endif
#include "engines/rsm/warp_lib.glsl"
#include "engines/rsm/blocks_lib.glsl"

layout(local_size_x = 64) in;

// Receiver `j`: a pixel's point, evenly over the picture, or a surface point. False where there is none.
bool importance_receiver(int j, out vec3 position_ws, out vec3 n, out vec3 start_ws)
{
    vec2 u = sobol_2d(uint(j), 37u);
#if HAS_SURFACE_POINTS
    if (j >= RECEIVERS / 2) {
        SurfaceSample s = surface_points[point_first + min(int(u.x * float(point_count)), point_count - 1)];
        position_ws = s.position_ws;
        n = u.y < 0.5 ? s.normal_ws : -s.normal_ws;
        start_ws = position_ws;
#if HAS_OCCUPANCY
        start_ws = cells_clear(position_ws, n);
#endif
        return true;
    }
#endif
    ivec2 pixel = ivec2(u * view.resolution);
    float depth = texelFetch(gbuf_depth, pixel, 0).r;
    vec2 uv = (vec2(pixel) + 0.5) * view.inverse_resolution;
    position_ws = position_ws_from_depth(uv, depth);
    n = octahedral_decode(texelFetch(gbuf_normal, pixel, 0).zw);
    start_ws = position_ws;
#if HAS_OCCUPANCY
    start_ws = cells_clear_along(position_ws, n, view_direction_ws(uv));
#endif
    return depth > 0.0;
}

void main()
{
    ivec2 blocks = textureSize(rsm_flux, BLOCK_LEVEL);
    int i = int(gl_GlobalInvocationID.x) / RECEIVERS;
    int j = int(gl_GlobalInvocationID.x) % RECEIVERS;
    if (i >= blocks.x * blocks.y) {
        return;
    }
    ivec2 block = ivec2(i % blocks.x, i / blocks.x);
    int light = block_light(block);
    float flux = flux_at(block, BLOCK_LEVEL);
    float sent = 0.0;
    vec3 position_ws, n, start_ws;
    if (light >= 0 && flux > 0.0 && importance_receiver(j, position_ws, n, start_ws)) {
        vec2 u = fract(sobol_2d(uint(j), 38u) + unit_shift(hash_u32(uvec2(block))));
        ivec2 pixel = warp_by_flux(block, BLOCK_LEVEL, u);
        int index = view_at(vec2(pixel) + 0.5);
        RsmTexel t = rsm_texel(index, pixel);
        vec3 d = t.position_ws - position_ws;
        float d2 = dot(d, d);
        vec3 w = d * inversesqrt(max(d2, 1e-37));
        float product = max(dot(w, n), 0.0) * max(-dot(w, t.normal_ws), 0.0);
        float area = t.area * flux / max(luminance(t.flux), 1e-37);
        bool hidden = !(product > 0.0);
#if HAS_OCCUPANCY
        hidden = hidden || cells_block(start_ws, texel_clear(rsm_views[index], t));
#endif
        sent = hidden ? 0.0 : flux * product / max(PI * d2 + product * area, 1e-37);
    }
    importance_sent[i * RECEIVERS + j] = is_finite(sent) ? sent : 0.0;
}
