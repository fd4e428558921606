// Image and environment look-ups, and checker.

vec3 srgb_decode(vec3 c)
{
    return mix(pow((c + 0.055) / 1.055, vec3(2.4)), c / 12.92, vec3(lessThanEqual(c, vec3(0.04045))));
}

// encoded: the texels are sRGB bytes, decoded after they are filtered, as Cycles does.
// extension: 0 repeat, 1 extend, 2 clip, 3 mirror.
vec4 node_image(sampler2D image, vec2 uv, int encoded, int extension)
{
    if (extension == 3) {
        vec2 f = fract(uv * 0.5) * 2.0;
        uv = 1.0 - abs(1.0 - f);
    }
#if SURFACE_IMPLICIT_LOD
    vec4 c = texture(image, uv, view.lod_bias);
#else
    vec4 c = textureLod(image, uv, 0.0);
#endif
    if (encoded != 0) {
        c.rgb = srgb_decode(c.rgb);
    }
    if (extension == 2 && (any(lessThan(uv, vec2(0.0))) || any(greaterThan(uv, vec2(1.0))))) {
        return vec4(0.0);
    }
    return c;
}

vec4 node_image_box(sampler2D image, vec3 co, vec3 n, float blend, int encoded, int extension)
{
    vec3 w = abs(n) / max(dot(abs(n), vec3(1.0)), 1e-6);
    // Weights of the three sides; `blend` widens the seam between them.
    float limit = 0.5 * (1.0 + blend);
    vec3 weight;
    if (w.x > limit * (w.x + w.y) && w.x > limit * (w.x + w.z)) {
        weight = vec3(1.0, 0.0, 0.0);
    } else if (w.y > limit * (w.x + w.y) && w.y > limit * (w.y + w.z)) {
        weight = vec3(0.0, 1.0, 0.0);
    } else if (w.z > limit * (w.x + w.z) && w.z > limit * (w.y + w.z)) {
        weight = vec3(0.0, 0.0, 1.0);
    } else if (blend > 0.0) {
        float low = 0.5 * (1.0 - blend);
        weight = max(w - low * max3(w), vec3(0.0));
        weight = w * w * w;
        weight /= max(dot(weight, vec3(1.0)), 1e-6);
    } else {
        weight = vec3(greaterThanEqual(w, vec3(max3(w))));
        weight /= dot(weight, vec3(1.0));
    }
    vec4 c = vec4(0.0);
    if (weight.x > 0.0) {
        c += weight.x * node_image(image, n.x < 0.0 ? vec2(1.0 - co.y, co.z) : co.yz, encoded, extension);
    }
    if (weight.y > 0.0) {
        c += weight.y * node_image(image, n.y > 0.0 ? vec2(1.0 - co.x, co.z) : co.xz, encoded, extension);
    }
    if (weight.z > 0.0) {
        c += weight.z * node_image(image, n.z > 0.0 ? vec2(1.0 - co.y, co.x) : co.yx, encoded, extension);
    }
    return c;
}

vec2 node_map_to_sphere(vec3 co)
{
    float l = length(co);
    if (l == 0.0) {
        return vec2(0.0);
    }
    float u = co.x == 0.0 && co.y == 0.0 ? 0.0 : (1.0 - atan(co.x, co.y) * INV_PI) * 0.5;
    return vec2(u, 1.0 - acos(clamp(co.z / l, -1.0, 1.0)) * INV_PI);
}
vec2 node_map_to_tube(vec3 co)
{
    float l = length(co.xy);
    return l > 0.0 ? vec2((1.0 - atan(co.x / l, co.y / l) * INV_PI) * 0.5, (co.z + 1.0) * 0.5) : vec2(0.0);
}
vec2 node_equirect(vec3 d)
{
    d = safe_normalize(d);
    return vec2(-atan(d.y, d.x) / TAU + 0.5, asin(clamp(d.z, -1.0, 1.0)) * INV_PI + 0.5);
}
vec2 node_direction_to_mirror_ball(vec3 d)
{
    d = safe_normalize(d);
    d.y -= 1.0;
    float l = 2.0 * sqrt(max(-0.5 * d.y, 0.0));
    return l > 0.0 ? 0.5 * (d.xz / l + 1.0) : vec2(0.5);
}

float node_checker(vec3 p)
{
    // Cycles nudges the point so that faces at whole coordinates don't flicker.
    p = (p + 0.000001) * 0.999999;
    ivec3 i = abs(ivec3(floor(p)));
    return ((i.x % 2 == i.y % 2) == (i.z % 2 != 0)) ? 1.0 : 0.0;
}
