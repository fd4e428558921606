// Irradiance from all virtual point lights at a point of the picture. Included where `vpls` is declared.

#include "engines/rsm/gather_lib.glsl"

// A sum of many terms to the last bit (W. Kahan, Comm. ACM 8(1), 1965): rounding must not choose which lights are tested.
struct Sum {
    float value;
    float lost;
};

void sum_add(inout Sum sum, float x)
{
    precise float term = x - sum.lost;
    precise float next = sum.value + term;
    precise float gained = next - sum.value;
    sum.lost = gained - term;
    sum.value = next;
}

// All of them at a point that the eye sees, `to_eye` from it.
//
// Rays are what costs. Of more lights than VISIBILITY_RAYS, as many are tested, drawn by what they send (systematic resampling:
// J. Carpenter, P. Clifford and P. Fearnhead, "Improved Particle Filter for Non-linear Problems", IEE Proc. F 146, 1999): of
// Σ f, each k-th of K equal shares, from u in [0, 1) on, falls to one light, and counts if that is seen. E[Σ] = Σ f V for a
// uniform u, another one in each sub-frame. A light of more than a share is always tested. One u for all pixels: neighbours draw
// the same lights, and their rays are alike.
//
// Σ f is known, in each colour: of share v seen, the drawn lights S of all drawn P, the sum is S + v (Σ f − P) (regression; W. G.
// Cochran, "Sampling Techniques", §7). That is S in luminance, by which they were drawn, and has no noise in any colour where all
// is seen or nothing; what it shifts colours by in half shadow is v's covariance with P, of order 1/K.
Gathered gather_vpls(vec3 position_ws, vec3 n, vec3 ng, vec3 to_eye)
{
    Gathered g = gathered_nothing();
    vec3 start_ws = position_ws;
#if HAS_OCCUPANCY
    start_ws = cells_clear_along(position_ws, ng, to_eye);
#endif
#if HAS_OCCUPANCY && VISIBILITY_RAYS > 0
    float u = sobol_2d(view.subframe, 36u).x;
    Sum all = Sum(0.0, 0.0);
    Gathered open = g;   // Σ f − P
    for (int i = 0; i < vpl_count; ++i) {
        VplLight light = vpl_light(vpls[i], position_ws, n, ng, 1.0);
        sum_add(all, light.arriving);
        open.radiance += light.radiance;
        open.direction += vec4(light.direction, 1.0) * light.arriving;
#ifdef GATHER_SLOPE
        g.slope += vec4(light.slope, luminance(light.radiance));
#endif
    }
    if (all.value <= 0.0) {
        return g;
    }
    int picked[VISIBILITY_RAYS];
    float shares[VISIBILITY_RAYS];
    int count = 0;
    float share = all.value / float(VISIBILITY_RAYS);
    Sum below = Sum(0.0, 0.0);
    float taken = 0.0; // shares that fell to the lights so far
    for (int i = 0; i < vpl_count; ++i) {
        sum_add(below, vpl_light(vpls[i], position_ws, n, ng, 1.0).arriving);
        float reached = min(floor(below.value / share + u), float(VISIBILITY_RAYS));
        if (reached > taken && count < VISIBILITY_RAYS) {
            picked[count] = i;
            shares[count] = reached - taken;
            ++count;
            taken = reached;
        }
    }
    float seen = 0.0;
    for (int k = 0; k < VISIBILITY_RAYS; ++k) {
        if (k < count) {
            Vpl vpl = vpls[picked[k]];
            VplLight light = vpl_light(vpl, position_ws, n, ng, 1.0);
            float stands_for = shares[k] * share / light.arriving;
            vec3 radiance = light.radiance * stands_for;
            vec4 direction = vec4(light.direction, 1.0) * (light.arriving * stands_for);
            open.radiance -= radiance;
            open.direction -= direction;
            if (!vpl_hidden(vpl, start_ws, position_ws)) {
                g.radiance += radiance;
                g.direction += direction;
                seen += shares[k];
            }
        }
    }
    seen /= float(VISIBILITY_RAYS);
    g.radiance += seen * open.radiance;
    g.direction += seen * open.direction;
#else
    for (int i = 0; i < vpl_count; ++i) {
        Vpl vpl = vpls[i];
        VplLight light = vpl_light(vpl, position_ws, n, ng, 1.0);
#ifdef GATHER_SLOPE
        g.slope += vec4(light.slope, luminance(light.radiance));
#endif
        if (light.arriving > 0.0 && !vpl_hidden(vpl, start_ws, position_ws)) {
            g.radiance += light.radiance;
            g.direction += vec4(light.direction, 1.0) * light.arriving;
        }
    }
#endif
    return g;
}
