// Image and environment look-ups, and checker.

vec3 srgb_decode(vec3 c)
{
    return mix(pow((c + 0.055) / 1.055, vec3(2.4)), c / 12.92, vec3(lessThanEqual(c, vec3(0.04045))));
}

// encoded: the texels are sRGB bytes, decoded after they are filtered, as Cycles does.
// extension: 0 repeat, 1 extend, 2 clip, 3 mirror, 4 clip between texels.

// What is left of a clipped look-up: texels outside are nothing, so the outermost fade over their own width.
float image_coverage(vec2 uv, vec2 size, int extension)
{
    if (extension == 2) {
        vec2 inside = clamp(uv * size + 0.5, 0.0, 1.0) * clamp((1.0 - uv) * size + 0.5, 0.0, 1.0);
        return inside.x * inside.y;
    }
    return extension == 4 && (any(lessThan(uv, vec2(0.0))) || any(greaterThan(uv, vec2(1.0)))) ? 0.0 : 1.0;
}

// Sub-frames average the picture's lookups, so each may be sharper; maps are kept, also when the number of sub-frames changes, and
// show the mean over their texels.
#define IMAGE_LOD_BIAS (view.lod_bias * float(SURFACE_SEEN_BY_CAMERA))

vec4 node_image(sampler2D image, vec2 uv, int encoded, int extension)
{
    if (extension == 3) {
        vec2 f = fract(uv * 0.5) * 2.0;
        uv = 1.0 - abs(1.0 - f);
    }
#if SURFACE_IMPLICIT_LOD
    vec4 c = texture(image, uv, IMAGE_LOD_BIAS);
#else
    vec4 c = textureLod(image, uv, 0.0);
#endif
    if (encoded != 0) {
        c.rgb = srgb_decode(c.rgb);
    }
    return c * image_coverage(uv, vec2(textureSize(image, 0)), extension);
}

// Cubic B-spline by four bilinear taps: C. Sigg and M. Hadwiger, "Fast Third-Order Texture Filtering", GPU Gems 2, 2005.
// Where texels are smaller than pixels the mipmaps' mean is as smooth.
vec4 node_image_cubic(sampler2D image, vec2 uv, int encoded, int extension)
{
#if SURFACE_IMPLICIT_LOD
    vec4 plain = node_image(image, uv, encoded, extension);
    if (textureQueryLod(image, uv).x > 0.0) {
        return plain;
    }
#endif
    vec2 size = vec2(textureSize(image, 0));
    vec2 at = (extension == 3 ? 1.0 - abs(1.0 - fract(uv * 0.5) * 2.0) : uv) * size - 0.5;
    vec2 f = fract(at);
    at -= f;
    vec2 w0 = (1.0 - f) * (1.0 - f) * (1.0 - f) / 6.0;
    vec2 w1 = 2.0 / 3.0 - 0.5 * f * f * (2.0 - f);
    vec2 w2 = 2.0 / 3.0 - 0.5 * (1.0 - f) * (1.0 - f) * (1.0 + f);
    vec2 w3 = f * f * f / 6.0;
    vec2 low = (at - 0.5 + w1 / (w0 + w1)) / size;
    vec2 high = (at + 1.5 + w3 / (w2 + w3)) / size;
    vec2 share = w2 + w3;
    vec4 bottom = mix(textureLod(image, low, 0.0), textureLod(image, vec2(high.x, low.y), 0.0), share.x);
    vec4 top = mix(textureLod(image, vec2(low.x, high.y), 0.0), textureLod(image, high, 0.0), share.x);
    vec4 c = mix(bottom, top, share.y);
    if (encoded != 0) {
        c.rgb = srgb_decode(c.rgb);
    }
    return c * image_coverage(uv, size, extension);
}

// Around a seam in u, where a coordinate jumps by one: derivatives of the two ways around, the smaller of them counts.
vec4 node_image_around(sampler2D image, vec2 uv, int encoded, int extension)
{
#if SURFACE_IMPLICIT_LOD
    float other = fract(uv.x + 0.5);
    vec2 dx = dFdx(uv);
    vec2 dy = dFdy(uv);
    dx.x = abs(dFdx(other)) < abs(dx.x) ? dFdx(other) : dx.x;
    dy.x = abs(dFdy(other)) < abs(dy.x) ? dFdy(other) : dy.x;
    float sharper = exp2(IMAGE_LOD_BIAS);
    vec4 c = textureGrad(image, uv, dx * sharper, dy * sharper);
    if (encoded != 0) {
        c.rgb = srgb_decode(c.rgb);
    }
    return c * image_coverage(uv, vec2(textureSize(image, 0)), extension);
#else
    return node_image(image, uv, encoded, extension);
#endif
}

// UDIM tiles lie in one image as they do in UV space; `grid` is (first column, first row, columns, rows). Beyond them is
// Blender's magenta.
vec4 node_image_tiled(sampler2D image, vec2 uv, vec4 grid, int encoded)
{
    vec2 at = (uv - grid.xy) / grid.zw;
    vec4 c = node_image(image, at, encoded, 1);
    return any(lessThan(at, vec2(0.0))) || any(greaterThanEqual(at, vec2(1.0))) ? vec4(1.0, 0.0, 1.0, 1.0) : c;
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
