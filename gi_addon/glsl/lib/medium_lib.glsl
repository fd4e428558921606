// Homogeneous media: Beer and Lambert's law, and the phase function of L. Henyey and J. Greenstein, "Diffuse Radiation in the
// Galaxy", Astrophysical Journal 93, 1941. Included where the uniforms medium_* are declared. A medium fills a cube or a ball of
// a space of its own; the world's fills all of it (a matrix of zeros: every point is the cube's middle), where nothing from
// infinitely far away arrives, as in Cycles. Where media overlap they add up.

bool in_medium(int k, vec3 position_ws)
{
    vec3 p = (medium_unit_from_world[k] * vec4(position_ws, 1.0)).xyz;
    return medium_extinction[k].w > 0.5 ? dot(p, p) <= 1.0 : all(lessThanEqual(abs(p), vec3(1.0)));
}

// Where a ray is inside a box: distances (in, out), out < in if it misses. `direction` need not be a unit vector.
vec2 box_span(vec3 origin, vec3 direction, vec3 low, vec3 high)
{
    vec3 inverse = 1.0 / mix(direction, vec3(1e-30), lessThan(abs(direction), vec3(1e-30)));
    vec3 from = (low - origin) * inverse;
    vec3 to = (high - origin) * inverse;
    vec3 near = min(from, to);
    vec3 far = max(from, to);
    return vec2(max(near.x, max(near.y, near.z)), min(far.x, min(far.y, far.z)));
}

// Where the ray is inside medium k: distances (in, out), out < in if it misses. `direction` need not be a unit vector.
vec2 medium_span(int k, vec3 origin_ws, vec3 direction)
{
    vec3 o = (medium_unit_from_world[k] * vec4(origin_ws, 1.0)).xyz;
    vec3 d = mat3(medium_unit_from_world[k]) * direction;
    if (medium_extinction[k].w > 0.5) {
        float a = max(dot(d, d), 1e-30);
        float b = dot(o, d) / a;
        vec3 nearest = o - b * d;
        float inside = 1.0 - dot(nearest, nearest);
        float half_ = sqrt(max(inside, 0.0) / a);
        return inside > 0.0 ? vec2(-b - half_, -b + half_) : vec2(1.0, -1.0);
    }
    return box_span(o, d, vec3(-1.0), vec3(1.0));
}

// Share of light that is left after `distance` (m) along a unit `direction`; `distance` may be 1e30.
vec3 medium_transmittance(vec3 origin_ws, vec3 direction, float distance)
{
    vec3 depth = vec3(0.0);
    for (int k = 0; k < MEDIA; ++k) {
        vec2 span = medium_span(k, origin_ws, direction);
        depth += medium_extinction[k].rgb * max(min(span.y, distance) - max(span.x, 0.0), 0.0);
    }
    return exp(-depth);
}

// Per sr; `cos_angle` between where the light came from going and where it goes.
float henyey_greenstein(float cos_angle, float g)
{
    float d = 1.0 + g * g - 2.0 * g * cos_angle;
    return (1.0 - g * g) / (12.566370614 * d * sqrt(max(d, 1e-12))); // 4π
}
