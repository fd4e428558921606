// Blender's Math and Vector Math nodes where GLSL's own functions differ.

float safe_modulo(float a, float b) { return b != 0.0 ? a - b * trunc(a / b) : 0.0; }
vec3 safe_modulo(vec3 a, vec3 b) { return vec3(safe_modulo(a.x, b.x), safe_modulo(a.y, b.y), safe_modulo(a.z, b.z)); }
float safe_floored_modulo(float a, float b) { return b != 0.0 ? a - b * floor(a / b) : 0.0; }

float safe_pow(float a, float b)
{
    if (b == 0.0) {
        return 1.0;
    }
    if (a < 0.0) {
        float rounded = floor(b + 0.5);
        if (rounded != b) {
            return 0.0;
        }
        return (safe_modulo(abs(rounded), 2.0) == 1.0 ? -1.0 : 1.0) * pow(-a, b);
    }
    return a == 0.0 ? 0.0 : pow(a, b);
}
vec3 safe_pow(vec3 a, vec3 b) { return vec3(safe_pow(a.x, b.x), safe_pow(a.y, b.y), safe_pow(a.z, b.z)); }

float safe_log(float a, float base)
{
    if (a <= 0.0 || base <= 0.0) {
        return 0.0;
    }
    return safe_divide(log(a), log(base));
}
float safe_inversesqrt(float a) { return a > 0.0 ? inversesqrt(a) : 0.0; }

float smooth_min(float a, float b, float c)
{
    if (c == 0.0) {
        return min(a, b);
    }
    float h = max(c - abs(a - b), 0.0) / c;
    return min(a, b) - h * h * h * c / 6.0;
}

float node_wrap(float value, float high, float low)
{
    float range = high - low;
    return range != 0.0 ? value - range * floor((value - low) / range) : low;
}
vec3 node_wrap(vec3 v, vec3 high, vec3 low)
{
    return vec3(node_wrap(v.x, high.x, low.x), node_wrap(v.y, high.y, low.y), node_wrap(v.z, high.z, low.z));
}

float node_pingpong(float a, float b) { return b != 0.0 ? abs(fract((a - b) / (b * 2.0)) * b * 2.0 - b) : 0.0; }

vec3 node_project(vec3 a, vec3 b)
{
    float l = dot(b, b);
    return l != 0.0 ? dot(a, b) / l * b : vec3(0.0);
}

float node_clamp_range(float v, float a, float b) { return clamp(v, min(a, b), max(a, b)); }
vec3 node_clamp_range(vec3 v, vec3 a, vec3 b) { return clamp(v, min(a, b), max(a, b)); }

float node_map_range_linear(float v, float a, float b, float c, float d, float steps)
{
    return c + safe_divide(v - a, b - a) * (d - c);
}
float node_map_range_stepped(float v, float a, float b, float c, float d, float steps)
{
    float t = safe_divide(v - a, b - a);
    t = steps > 0.0 ? floor(t * (steps + 1.0)) / steps : 0.0;
    return c + t * (d - c);
}
float node_map_range_smoothstep(float v, float a, float b, float c, float d, float steps)
{
    float t = a > b ? 1.0 - saturate(safe_divide(v - b, a - b)) : saturate(safe_divide(v - a, b - a));
    return c + t * t * (3.0 - 2.0 * t) * (d - c);
}
float node_map_range_smootherstep(float v, float a, float b, float c, float d, float steps)
{
    float t = a > b ? 1.0 - saturate(safe_divide(v - b, a - b)) : saturate(safe_divide(v - a, b - a));
    return c + t * t * t * (t * (t * 6.0 - 15.0) + 10.0) * (d - c);
}
#define VECTOR_MAP_RANGE(NAME)                                                                                         \
    vec3 NAME(vec3 v, vec3 a, vec3 b, vec3 c, vec3 d, vec3 s)                                                          \
    {                                                                                                                  \
        return vec3(NAME(v.x, a.x, b.x, c.x, d.x, s.x), NAME(v.y, a.y, b.y, c.y, d.y, s.y),                            \
                    NAME(v.z, a.z, b.z, c.z, d.z, s.z));                                                               \
    }
VECTOR_MAP_RANGE(node_map_range_linear)
VECTOR_MAP_RANGE(node_map_range_stepped)
VECTOR_MAP_RANGE(node_map_range_smoothstep)
VECTOR_MAP_RANGE(node_map_range_smootherstep)

mat3 euler_xyz(vec3 r)
{
    vec3 c = cos(r);
    vec3 s = sin(r);
    return mat3(c.y * c.z, c.y * s.z, -s.y, s.x * s.y * c.z - c.x * s.z, s.x * s.y * s.z + c.x * c.z, s.x * c.y,
                c.x * s.y * c.z + s.x * s.z, c.x * s.y * s.z - s.x * c.z, c.x * c.y);
}
vec3 node_mapping_point(vec3 v, vec3 location, vec3 rotation, vec3 scale)
{
    return euler_xyz(rotation) * (v * scale) + location;
}
vec3 node_mapping_texture(vec3 v, vec3 location, vec3 rotation, vec3 scale)
{
    return safe_divide(transpose(euler_xyz(rotation)) * (v - location), scale);
}
vec3 node_mapping_vector(vec3 v, vec3 location, vec3 rotation, vec3 scale) { return euler_xyz(rotation) * (v * scale); }
vec3 node_mapping_normal(vec3 v, vec3 location, vec3 rotation, vec3 scale)
{
    return safe_normalize(euler_xyz(rotation) * safe_divide(v, scale));
}

// Around an axis by an angle (O. Rodrigues); the zero axis turns nothing.
vec3 node_rotate(vec3 v, vec3 center, vec3 axis, float angle)
{
    axis = safe_normalize(axis);
    if (dot(axis, axis) == 0.0) {
        return v;
    }
    vec3 p = v - center;
    float c = cos(angle);
    return p * c + cross(axis, p) * sin(angle) + axis * (dot(axis, p) * (1.0 - c)) + center;
}
