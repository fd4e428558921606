// Blender's Gradient, Wave, Magic and Brick textures.

#include "nodes/noise.glsl"

// kind: 0 linear, 1 quadratic, 2 easing, 3 diagonal, 4 radial, 5 quadratic sphere, 6 spherical.
float node_gradient(vec3 p, int kind)
{
    float f = p.x;
    if (kind == 1) {
        f = sqr(max(p.x, 0.0));
    } else if (kind == 2) {
        float r = saturate(p.x);
        f = r * r * (3.0 - 2.0 * r);
    } else if (kind == 3) {
        f = 0.5 * (p.x + p.y);
    } else if (kind == 4) {
        f = atan(p.y, p.x) / TAU + 0.5;
    } else if (kind >= 5) {
        // A point on the unit sphere gives 0, whatever its rounding.
        float r = max(0.999999 - length(p), 0.0);
        f = kind == 5 ? r * r : r;
    }
    return saturate(f);
}

// axis: 0 x, 1 y, 2 z, 3 diagonal or spherical; profile: 0 sine, 1 saw, 2 triangle.
float node_wave(vec3 p, int rings, int axis, int profile, float distortion, NoiseSettings s, float scale, float phase)
{
    p = (p + 0.000001) * 0.999999; // as Blender, off whole coordinates
    float n;
    if (rings != 0) {
        n = length(p * vec3(axis != 0, axis != 1, axis != 2)) * 20.0;
    } else {
        n = axis == 0 ? p.x * 20.0 : axis == 1 ? p.y * 20.0 : axis == 2 ? p.z * 20.0 : (p.x + p.y + p.z) * 10.0;
    }
    n += phase;
    if (distortion != 0.0) {
        n += distortion * (noise_fbm_normalized(p * scale, s) * 2.0 - 1.0);
    }
    if (profile == 0) {
        return 0.5 + 0.5 * sin(n - 0.5 * PI);
    }
    n /= TAU;
    return profile == 1 ? n - floor(n) : abs(n - floor(n + 0.5)) * 2.0;
}

vec3 node_magic(vec3 p, float scale, int depth, float distortion)
{
    p = (p - TAU * trunc(p / TAU)) * 5.0 * scale;
    float x = sin(p.x + p.y + p.z);
    float y = cos(-p.x + p.y - p.z);
    float z = -cos(-p.x - p.y + p.z);
    float d = distortion;
    if (depth > 0) {
        x *= d;
        y *= d;
        z *= d;
        y = -cos(x - y + z) * d;
    }
    x = depth > 1 ? cos(x - y - z) * d : x;
    z = depth > 2 ? sin(-x - y - z) * d : z;
    x = depth > 3 ? -cos(-x + y - z) * d : x;
    y = depth > 4 ? -sin(-x + y + z) * d : y;
    y = depth > 5 ? -cos(-x + y + z) * d : y;
    x = depth > 6 ? cos(x + y + z) * d : x;
    z = depth > 7 ? sin(x + y - z) * d : z;
    x = depth > 8 ? -cos(-x - y + z) * d : x;
    y = depth > 9 ? -sin(x - y + z) * d : y;
    vec3 v = vec3(x, y, z);
    return 0.5 - (d != 0.0 ? v / (2.0 * d) : v);
}

float brick_noise(uint n)
{
    n = (n + 1013u) & 0x7fffffffu;
    n = (n >> 13) ^ n;
    return 0.5 * float((n * (n * n * 60493u + 19990303u) + 1376312589u) & 0x7fffffffu) / 1073741824.0;
}
bool brick_each(int row, int frequency) { return row != frequency * int(floor(float(row) / float(frequency))); }

// (tint, mortar) at p.
vec2 node_brick(vec3 p, float mortar_size, float mortar_smooth, float bias, float width, float row_height, float offset,
                int offset_frequency, float squash, int squash_frequency)
{
    int row = int(floor(p.y / row_height));
    float shift = 0.0;
    if (offset_frequency != 0 && squash_frequency != 0) {
        width *= brick_each(row, squash_frequency) ? 1.0 : squash;
        shift = brick_each(row, offset_frequency) ? 0.0 : width * offset;
    }
    int brick = int(floor((p.x + shift) / width));
    float x = p.x + shift - width * float(brick);
    float y = p.y - row_height * float(row);
    float tint = saturate(brick_noise(uint((row << 16) + (brick & 0xFFFF))) + bias);
    float edge = min(min(x, y), min(width - x, row_height - y));
    float mortar = edge >= mortar_size ? 0.0 : 1.0;
    if (mortar > 0.0 && mortar_smooth != 0.0) {
        float t = saturate((1.0 - edge / mortar_size) / mortar_smooth);
        mortar = t * t * (3.0 - 2.0 * t);
    }
    return vec2(tint, mortar);
}
