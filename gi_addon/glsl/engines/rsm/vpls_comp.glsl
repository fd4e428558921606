// Virtual point lights by hierarchical warping of a low-discrepancy set over the flux pyramid (warp_lib.glsl), whose coarse levels
// hold blocks' chances by what the camera sees of them, if those are known (importance_share_comp.glsl); else chances are by flux.
//
// Each light draws by a sequence of its own, and has either `own_samples` of them, or a share of all N by its chance (systematic
// sampling: N · share, rounded up or down from sub-frame to sub-frame). A texel of flux φ is drawn with probability p = its block's
// share of the light's chance · φ/the block's flux, so each of a light's n samples stands for flux φ/(n p). A light too dim for one
// sample in every sub-frame has one now and then, for n its N · share < 1: right in the mean.

#include "engines/rsm/rsm_lib.glsl"
#include "lib/view_lib.glsl"
#include "lib/sequence_lib.glsl"
#if HAS_OCCUPANCY
#include "lib/occupancy_lib.glsl"
#endif
#include "engines/rsm/warp_lib.glsl"

layout(local_size_x = 64) in;

// Of a texel of `level`, to a scale.
float chance_at(ivec2 p, int level)
{
#if HAS_RSM_IMPORTANCE
    return level >= BLOCK_LEVEL ? texelFetch(rsm_importance, p, level - BLOCK_LEVEL).r : flux_at(p, level);
#else
    return flux_at(p, level);
#endif
}

float view_chance(int k)
{
    int level = view_level(k);
    return chance_at(ivec2(rsm_views[k].rect.xy) >> level, level);
}

uint view_salt(int k) { return rsm_lights[rsm_views[k].light].salt; }

void main()
{
    int i = int(gl_GlobalInvocationID.x);
    if (i >= vpl_count) {
        return;
    }
    Vpl none;
    none.position_ws = vec3(0.0);
    none.area = 0.0;
    none.light = 0;
    none.anisotropy = 0.0;
    none.normal_ws = vec3(0.0, 0.0, 1.0);
    none.flux = vec3(0.0);
    none.clear_ws = vec3(0.0);
    none.key = 0u;
    drawn_vpls[i] = none;

    float total = 0.0;
    for (int k = 0; k < view_count; ++k) {
        total += view_chance(k);
    }
    if (!(total > 0.0)) {
        return;
    }
    // The light that the sample is of: views [first, last), `count` samples of which this is the `nth`.
    float offset = sobol_2d(view.subframe, 35u).x;
    int first = 0;
    int last = 0;
    int count = 0;
    int nth = 0;
    float chance = 0.0;
    float before = 0.0;
    float all = 0.0;
    int begin = 0;
    int low = 0;
    int group = 0;
    for (int k = 0; k < view_count; ++k) {
        all += view_chance(k);
        if (k + 1 == view_count || view_salt(k + 1) != view_salt(k)) {
            int high = k + 1 == view_count ? vpl_count : int(floor(float(vpl_count) * min(all / total, 1.0) + offset));
            low = own_samples > 0 ? group * own_samples : low;
            high = own_samples > 0 ? low + own_samples : min(high, vpl_count);
            if (i >= low && i < high) {
                first = begin;
                last = k + 1;
                count = high - low;
                nth = i - low;
                chance = all - before;
            }
            begin = k + 1;
            before = all;
            low = high;
            ++group;
        }
    }
    if (count == 0 || !(chance > 0.0)) {
        return;
    }
    float mean_count = own_samples > 0 ? float(own_samples) : float(vpl_count) * chance / total;
    vec2 u = sobol_2d(uint(floor(float(view.subframe) * mean_count)) + uint(nth), view_salt(first));

    int index = first;
    float left_over = u.x * chance;
    for (int k = first; k < last; ++k) {
        float f = view_chance(k);
        if (index == k && k + 1 < last && left_over >= f) {
            left_over -= f;
            index = k + 1;
        }
    }
    float shown = view_chance(index);
    u.x = clamp(left_over / max(shown, 1e-30), 0.0, 0.99999994); // the float below 1
    int level = view_level(index);
    ivec2 p = ivec2(rsm_views[index].rect.xy) >> level;
    float probability = 1.0 / chance;
#if HAS_RSM_IMPORTANCE
    for (; level > BLOCK_LEVEL; --level) {
        p *= 2;
        p += warp_child(chance_at(p, level - 1), chance_at(p + ivec2(1, 0), level - 1), chance_at(p + ivec2(0, 1), level - 1),
                        chance_at(p + ivec2(1, 1), level - 1), u);
    }
    probability *= chance_at(p, level) / max(flux_at(p, level), 1e-37);
#endif
    p = warp_by_flux(p, level, u);
    float texel_flux = flux_at(p, 0);
    if (!(texel_flux > 0.0)) {
        return;
    }
    LightView v = rsm_views[index];
    RsmTexel t = rsm_texel(index, p);
    float weight = 1.0 / ((mean_count >= 1.0 ? float(count) : mean_count) * probability * texel_flux);
    Vpl vpl = none;
    vpl.position_ws = t.position_ws;
    vpl.normal_ws = t.normal_ws;
    vpl.light = v.light;
    vpl.flux = t.flux * weight;
    // The disc that a sample stands for among those of all sub-frames: its own singularity is averaged with theirs.
    vpl.area = t.area * weight / float(view.subframes);
    vpl.clear_ws = t.position_ws;
#if HAS_OCCUPANCY
    vpl.clear_ws = texel_clear(v, t);
#endif
    // The light, the map of it, and the place in that along a curve that keeps neighbours together (G. M. Morton, 1966).
    vpl.key = uint(index) << 22;
    uvec2 at = uvec2((vec2(p) + 0.5 - v.rect.xy) / v.rect.zw * 2048.0);
    for (int bit = 0; bit < 11; ++bit) {
        vpl.key |= ((at.x >> bit & 1u) | (at.y >> bit & 1u) << 1) << (2 * bit);
    }
    drawn_vpls[i] = vpl;
}
