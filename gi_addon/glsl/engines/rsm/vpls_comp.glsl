// Virtual point lights by hierarchical warping of a low-discrepancy set over the flux pyramid (P. Clarberg et al.,
// "Wavelet Importance Sampling", SIGGRAPH 2005, §4).
//
// Each light draws by a sequence of its own, and has either `own_samples` of them, or a share of all N by its flux (systematic
// sampling: N · share, rounded up or down from sub-frame to sub-frame). A texel is drawn with probability p = its share of the
// light's flux, so each of a light's n samples stands for flux Φ/(n p): all carry the same luminance, and their sum is the
// light's flux at any n ≥ 1. A light too dim for one sample in every sub-frame has one of flux Σ/(N p) now and then, Σ the flux
// of all: right in the mean.

#include "engines/rsm/rsm_lib.glsl"
#include "lib/view_lib.glsl"
#include "lib/sequence_lib.glsl"
#if HAS_OCCUPANCY
#include "lib/occupancy_lib.glsl"
#endif

layout(local_size_x = 64) in;

float flux_at(ivec2 p, int level) { return texelFetch(rsm_flux, p, level).r; }

// The level of the pyramid at which view `k` is one texel: tiles lie in blocks of a power of two (gi_addon/atlas.py).
int view_level(int k) { return findMSB(2 * int(rsm_views[k].rect.z) - 1); }

float view_flux(int k)
{
    int level = view_level(k);
    return flux_at(ivec2(rsm_views[k].rect.xy) >> level, level);
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
        total += view_flux(k);
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
    float flux = 0.0;
    float before = 0.0;
    float all = 0.0;
    int begin = 0;
    int low = 0;
    int group = 0;
    for (int k = 0; k < view_count; ++k) {
        all += view_flux(k);
        if (k + 1 == view_count || view_salt(k + 1) != view_salt(k)) {
            int high = k + 1 == view_count ? vpl_count : int(floor(float(vpl_count) * min(all / total, 1.0) + offset));
            low = own_samples > 0 ? group * own_samples : low;
            high = own_samples > 0 ? low + own_samples : min(high, vpl_count);
            if (i >= low && i < high) {
                first = begin;
                last = k + 1;
                count = high - low;
                nth = i - low;
                flux = all - before;
            }
            begin = k + 1;
            before = all;
            low = high;
            ++group;
        }
    }
    if (count == 0 || !(flux > 0.0)) {
        return;
    }
    float mean_count = own_samples > 0 ? float(own_samples) : float(vpl_count) * flux / total;
    // Luminance of the flux of one sample, W.
    float each = mean_count >= 1.0 ? flux / float(count) : total / float(vpl_count);
    vec2 u = sobol_2d(uint(floor(float(view.subframe) * mean_count)) + uint(nth), view_salt(first));

    int index = first;
    float left_over = u.x * flux;
    for (int k = first; k < last; ++k) {
        float f = view_flux(k);
        if (index == k && k + 1 < last && left_over >= f) {
            left_over -= f;
            index = k + 1;
        }
    }
    float shown = view_flux(index);
    u.x = clamp(left_over / max(shown, 1e-30), 0.0, 0.99999994); // the float below 1
    int top = view_level(index);
    ivec2 p = ivec2(rsm_views[index].rect.xy) >> top;
    for (int level = top - 1; level >= 0; --level) {
        p *= 2;
        float c00 = flux_at(p, level);
        float c10 = flux_at(p + ivec2(1, 0), level);
        float c01 = flux_at(p + ivec2(0, 1), level);
        float c11 = flux_at(p + ivec2(1, 1), level);
        float lower = c00 + c10;
        float sum = lower + c01 + c11;
        float split = sum > 0.0 ? lower / sum : 0.5;
        bool upper = u.y >= split && sum - lower > 0.0;
        u.y = upper ? (u.y - split) / max(1.0 - split, 1e-20) : u.y / max(split, 1e-20);
        float left = upper ? c01 : c00;
        float row = upper ? c01 + c11 : lower;
        split = row > 0.0 ? left / row : 0.5;
        bool right = u.x >= split && row - left > 0.0;
        u.x = right ? (u.x - split) / max(1.0 - split, 1e-20) : u.x / max(split, 1e-20);
        u = clamp(u, vec2(0.0), vec2(0.99999994));
        p += ivec2(right ? 1 : 0, upper ? 1 : 0);
    }
    float texel_flux = flux_at(p, 0);
    if (!(texel_flux > 0.0)) {
        return;
    }
    LightView v = rsm_views[index];
    RsmTexel t = rsm_texel(index, p);
    float weight = each / texel_flux;
    Vpl vpl = none;
    vpl.position_ws = t.position_ws;
    vpl.normal_ws = t.normal_ws;
    vpl.light = v.light;
    vpl.flux = t.flux * weight;
    // The disc that a sample stands for among those of all sub-frames: its own singularity is averaged with theirs.
    vpl.area = t.area * weight / float(view.subframes);
    vpl.clear_ws = t.position_ws;
#if HAS_OCCUPANCY
    vec3 to_light = v.perspective > 0.5 ? normalize(v.origin_ws - t.position_ws) : -v.axis_z;
    // What leaves by the far side of a sheet does not see the light.
    vpl.clear_ws = dot(to_light, t.normal_ws) > 0.0 ? cells_clear_along(t.position_ws, t.normal_ws, to_light)
                                                    : cells_clear(t.position_ws, t.normal_ws);
#endif
    // The light, the map of it, and the place in that along a curve that keeps neighbours together (G. M. Morton, 1966).
    vpl.key = uint(index) << 22;
    uvec2 at = uvec2((vec2(p) + 0.5 - v.rect.xy) / v.rect.zw * 2048.0);
    for (int bit = 0; bit < 11; ++bit) {
        vpl.key |= ((at.x >> bit & 1u) | (at.y >> bit & 1u) << 1) << (2 * bit);
    }
    drawn_vpls[i] = vpl;
}
