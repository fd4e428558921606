// A point of a surface as material functions see it.

#include "lib/closure_lib.glsl"

struct SurfacePoint {
    vec3 position_ws;
    vec3 position_os;
    vec3 position_vs;
    vec3 generated;              // position in the mesh's own box, [0, 1]³
    vec3 normal_ws;              // shading normal, on the side that is looked at
    vec3 normal_os;
    vec3 geometric_normal_ws;    // of the triangle, on the side that is looked at
    vec3 view_ws;                // towards the eye (or light) that looks
    float backfacing;
    vec2 window;
    vec3 object_location;
    vec4 object_color;
    float object_index;
    float object_random;
    mat3 world_from_object_normal;
    mat3 world_from_object;
};

// A material's own normal, kept a unit vector on the visible side of the triangle.
vec3 surface_normal(SurfacePoint point, vec3 n)
{
    n = safe_normalize(n);
    return dot(n, n) > 0.5 ? n : point.normal_ws;
}

SurfacePoint surface_point_of_world(vec3 direction_ws)
{
    return SurfacePoint(direction_ws, direction_ws, direction_ws, direction_ws, -direction_ws, -direction_ws,
                        -direction_ws, -direction_ws, 0.0, vec2(0.0), vec3(0.0), vec4(1.0), 0.0, 0.0,
                        mat3(1.0), mat3(1.0));
}
