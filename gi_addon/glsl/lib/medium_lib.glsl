// A homogeneous medium: Beer and Lambert's law, and the phase function of L. Henyey and J. Greenstein, "Diffuse Radiation
// in the Galaxy", Astrophysical Journal 93, 1941. Included where the uniforms medium_* are declared. The medium fills a box;
// the world's fills all space (a box of ± 1e30), where nothing from infinitely far away arrives, as in Cycles.

// Where the ray is inside the box: distances (in, out), out < in if it misses. `direction` need not be a unit vector.
vec2 medium_span(vec3 origin_ws, vec3 direction)
{
    vec3 inverse = 1.0 / mix(direction, vec3(1e-20), lessThan(abs(direction), vec3(1e-20)));
    vec3 a = (medium_low_ws - origin_ws) * inverse;
    vec3 b = (medium_high_ws - origin_ws) * inverse;
    vec3 near = min(a, b);
    vec3 far = max(a, b);
    return vec2(max(near.x, max(near.y, near.z)), min(far.x, min(far.y, far.z)));
}

// Share of light that is left after `distance` (m) along a unit `direction`; `distance` may be 1e30.
vec3 medium_transmittance(vec3 origin_ws, vec3 direction, float distance)
{
    vec2 span = medium_span(origin_ws, direction);
    return exp(-medium_extinction * max(min(span.y, distance) - max(span.x, 0.0), 0.0));
}

// Per sr; `cos_angle` between where the light came from going and where it goes.
float henyey_greenstein(float cos_angle, float g)
{
    float d = 1.0 + g * g - 2.0 * g * cos_angle;
    return (1.0 - g * g) / (12.566370614 * d * sqrt(max(d, 1e-12))); // 4π
}
