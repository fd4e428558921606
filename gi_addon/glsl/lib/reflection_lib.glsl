// One direction of a pixel's glossy lobe, and what a ray along it counts. Included after view_lib, bsdf_lib and sequence_lib, where
// the G-buffer's normal and lobe and the lobes' tables are read.
//
// Drawn by the visible normals of GGX, so that its radiance counts F G2/G1 ≤ 1 of the lobe (E. Heitz, "Sampling the GGX
// Distribution of Visible Normals", JCGT 7(4), 2018, eq. 19): no direction counts more than another for where it was drawn. Over
// the lobe's albedo: what the rays then bring is a mean radiance, in which neighbours of one lobe agree, whatever their colour
// (passes/share_reflections_frag.glsl).

struct ReflectedRay {
    bool passes;        // false: below the surface, no light this way
    vec3 position_ws;
    vec3 ng;            // the triangle's normal
    vec3 direction;     // a unit vector
    vec3 share;         // of the ray's radiance in the mean over the lobe
    float alpha;
};

// Of the surface of `lobe` at `pixel`, of view depth `depth`; `u` in [0, 1)².
ReflectedRay reflected_ray(Lobe lobe, ivec2 pixel, float depth, vec2 u)
{
    vec2 uv = (vec2(pixel) + 0.5) * view.inverse_resolution;
    vec4 normals = texelFetch(gbuf_normal, pixel, 0);
    vec3 ng = octahedral_decode(normals.zw);
    mat3 frame = frame_from_normal(octahedral_decode(normals.xy));
    vec3 v = view_direction_ws(uv) * frame;
    v = normalize(vec3(v.xy, max(v.z, 1e-3))); // shading normals can face away from the eye
    float alpha = max(sqr(lobe.roughness), ALPHA_MIN);
    vec3 h = ggx_sample_visible_normal(v, alpha, u);
    vec3 l = reflect(-v, h);
    vec3 direction = frame * l;
    vec3 share = fresnel(lobe, saturate(dot(v, h))) * ggx_visible_weight(v.z, l.z, alpha) *
                 multiscatter_gain(brdf_energy, brdf_average, lobe, v.z);
    share = safe_divide(share, lobe_albedo(brdf_albedo, brdf_average, brdf_energy, lobe, v.z));
    return ReflectedRay(l.z > 0.0 && dot(direction, ng) > 0.0, position_ws_from_depth(uv, depth), ng, direction, share, alpha);
}

// What glossy.traced holds of a ray that brings `radiance` from `distance`, and of a pixel without a lobe: its alpha is the
// nearness of what is mirrored, 1/m.
vec4 traced_light(vec3 radiance, float distance) { return vec4(radiance, 1.0 / max(distance, 1e-20)); }
const vec4 NO_LIGHT = vec4(0.0);
const vec4 NO_LOBE = vec4(0.0, 0.0, 0.0, -1.0);
