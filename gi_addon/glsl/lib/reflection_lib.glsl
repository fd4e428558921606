// A pixel's glossy lobe, one direction drawn from it, and what the lobe makes of any direction. Included after view_lib, bsdf_lib
// and sequence_lib, where the G-buffer's depth, normal and lobe are read.
//
// Directions are drawn by the visible normals of GGX: the light along one counts F G2/G1 ≤ 1 of the lobe (E. Heitz, "Sampling
// the GGX Distribution of Visible Normals", JCGT 7(4), 2018, eqs. 17 to 19), wherever in the lobe it was drawn.

struct Glossy {
    bool exists;
    vec3 position_ws;
    vec3 n;             // shading normal
    vec3 ng;            // the triangle's
    vec3 v;             // towards the eye, no lower than the shading normal's horizon
    float alpha;
};

struct ReflectedRay {
    bool passes;        // false: below the surface, no light this way
    vec3 position_ws;
    vec3 ng;
    vec3 direction;     // a unit vector
    float alpha;
    float pdf;          // 1/sr
};

Glossy glossy_at(ivec2 pixel)
{
    vec2 uv = (vec2(pixel) + 0.5) * view.inverse_resolution;
    float depth = texelFetch(gbuf_depth, pixel, 0).r;
    vec4 normals = texelFetch(gbuf_normal, pixel, 0);
    vec3 n = octahedral_decode(normals.xy);
    vec3 v = view_direction_ws(uv);
    v = normalize(v + n * max(1e-3 - dot(n, v), 0.0)); // shading normals can face away from the eye
    float alpha = max(sqr(texelFetch(gbuf_specular, pixel, 0).a), ALPHA_MIN);
    return Glossy(depth > 0.0, position_ws_from_depth(uv, depth), n, octahedral_decode(normals.zw), v, alpha);
}

bool reflects_to(Glossy g, vec3 l) { return dot(g.n, l) > 0.0 && dot(g.ng, l) > 0.0; }

// Density of directions drawn by visible normals, of those that light arrives from: G1 D / (4 n·v) (ibid., eq. 17).
float reflected_pdf(Glossy g, vec3 l)
{
    if (!reflects_to(g, l)) {
        return 0.0;
    }
    float n_v = dot(g.n, g.v);
    float n_h = saturate(dot(g.n, safe_normalize(g.v + l)));
    return ggx_d(n_h, g.alpha) / ((1.0 + ggx_lambda(n_v, g.alpha)) * 4.0 * n_v);
}

// What the light along a direction that reflects counts, over its density: F G2/G1.
vec3 reflected_share(Glossy g, Lobe lobe, vec3 l)
{
    return fresnel(lobe, saturate(dot(g.v, safe_normalize(g.v + l)))) * ggx_visible_weight(dot(g.n, g.v), dot(g.n, l), g.alpha);
}

// `u` in [0, 1)².
ReflectedRay reflected_ray(ivec2 pixel, vec2 u)
{
    Glossy g = glossy_at(pixel);
    mat3 frame = frame_from_normal(g.n);
    vec3 h = frame * ggx_sample_visible_normal(g.v * frame, g.alpha, u);
    vec3 l = reflect(-g.v, h);
    return ReflectedRay(reflects_to(g, l), g.position_ws, g.ng, l, g.alpha, reflected_pdf(g, l));
}

// What `glossy.traced` holds of light from `distance`, and of a pixel without a lobe.
vec4 traced_light(vec3 radiance, float distance) { return vec4(radiance, 1.0 / max(distance, 1e-20)); }
const vec4 NO_LIGHT = vec4(0.0);
const vec4 NO_LOBE = vec4(0.0, 0.0, 0.0, -1.0);
