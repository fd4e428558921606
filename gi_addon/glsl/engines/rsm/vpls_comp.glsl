// Virtual point lights by hierarchical warping of a low-discrepancy set over the flux pyramid (P. Clarberg et al.,
// "Wavelet Importance Sampling", SIGGRAPH 2005, §4). A texel is drawn with probability p = its share of the flux, so each
// of N samples stands for flux Φ/(N p): all carry the same luminance, and their sum is the map's flux at any N.

#include "engines/rsm/rsm_lib.glsl"
#include "lib/view_lib.glsl"
#include "lib/sequence_lib.glsl"

layout(local_size_x = 64) in;

float flux_at(ivec2 p, int level) { return texelFetch(rsm_flux, p, level).r; }

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
    vpls[i] = none;

    float total = flux_at(ivec2(0), levels);
    if (!(total > 0.0)) {
        return;
    }
    vec2 u = sobol_2d(view.subframe * uint(vpl_count) + uint(i), 30u);
    ivec2 p = ivec2(0);
    for (int level = levels - 1; level >= 0; --level) {
        ivec2 size = textureSize(rsm_flux, level);
        ivec2 above = textureSize(rsm_flux, level + 1);
        ivec2 step_ = ivec2(size.x > above.x ? 2 : 1, size.y > above.y ? 2 : 1);
        p *= step_;
        float c00 = flux_at(p, level);
        float c10 = step_.x > 1 ? flux_at(p + ivec2(1, 0), level) : 0.0;
        float c01 = step_.y > 1 ? flux_at(p + ivec2(0, 1), level) : 0.0;
        float c11 = step_.x > 1 && step_.y > 1 ? flux_at(p + ivec2(1, 1), level) : 0.0;
        float low = c00 + c10;
        float sum = low + c01 + c11;
        float split = sum > 0.0 ? low / sum : 0.5;
        bool upper = u.y >= split && sum - low > 0.0;
        u.y = upper ? (u.y - split) / max(1.0 - split, 1e-20) : u.y / max(split, 1e-20);
        float left = upper ? c01 : c00;
        float row = upper ? c01 + c11 : low;
        split = row > 0.0 ? left / row : 0.5;
        bool right = u.x >= split && row - left > 0.0;
        u.x = right ? (u.x - split) / max(1.0 - split, 1e-20) : u.x / max(split, 1e-20);
        u = clamp(u, vec2(0.0), vec2(0.99999994)); // the float below 1
        p += ivec2(right ? 1 : 0, upper ? 1 : 0);
    }
    int index = -1;
    for (int k = 0; k < view_count; ++k) {
        vec2 q = vec2(p) + 0.5 - rsm_views[k].rect.xy;
        if (all(greaterThan(q, vec2(0.0))) && all(lessThan(q, rsm_views[k].rect.zw))) {
            index = k;
            break;
        }
    }
    float flux = flux_at(p, 0);
    if (index < 0 || !(flux > 0.0)) {
        return;
    }
    RsmTexel t = rsm_texel(index, p);
    float probability = flux / total;
    Vpl vpl = none;
    vpl.position_ws = t.position_ws;
    vpl.normal_ws = t.normal_ws;
    vpl.light = rsm_views[index].light;
    vpl.flux = t.flux / (float(vpl_count) * probability);
    // The disc that a sample stands for among those of all sub-frames: its own singularity is averaged with theirs.
    vpl.area = t.area / (float(vpl_count) * float(view.subframes) * probability);
    vpls[i] = vpl;
}
