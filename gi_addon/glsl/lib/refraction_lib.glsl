// The eye's ray through a refracting surface: bent where it enters and where it leaves (C. Wyman, "An Approximate Image-Space
// Approach for Interactive Refraction", SIGGRAPH 2005: the way inside is as long as the object is deep along the view ray).
// Included after view_lib, bsdf_lib and sequence_lib, where the layers of translucent surfaces are read.

struct RefractedRay {
    bool passes;        // false: totally reflected, or below the surface: no light this way
    vec3 position_ws;   // where it leaves
    vec3 direction;     // outside again, a unit vector
    vec3 leaving;       // geometric normal of the side it leaves by, away from the object
};

// The surface at `pixel`, of view depth `depth`; `u` in [0, 1)² picks one of its visible normals. What is no deeper than
// `thinnest` (m) is a sheet: it bends once.
RefractedRay refracted_ray(ivec2 pixel, float depth, vec2 u, float thinnest)
{
    vec2 uv = (vec2(pixel) + 0.5) * view.inverse_resolution;
    float eta = texelFetch(translucent_medium, pixel, 0).r;
    vec4 normals = texelFetch(translucent_normal, pixel, 0);
    vec3 ng = octahedral_decode(normals.zw);
    vec3 eye = view_direction_ws(uv);
    mat3 frame = frame_from_normal(octahedral_decode(normals.xy));
    vec3 v = eye * frame;
    v = normalize(vec3(v.xy, max(v.z, 1e-3)));
    float alpha = max(sqr(texelFetch(translucent_color, pixel, 0).a), ALPHA_MIN);
    vec3 direction = refract(-eye, frame * ggx_sample_visible_normal(v, alpha, u), 1.0 / eta);
    bool passes = dot(direction, direction) > 0.5 && dot(direction, ng) < 0.0;
    vec3 position_ws = position_ws_from_depth(uv, depth);
    vec3 leaving = -ng;
    float thickness = (texelFetch(translucent_back_depth, pixel, 0).r - depth) * length(ray_direction_ws(uv));
    if (passes && thickness > thinnest) {
        position_ws += direction * thickness;
        ivec2 there = clamp(ivec2(project_ws(position_ws).xy * view.resolution), ivec2(0), ivec2(view.resolution) - 1);
        there = texelFetch(translucent_back_depth, there, 0).r > 0.0 ? there : pixel;
        // Normals face the eye: the way out is against them. A totally reflected ray is let through.
        vec4 far_normals = texelFetch(translucent_back_normal, there, 0);
        vec3 out_n = -octahedral_decode(far_normals.xy);
        leaving = -octahedral_decode(far_normals.zw);
        vec3 outside = refract(direction, dot(direction, out_n) > 0.0 ? -out_n : out_n, eta);
        direction = dot(outside, outside) > 0.5 ? outside : direction;
    }
    return RefractedRay(passes, position_ws, direction, leaving);
}
