// Blender's colour nodes: blend modes (factor, base, blend), HSV and HSL, gamma, tables.

vec3 rgb_to_hsv(vec3 c)
{
    float high = max3(c);
    float low = min3(c);
    float range = high - low;
    if (range <= 0.0) {
        return vec3(0.0, 0.0, high);
    }
    float h = c.r == high ? (c.g - c.b) / range : c.g == high ? 2.0 + (c.b - c.r) / range : 4.0 + (c.r - c.g) / range;
    return vec3(fract(h / 6.0 + 1.0), high != 0.0 ? range / high : 0.0, high);
}
vec3 hsv_to_rgb(vec3 c)
{
    vec3 k = saturate(abs(fract(c.x + vec3(1.0, 2.0 / 3.0, 1.0 / 3.0)) * 6.0 - 3.0) - 1.0);
    return c.z * mix(vec3(1.0), k, c.y);
}
vec3 rgb_to_hsl(vec3 c)
{
    float high = max3(c);
    float low = min3(c);
    float l = 0.5 * (high + low);
    float range = high - low;
    if (range <= 0.0) {
        return vec3(0.0, 0.0, l);
    }
    return vec3(rgb_to_hsv(c).x, l > 0.5 ? range / (2.0 - high - low) : range / (high + low), l);
}
vec3 hsl_to_rgb(vec3 c)
{
    vec3 k = saturate(abs(fract(c.x + vec3(1.0, 2.0 / 3.0, 1.0 / 3.0)) * 6.0 - 3.0) - 1.0);
    return c.z + (k - 0.5) * (1.0 - abs(2.0 * c.z - 1.0)) * c.y;
}

#define PER_CHANNEL(NAME)                                                                                              \
    vec3 NAME(float f, vec3 a, vec3 b)                                                                                 \
    {                                                                                                                  \
        return vec3(NAME(f, a.r, b.r), NAME(f, a.g, b.g), NAME(f, a.b, b.b));                                          \
    }
vec3 blend_mix(float f, vec3 a, vec3 b) { return mix(a, b, f); }
vec3 blend_add(float f, vec3 a, vec3 b) { return mix(a, a + b, f); }
vec3 blend_subtract(float f, vec3 a, vec3 b) { return mix(a, a - b, f); }
vec3 blend_multiply(float f, vec3 a, vec3 b) { return mix(a, a * b, f); }
vec3 blend_screen(float f, vec3 a, vec3 b) { return 1.0 - (1.0 - f + f * (1.0 - b)) * (1.0 - a); }
vec3 blend_darken(float f, vec3 a, vec3 b) { return mix(a, min(a, b), f); }
vec3 blend_lighten(float f, vec3 a, vec3 b) { return mix(a, max(a, b), f); }
vec3 blend_difference(float f, vec3 a, vec3 b) { return mix(a, abs(a - b), f); }
vec3 blend_exclusion(float f, vec3 a, vec3 b) { return max(mix(a, a + b - 2.0 * a * b, f), vec3(0.0)); }
float blend_divide(float f, float a, float b) { return b != 0.0 ? (1.0 - f) * a + f * a / b : a; }
PER_CHANNEL(blend_divide)
float blend_overlay(float f, float a, float b)
{
    return a < 0.5 ? a * (1.0 - f + 2.0 * f * b) : 1.0 - (1.0 - f + 2.0 * f * (1.0 - b)) * (1.0 - a);
}
PER_CHANNEL(blend_overlay)
float blend_dodge(float f, float a, float b)
{
    if (a == 0.0) {
        return a;
    }
    float d = 1.0 - f * b;
    return d <= 0.0 ? 1.0 : min(a / d, 1.0);
}
PER_CHANNEL(blend_dodge)
float blend_burn(float f, float a, float b)
{
    float d = 1.0 - f + f * b;
    return d <= 0.0 ? 0.0 : saturate(1.0 - (1.0 - a) / d);
}
PER_CHANNEL(blend_burn)
vec3 blend_soft_light(float f, vec3 a, vec3 b)
{
    vec3 s = 1.0 - (1.0 - b) * (1.0 - a);
    return (1.0 - f) * a + f * ((1.0 - a) * b * a + a * s);
}
vec3 blend_linear_light(float f, vec3 a, vec3 b) { return a + f * (2.0 * b - 1.0); }
vec3 blend_hue(float f, vec3 a, vec3 b)
{
    vec3 hsv = rgb_to_hsv(b);
    if (hsv.y == 0.0) {
        return a;
    }
    vec3 base = rgb_to_hsv(a);
    return mix(a, hsv_to_rgb(vec3(hsv.x, base.yz)), f);
}
vec3 blend_saturation(float f, vec3 a, vec3 b)
{
    vec3 base = rgb_to_hsv(a);
    if (base.y == 0.0) {
        return a;
    }
    return hsv_to_rgb(vec3(base.x, mix(base.y, rgb_to_hsv(b).y, f), base.z));
}
vec3 blend_value(float f, vec3 a, vec3 b)
{
    vec3 base = rgb_to_hsv(a);
    return hsv_to_rgb(vec3(base.xy, mix(base.z, rgb_to_hsv(b).z, f)));
}
vec3 blend_color(float f, vec3 a, vec3 b)
{
    vec3 hsv = rgb_to_hsv(b);
    if (hsv.y == 0.0) {
        return a;
    }
    return mix(a, hsv_to_rgb(vec3(hsv.xy, rgb_to_hsv(a).z)), f);
}

vec3 node_gamma(vec3 c, float g)
{
    if (g == 0.0) {
        return vec3(1.0);
    }
    return vec3(c.r > 0.0 ? pow(c.r, g) : c.r, c.g > 0.0 ? pow(c.g, g) : c.g, c.b > 0.0 ? pow(c.b, g) : c.b);
}

vec3 node_hue_saturation(float hue, float saturation, float value, float factor, vec3 color)
{
    vec3 hsv = rgb_to_hsv(color);
    hsv.x = fract(hsv.x + hue + 0.5);
    hsv.y = saturate(hsv.y * saturation);
    hsv.z *= value;
    return max(mix(color, hsv_to_rgb(hsv), factor), vec3(0.0));
}

// A table of `count` rows of four in the parameters, from index `first`, over [0, 1]: interpolated, in steps, or
// interpolated and straight on beyond its ends.
#define TABLE_LINEAR 0
#define TABLE_CONSTANT 1
#define TABLE_EXTEND 2
vec4 table_row(int first, int i)
{
    int k = first + 4 * i;
    return vec4(material_param(k), material_param(k + 1), material_param(k + 2), material_param(k + 3));
}
vec4 node_table(int first, int count, float t, int mode)
{
    float x = (mode == TABLE_EXTEND ? t : saturate(t)) * float(count - 1);
    int i = clamp(int(x), 0, mode == TABLE_CONSTANT ? count - 1 : max(count - 2, 0));
    vec4 a = table_row(first, i);
    if (mode == TABLE_CONSTANT) {
        return a;
    }
    return mix(a, table_row(first, min(i + 1, count - 1)), x - float(i));
}
