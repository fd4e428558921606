// Normals from maps and heights. Fragment shaders only: frames come from screen-space derivatives.

// Tangent frame by screen derivatives: C. Schüler, "Normal Mapping Without Precomputed Tangents", ShaderX5, 2006.
vec3 node_normal_map(vec3 color, float strength, vec2 uv, SurfacePoint point)
{
    vec3 n = point.normal_ws;
    vec3 dp1 = dFdx(point.position_ws);
    vec3 dp2 = dFdy(point.position_ws);
    vec2 duv1 = dFdx(uv);
    vec2 duv2 = dFdy(uv);
    vec3 dp2_perp = cross(dp2, n);
    vec3 dp1_perp = cross(n, dp1);
    vec3 t = dp2_perp * duv1.x + dp1_perp * duv2.x;
    vec3 b = dp2_perp * duv1.y + dp1_perp * duv2.y;
    float scale = max(dot(t, t), dot(b, b));
    vec3 local = 2.0 * color - 1.0;
    // The frame's handedness follows the screen's; the cross products above turn with it, so t and b do not.
    float handed = dot(cross(dp1, dp2), n) < 0.0 ? -1.0 : 1.0;
    if (!(scale > 0.0)) {
        return n;
    }
    float inverse = handed * inversesqrt(scale);
    vec3 mapped = safe_normalize(t * inverse * local.x + b * inverse * local.y + n * local.z);
    return safe_normalize(mix(n, mapped, max(strength, 0.0)));
}
vec3 node_normal_map_world(vec3 color, float strength, SurfacePoint point)
{
    return safe_normalize(mix(point.normal_ws, safe_normalize(2.0 * color - 1.0), max(strength, 0.0)));
}
vec3 node_normal_map_object(vec3 color, float strength, SurfacePoint point)
{
    vec3 n = normalize(point.world_from_object_normal * (2.0 * color - 1.0));
    return safe_normalize(mix(point.normal_ws, n, max(strength, 0.0)));
}

// M. Mikkelsen, "Bump Mapping Unparametrized Surfaces on the GPU", JGT 15(1), 2010.
vec3 node_bump(float height, float strength, float distance_, vec3 n, SurfacePoint point)
{
    vec3 dp1 = dFdx(point.position_ws);
    vec3 dp2 = dFdy(point.position_ws);
    vec3 r1 = cross(dp2, n);
    vec3 r2 = cross(n, dp1);
    float det = dot(dp1, r1);
    vec3 gradient = (det < 0.0 ? -1.0 : 1.0) * (dFdx(height) * r1 + dFdy(height) * r2);
    vec3 bumped = safe_normalize(abs(det) * n - distance_ * gradient);
    return safe_normalize(mix(n, bumped, max(strength, 0.0)));
}

// Along a UV map's u, by screen derivatives.
vec3 node_tangent_uv(vec2 uv, SurfacePoint point)
{
    vec3 n = point.normal_ws;
    vec3 dp1 = dFdx(point.position_ws);
    vec3 dp2 = dFdy(point.position_ws);
    float handed = dot(cross(dp1, dp2), n) < 0.0 ? -1.0 : 1.0;
    return handed * safe_normalize(cross(dp2, n) * dFdx(uv.x) + cross(n, dp1) * dFdy(uv.x));
}
