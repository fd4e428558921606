// Warping a point of the unit square by sums over 2 × 2, 4 × 4 … texels (P. Clarberg et al., "Wavelet Importance Sampling",
// SIGGRAPH 2005, §4). Included after rsm_lib.glsl, where rsm_flux is declared.

float flux_at(ivec2 p, int level) { return texelFetch(rsm_flux, p, level).r; }

// The level of the pyramid at which view `k` is one texel: tiles lie in blocks of a power of two (gi_addon/atlas.py).
int view_level(int k) { return findMSB(2 * int(rsm_views[k].rect.z) - 1); }

// Which of four children holds the point `u`, of chances c00 (x, y), c10 (x + 1, y), c01, c11; `u` becomes its place in that child.
ivec2 warp_child(float c00, float c10, float c01, float c11, inout vec2 u)
{
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
    u = clamp(u, vec2(0.0), vec2(0.99999994)); // the float below 1
    return ivec2(right ? 1 : 0, upper ? 1 : 0);
}

// The texel that `u` falls to by flux, below texel `p` of `level`.
ivec2 warp_by_flux(ivec2 p, int level, inout vec2 u)
{
    for (int l = level - 1; l >= 0; --l) {
        p *= 2;
        p += warp_child(flux_at(p, l), flux_at(p + ivec2(1, 0), l), flux_at(p + ivec2(0, 1), l), flux_at(p + ivec2(1, 1), l), u);
    }
    return p;
}

// Where the light comes from at a texel's point.
vec3 texel_to_light(LightView v, RsmTexel t) { return v.perspective > 0.5 ? normalize(v.origin_ws - t.position_ws) : -v.axis_z; }

#if HAS_OCCUPANCY
// Where rays to a texel's virtual light end, clear of the cells of its own surface. What leaves by the far side of a sheet does not
// see the light.
vec3 texel_clear(LightView v, RsmTexel t)
{
    vec3 to_light = texel_to_light(v, t);
    return dot(to_light, t.normal_ws) > 0.0 ? cells_clear_along(t.position_ws, t.normal_ws, to_light)
                                            : cells_clear(t.position_ws, t.normal_ws);
}
#endif
