// What the glossy lobe reflects: one cone per sub-frame about a direction drawn from the visible normals of GGX, as wide as
// its share of the lobe; at roughness 0 a ray march.
//
// GGX slopes have variance α²/2 per axis (Beckmann's relation), the mirrored direction turns twice as far: 2α². A uniform
// cone of angle θ has θ²/4, so θ = 2√2 α; a set of S cones divides the lobe, θ/√S each. The estimate of a direction
// drawn that way is L F G2/G1 (E. Heitz, JCGT 7(4), 2018, eq. 19).

#include "lib/view_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "lib/bsdf_lib.glsl"
#include "engines/vct/seen_lib.glsl"

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 uv = gl_FragCoord.xy * view.inverse_resolution;
    float depth = texelFetch(gbuf_depth, pixel, 0).r;
    indirect_glossy = vec4(0.0);
    Lobe lobe = lobe_unpack(texelFetch(gbuf_specular, pixel, 0), texelFetch(gbuf_lobe, pixel, 0));
    if (depth <= 0.0 || !lobe_reflects(lobe)) {
        return;
    }
    vec3 position_ws = position_ws_from_depth(uv, depth);
    vec4 normals = texelFetch(gbuf_normal, pixel, 0);
    vec3 n = octahedral_decode(normals.xy);
    vec3 ng = octahedral_decode(normals.zw);
    vec3 v = view_direction_ws(uv);
    float alpha = max(sqr(lobe.roughness), ALPHA_MIN);
    mat3 frame = frame_from_normal(n);
    vec3 v_local = v * frame;
    v_local.z = max(abs(v_local.z), 1e-3);
    vec2 u = view.subframes > 1u ? sobol_2d(view.subframe, 43u) : vec2(0.0);
    vec3 h = ggx_sample_visible_normal(v_local, alpha, u);
    vec3 l_local = reflect(-v_local, h);
    vec3 l = frame * l_local;
    if (l_local.z <= 0.0 || dot(l, ng) <= 0.0) {
        return;
    }
    float spread = min(2.0 * sqrt(2.0 / cone_sets) * alpha, 1.0);
    Cone cone = surface_cone(voxel_grid(), position_ws, ng, l, spread, 1e30);
    ConeResult result = trace_seen(voxel_grid(), cone);
    float shadowing = ggx_visible_weight(v_local.z, l_local.z, alpha);
    vec3 gain = multiscatter_gain(brdf_energy, brdf_average, lobe, v_local.z);
    indirect_glossy = vec4(result.radiance * fresnel(lobe, saturate(dot(v_local, h))) * gain * shadowing, 1.0);
}
