// The Sky Texture: an image of the atmosphere (gi_addon/materials/sky.py) turned to the sun, and the sun's disc.

vec3 node_sky(sampler2D image, vec3 d, float elevation, float rotation, float size, vec3 sun_low, vec3 sun_high, int disc)
{
    d = safe_normalize(d);
    float e = asin(clamp(d.z, -1.0, 1.0));
    vec2 uv = vec2(fract((-atan(d.y, d.x) - 0.5 * PI - rotation) / TAU),
                   0.5 + 0.5 * sign(e) * sqrt(abs(e) / (0.5 * PI)));
    vec3 radiance = textureLod(image, uv, 0.0).rgb;
    if (disc != 0 && size > 0.0) {
        vec3 sun = vec3(cos(elevation) * sin(rotation), cos(elevation) * cos(rotation), sin(elevation));
        // The arc by its chord: an arc cosine has no digits left at such small angles.
        float r = 2.0 * asin(min(0.5 * distance(d, sun), 1.0)) / (0.5 * size);
        if (r < 1.0 && e > -1e-3) {
            float darkening = 1.0 - 0.6 * (1.0 - sqrt(1.0 - r * r));
            radiance += mix(sun_low, sun_high, (e - elevation) / size + 0.5) * darkening;
        }
    }
    return radiance;
}
