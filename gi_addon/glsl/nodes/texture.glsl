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

// Weights of a box's three sides, as Blender blends them: |n| as barycentric coordinates, whose triangle has a corner per
// side, seams of width `blend` between two and, in the middle, a triangle where all three meet.
vec3 box_weights(vec3 n, float blend)
{
    n = abs(n) / max(dot(abs(n), vec3(1.0)), 1e-6);
    float limit = 0.5 * (1.0 + blend);
    if (n.x > limit * (n.x + n.y) && n.x > limit * (n.x + n.z)) {
        return vec3(1.0, 0.0, 0.0);
    }
    if (n.y > limit * (n.x + n.y) && n.y > limit * (n.y + n.z)) {
        return vec3(0.0, 1.0, 0.0);
    }
    if (n.z > limit * (n.x + n.z) && n.z > limit * (n.y + n.z)) {
        return vec3(0.0, 0.0, 1.0);
    }
    if (blend <= 0.0) {
        return vec3(1.0, 0.0, 0.0);
    }
    float low = 0.5 * (1.0 - blend);
    if (n.z < (1.0 - limit) * (n.y + n.x)) {
        float w = saturate((n.x / (n.x + n.y) - low) / blend);
        return vec3(w, 1.0 - w, 0.0);
    }
    if (n.x < (1.0 - limit) * (n.y + n.z)) {
        float w = saturate((n.y / (n.y + n.z) - low) / blend);
        return vec3(0.0, w, 1.0 - w);
    }
    if (n.y < (1.0 - limit) * (n.x + n.z)) {
        float w = saturate((n.x / (n.x + n.z) - low) / blend);
        return vec3(w, 0.0, 1.0 - w);
    }
    return ((2.0 - limit) * n + (limit - 1.0)) / (2.0 * limit - 1.0);
}

vec4 node_image_box(sampler2D image, vec3 co, vec3 n, float blend, int encoded, int extension)
{
    vec3 weight = box_weights(n, blend);
    // All three are looked up everywhere: derivatives have no meaning where neighbours take other branches.
    vec4 x = node_image(image, vec2(n.x < 0.0 ? 1.0 - co.y : co.y, co.z), encoded, extension);
    vec4 y = node_image(image, vec2(n.y > 0.0 ? 1.0 - co.x : co.x, co.z), encoded, extension);
    vec4 z = node_image(image, vec2(n.z > 0.0 ? 1.0 - co.y : co.y, co.x), encoded, extension);
    return weight.x * x + weight.y * y + weight.z * z;
}

// Blender's sphere and tube stand in the middle of the unit cube of coordinates.
vec2 node_map_to_sphere(vec3 co)
{
    co = 2.0 * co - 1.0;
    float l = length(co);
    if (l == 0.0) {
        return vec2(0.0);
    }
    float u = co.x == 0.0 && co.y == 0.0 ? 0.0 : (1.0 - atan(co.x, co.y) * INV_PI) * 0.5;
    return vec2(u, 1.0 - acos(clamp(co.z / l, -1.0, 1.0)) * INV_PI);
}
vec2 node_map_to_tube(vec3 co)
{
    co = 2.0 * co - 1.0;
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
