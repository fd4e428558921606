// Directional albedo of the GGX lobe, by quadrature over visible normals (weight G2/G1, Heitz 2018 eq. 19).
//
// table 0: brdf_albedo (roughness, cosθ, curve): where between f0 and f90 the albedo lies. As Cycles defines its Glossy
//   Color and the dimming of the layers below, this is the Fresnel curve's plain mean over visible normals, those that
//   reflect below the horizon counting 0. Curves are dielectrics of rising index, the last one Schlick's.
// table 1: brdf_average (roughness, curve): the same, averaged with weight 2 cosθ.
// table 2: brdf_energy (roughness, cosθ): E without Fresnel, and its cosine-weighted average.

#include "lib/bsdf_lib.glsl"
#include "lib/sequence_lib.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// 256 stratified points leave the albedo within 1e-3 of 4096 of them (tests/test_bsdf.py).
const uint QUADRATURE = 256u;
// Cosines of the average: midpoints of 16 strata.
const int AVERAGE_STRATA = 16;
shared float strata[8][AVERAGE_STRATA];

float roughness_of(uint i, uint n) { return float(i) / float(n - 1u); }

// (mean of the curve over visible normals, E without Fresnel) seen under cos_v.
vec2 directional(float roughness, float cos_v, float eta)
{
    cos_v = max(cos_v, 1e-4);
    float alpha = max(sqr(roughness), ALPHA_MIN);
    vec3 v = vec3(sqrt(1.0 - cos_v * cos_v), 0.0, cos_v);
    vec2 sum = vec2(0.0);
    for (uint i = 0u; i < QUADRATURE; ++i) {
        vec3 h = ggx_sample_visible_normal(v, alpha, sobol_2d(i, 7u));
        vec3 l = reflect(-v, h);
        if (l.z > 0.0) {
            float weight = ggx_visible_weight(cos_v, l.z, alpha);
            sum += vec2(fresnel_curve(saturate(dot(v, h)), eta), weight);
        }
    }
    return sum / float(QUADRATURE);
}

float eta_of(int slice, int slices)
{
    if (slice == slices - 1) {
        return ETA_SCHLICK;
    }
    float z = min(float(slice) / float(slices - 2), 0.99);
    return max(ior_from_f0(sqr(sqr(z))), 1.0 + 1e-4);
}

void main()
{
    uvec3 id = gl_GlobalInvocationID;
    if (table == 0) {
        ivec3 size = imageSize(brdf_albedo);
        if (any(greaterThanEqual(ivec3(id), size))) {
            return;
        }
        float cos_v = roughness_of(id.y, uint(size.y));
        vec2 e = directional(roughness_of(id.x, uint(size.x)), cos_v, eta_of(int(id.z), size.z));
        imageStore(brdf_albedo, ivec3(id), vec4(e.x));
    } else if (table == 1) {
        ivec2 size = imageSize(brdf_average);
        if (any(greaterThanEqual(ivec2(id.xy), size))) {
            return;
        }
        float sum = 0.0;
        for (int i = 0; i < AVERAGE_STRATA; ++i) {
            float cos_v = (float(i) + 0.5) / float(AVERAGE_STRATA);
            vec2 e = directional(roughness_of(id.x, uint(size.x)), cos_v, eta_of(int(id.y), size.y));
            sum += 2.0 * cos_v * e.x;
        }
        imageStore(brdf_average, ivec2(id.xy), vec4(sum / float(AVERAGE_STRATA)));
    } else {
        ivec2 size = imageSize(brdf_energy);
        // Whole groups: nobody may miss the barrier.
        float roughness = roughness_of(id.x, uint(size.x));
        // The average is the same all along a column: its rows share the strata out.
        for (int k = 0; k < AVERAGE_STRATA / 8; ++k) {
            int i = 8 * k + int(gl_LocalInvocationID.y);
            float cos_v = (float(i) + 0.5) / float(AVERAGE_STRATA);
            strata[gl_LocalInvocationID.x][i] = 2.0 * cos_v * directional(roughness, cos_v, ETA_SCHLICK).y;
        }
        barrier();
        float average = 0.0;
        for (int i = 0; i < AVERAGE_STRATA; ++i) {
            average += strata[gl_LocalInvocationID.x][i];
        }
        float e = directional(roughness, roughness_of(id.y, uint(size.y)), ETA_SCHLICK).y;
        imageStore(brdf_energy, ivec2(id.xy), vec4(e, average / float(AVERAGE_STRATA), 0.0, 0.0));
    }
}
