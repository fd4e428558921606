// RSM texels as virtual point lights. Included where rsm_depth, rsm_normal, rsm_albedo, rsm_lights and rsm_views are
// declared.

#include "lib/light_lib.glsl"
#if HAS_MEDIUM
#include "lib/medium_lib.glsl"
#endif

struct RsmTexel {
    vec3 position_ws;
    vec3 normal_ws;    // of the triangle, to the side that the light leaves by
    vec3 flux;         // reflected, W
    float area;        // of the surface that the texel shows, m²
};

// The grazing limit of a texel's surface: beyond it the plane would leave the texel's neighbours too (cos 88.9°).
const float GRAZING_COS = 0.02;

// Which of a light's bounce maps shows a point: the face with the largest depth.
int rsm_view_of(Light light, vec3 position_ws)
{
    int best = light.first_view;
    float deepest = -1e30;
    for (int k = 0; k < light.views; ++k) {
        LightView v = rsm_views[light.first_view + k];
        float d = dot(position_ws - v.origin_ws, v.axis_z);
        if (d > deepest) {
            deepest = d;
            best = light.first_view + k;
        }
    }
    return best;
}

// Map coordinates of a texel's centre, and of the part of it that is the view's own; false where there is none. The margin around
// the light's own span belongs to its other views: of a texel across the border only the part inside counts, so that all views'
// texels sum to the light's flux.
bool rsm_texel_span(LightView v, ivec2 pixel, out vec2 xy, out vec2 low, out vec2 high)
{
    vec2 texel = 2.0 * v.guard / v.rect.zw;
    xy = (vec2(pixel) + 0.5 - v.rect.xy) * texel - v.guard;
    low = clamp(xy - 0.5 * texel, vec2(-1.0), vec2(1.0));
    high = clamp(xy + 0.5 * texel, vec2(-1.0), vec2(1.0));
    return all(lessThan(low, high));
}

// What texel `pixel` of view `index` reflects. A surface of area A under the beam's cross-section B at angle θ has
// A = B / cosθ; shading normals take irradiance by their own cosine, so Φ = albedo · E · cos θ_shading · A. A flat-shaded
// surface gives Φ = albedo × the arriving flux.
RsmTexel rsm_texel(int index, ivec2 pixel)
{
    LightView v = rsm_views[index];
    Light light = rsm_lights[v.light];
    RsmTexel t = RsmTexel(vec3(0.0), vec3(0.0, 0.0, 1.0), vec3(0.0), 0.0);
    vec4 albedo = texelFetch(rsm_albedo, pixel, 0);
    if (albedo.a <= 0.0) {
        return t;
    }
    float depth = texelFetch(rsm_depth, pixel, 0).r;
    vec2 xy, low, high;
    if (!rsm_texel_span(v, pixel, xy, low, high)) {
        return t;
    }
    float beam;
    vec3 arriving = light_view_flux(v, light, 0.5 * (low + high), high - low, depth, beam);
    vec4 normals = texelFetch(rsm_normal, pixel, 0);
    vec3 n = octahedral_decode(normals.xy);
    t.position_ws = light_view_position(v, xy, depth);
    t.normal_ws = octahedral_decode(normals.zw);
    vec3 to_light = v.perspective > 0.5 ? normalize(v.origin_ws - t.position_ws) : -v.axis_z;
    float side = dot(t.normal_ws, to_light) < 0.0 ? -1.0 : 1.0; // by which the light leaves
    float cos_g = max(side * dot(t.normal_ws, to_light), GRAZING_COS);
    float cos_s = max(side * dot(n, to_light), 0.0);
    t.area = beam / cos_g;
#if HAS_MEDIUM
    arriving *= medium_transmittance(t.position_ws, to_light, v.perspective > 0.5 ? length(v.origin_ws - t.position_ws) : 1e30);
#endif
    t.flux = arriving * albedo.rgb * (cos_s / cos_g);
    return t;
}
