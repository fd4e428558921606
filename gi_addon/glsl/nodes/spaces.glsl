// Vectors between world, object and camera space. kind: 0 point, 1 vector, 2 normal. Surfaces only: an object's matrix is
// known from its vertices' interpolants.

vec3 world_from_object(vec3 v, int kind, SurfacePoint point)
{
    if (kind == 2) {
        return point.world_from_object_normal * v;
    }
    return point.world_from_object * v + (kind == 0 ? point.object_location + view.world_origin : vec3(0.0));
}
vec3 object_from_world(vec3 v, int kind, SurfacePoint point)
{
    if (kind == 2) {
        return transpose(point.world_from_object) * v;
    }
    return inverse(point.world_from_object) * (kind == 0 ? v - view.world_origin - point.object_location : v);
}
// Blender's camera space has z away from the camera.
vec3 camera_from_world(vec3 v, int kind, SurfacePoint point)
{
    return vec3(1.0, 1.0, -1.0) * (view.view_from_world * (kind == 0 ? vec4(v - view.world_origin, 1.0) : vec4(v, 0.0))).xyz;
}
vec3 world_from_camera(vec3 v, int kind, SurfacePoint point)
{
    v = vec3(1.0, 1.0, -1.0) * v - (kind == 0 ? view.view_from_world[3].xyz : vec3(0.0));
    return transpose(mat3(view.view_from_world)) * v + (kind == 0 ? view.world_origin : vec3(0.0));
}

// Around an axis through the middle of the object's box.
vec3 node_tangent_radial(int axis, SurfacePoint point)
{
    vec3 g = point.generated - 0.5;
    vec3 t = axis == 0 ? vec3(0.0, -g.z, g.y) : axis == 1 ? vec3(-g.z, 0.0, g.x) : vec3(-g.y, g.x, 0.0);
    t = point.world_from_object * t;
    return safe_normalize(cross(point.normal_ws, safe_normalize(cross(t, point.normal_ws))));
}
