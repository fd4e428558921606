// The SurfacePoint of a fragment, looked at from `view_ws`; then the material's closure and its coverage.

#include "lib/view_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "generated/material.glsl"

in vec3 vary_position_ws;
in vec3 vary_normal_ws;
in float vary_height;
in vec3 vary_relative_ws;
#if SURFACE_OBJECT_SPACE
in vec3 vary_position_os;
in vec3 vary_normal_os;
in vec3 vary_generated;
flat in vec4 vary_color;
flat in vec2 vary_info;
flat in vec3 vary_location;
flat in mat3 vary_world_from_object;
#endif

SurfacePoint surface_point(vec3 view_ws)
{
    SurfacePoint p;
    p.position_ws = vary_position_ws;
    p.view_ws = view_ws;
    vec3 ng = safe_normalize(cross(dFdx(vary_position_ws), dFdy(vary_position_ws)));
    vec3 n = safe_normalize(vary_normal_ws);
    // Which side of the triangle is seen: the geometric normal is turned to the eye, the shading normal goes with the
    // triangle's front, which is where its own normals point.
    ng = dot(ng, view_ws) < 0.0 ? -ng : ng;
    p.backfacing = dot(n, ng) < 0.0 ? 1.0 : 0.0;
    n = p.backfacing > 0.5 ? -n : n;
    if (dot(ng, ng) < 0.5) {
        ng = dot(n, view_ws) < 0.0 ? -n : n;
    }
    p.geometric_normal_ws = ng;
    p.normal_ws = dot(n, n) > 0.5 ? n : ng;
    p.window = (gl_FragCoord.xy - float(view.margin)) / (view.resolution - 2.0 * float(view.margin));
    p.position_vs = vec3(1.0, 1.0, -1.0) * (view.view_from_world * vec4(vary_position_ws, 1.0)).xyz;
#if SURFACE_OBJECT_SPACE
    p.position_os = vary_position_os;
    p.normal_os = safe_normalize(vary_normal_os) * (1.0 - 2.0 * p.backfacing);
    p.generated = vary_generated;
    p.object_location = vary_location;
    p.object_color = vary_color;
    p.object_index = vary_info.x;
    p.object_random = vary_info.y;
    p.world_from_object = vary_world_from_object;
    p.world_from_object_normal = normal_matrix(vary_world_from_object);
#else
    p.position_os = p.normal_os = p.generated = p.object_location = vec3(0.0);
    p.object_color = vec4(1.0);
    p.object_index = p.object_random = 0.0;
    p.world_from_object_normal = p.world_from_object = mat3(1.0);
#endif
    return p;
}

// How far the smooth surface that the vertex normals suggest stands above the triangle, along the normal; 0 where it is
// flat or hollow. Moving the point to each vertex's tangent plane by its weight rises by Σ wᵢ (vᵢ − p)·nᵢ, and half of
// that is the quadratic arc through the vertices (T. Boubekeur and M. Alexa, "Phong Tessellation", SIGGRAPH Asia 2008,
// with α = ½, which is exact for spheres). The sum is Σ wᵢ vᵢ·nᵢ − p·Σ wᵢ nᵢ: both interpolate.
float surface_bulge() { return max(0.5 * (vary_height - dot(vary_relative_ws, vary_normal_ws)), 0.0); }

// How much of the surface stops a ray: what is neither cut out nor see-through. Refracting surfaces count as
// see-through to the maps that only ask what blocks light (SURFACE_SEE_THROUGH_GLASS), by their brightest channel where the
// map also knows the tint of what passes (2).
float surface_opacity(Closure c)
{
#if SURFACE_SEEN_BY_CAMERA
    float through = max3(c.transparent);
    // What refracts or scatters on is shaded with its tint, and by the brightest channel no tint is over 1: behind many
    // panes or leaves the product of tints would be rare and huge. To light, what scatters on is as solid as paper.
    // Rough glass may pass all and reflect besides: then what it reflects has its part of the sub-frames by its weight, and the
    // tint makes up for it.
    float passing = max3(c.transmission + c.translucent);
    float reflected = max3(c.f0 + c.diffuse);
    through += min(passing, (1.0 - through) * passing / max(passing + reflected, 1e-6));
#elif SURFACE_SEE_THROUGH_GLASS > 1
    float through = max3(c.transparent + c.transmission);
#elif SURFACE_SEE_THROUGH_GLASS
    float through = vector_mean(c.transparent) + vector_mean(c.transmission);
#else
    float through = vector_mean(c.transparent);
#endif
    return saturate(1.0 - through);
}

// Stochastic coverage: over the sub-frames a surface of opacity a is there in a share a of them, stratified, with an
// offset per pixel and depth so that layers don't line up.
bool surface_is_there(float opacity, uint salt)
{
    if (opacity >= 1.0) {
        return true;
    }
    uint pixel = hash_u32(uvec3(uvec2(ivec2(gl_FragCoord.xy) + view.pixel_offset), salt));
    uint depth = floatBitsToUint(gl_FragCoord.z) & 0xFFFFF000u;
    float offset = unit_float(hash_u32(uvec2(pixel, depth)));
    float threshold = fract(sobol_2d(view.subframe, 5u).x + offset);
    return threshold < opacity;
}
