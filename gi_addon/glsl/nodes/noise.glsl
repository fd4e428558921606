// Blender's Noise texture: gradient noise (K. Perlin, "Improving Noise", SIGGRAPH 2002) in 1 to 4 dimensions with the
// lookup3 hash, and the fractals of F. K. Musgrave (Ebert et al., "Texturing & Modeling", ch. 16) made of it.

#include "nodes/hash.glsl"

float fade(float t) { return t * t * t * (t * (t * 6.0 - 15.0) + 10.0); }
vec2 fade(vec2 t) { return t * t * t * (t * (t * 6.0 - 15.0) + 10.0); }
vec3 fade(vec3 t) { return t * t * t * (t * (t * 6.0 - 15.0) + 10.0); }
vec4 fade(vec4 t) { return t * t * t * (t * (t * 6.0 - 15.0) + 10.0); }

float negate_if(float v, uint bit) { return bit != 0u ? -v : v; }

float noise_gradient(float p, int cell)
{
    uint h = lookup3(uint(cell)) & 15u;
    return negate_if(float(1u + (h & 7u)), h & 8u) * p;
}
float noise_gradient(vec2 p, ivec2 cell)
{
    uint h = lookup3(uvec2(cell)) & 7u;
    return negate_if(h < 4u ? p.x : p.y, h & 1u) + negate_if(2.0 * (h < 4u ? p.y : p.x), h & 2u);
}
float noise_gradient(vec3 p, ivec3 cell)
{
    uint h = lookup3(uvec3(cell)) & 15u;
    float v = h < 4u ? p.y : h == 12u || h == 14u ? p.x : p.z;
    return negate_if(h < 8u ? p.x : p.y, h & 1u) + negate_if(v, h & 2u);
}
float noise_gradient(vec4 p, ivec4 cell)
{
    uint h = lookup3(uvec4(cell)) & 31u;
    return negate_if(h < 24u ? p.x : p.y, h & 1u) + negate_if(h < 16u ? p.y : p.z, h & 2u) +
           negate_if(h < 8u ? p.z : p.w, h & 4u);
}

// One plane of corners, and a cube of them, of the higher dimensions.
float noise_face(vec3 f, ivec3 c, vec2 u)
{
    float low = mix(noise_gradient(f, c), noise_gradient(f - vec3(1, 0, 0), c + ivec3(1, 0, 0)), u.x);
    float high = mix(noise_gradient(f - vec3(0, 1, 0), c + ivec3(0, 1, 0)),
                     noise_gradient(f - vec3(1, 1, 0), c + ivec3(1, 1, 0)), u.x);
    return mix(low, high, u.y);
}
float noise_face(vec4 f, ivec4 c, vec2 u)
{
    float low = mix(noise_gradient(f, c), noise_gradient(f - vec4(1, 0, 0, 0), c + ivec4(1, 0, 0, 0)), u.x);
    float high = mix(noise_gradient(f - vec4(0, 1, 0, 0), c + ivec4(0, 1, 0, 0)),
                     noise_gradient(f - vec4(1, 1, 0, 0), c + ivec4(1, 1, 0, 0)), u.x);
    return mix(low, high, u.y);
}
float noise_cube(vec4 f, ivec4 c, vec3 u)
{
    return mix(noise_face(f, c, u.xy), noise_face(f - vec4(0, 0, 1, 0), c + ivec4(0, 0, 1, 0), u.xy), u.z);
}

// Noise in about [−1, 1]; the factors bring each dimension's range there.
float perlin(float p)
{
    float cell = floor(p);
    float f = p - cell;
    int c = int(cell);
    return 0.2500 * mix(noise_gradient(f, c), noise_gradient(f - 1.0, c + 1), fade(f));
}
float perlin(vec2 p)
{
    vec2 cell = floor(p);
    vec2 f = p - cell;
    vec2 u = fade(f);
    ivec2 c = ivec2(cell);
    float low = mix(noise_gradient(f, c), noise_gradient(f - vec2(1, 0), c + ivec2(1, 0)), u.x);
    float high = mix(noise_gradient(f - vec2(0, 1), c + ivec2(0, 1)), noise_gradient(f - vec2(1, 1), c + ivec2(1, 1)), u.x);
    return 0.6616 * mix(low, high, u.y);
}
float perlin(vec3 p)
{
    vec3 cell = floor(p);
    vec3 f = p - cell;
    vec3 u = fade(f);
    ivec3 c = ivec3(cell);
    return 0.9820 * mix(noise_face(f, c, u.xy), noise_face(f - vec3(0, 0, 1), c + ivec3(0, 0, 1), u.xy), u.z);
}
float perlin(vec4 p)
{
    vec4 cell = floor(p);
    vec4 f = p - cell;
    vec4 u = fade(f);
    ivec4 c = ivec4(cell);
    return 0.8344 * mix(noise_cube(f, c, u.xyz), noise_cube(f - vec4(0, 0, 0, 1), c + ivec4(0, 0, 0, 1), u.xyz), u.w);
}

// Blender repeats the noise every 100000 units, where floats run out of fractions.
#define NOISE_SAFE(T)                                                                                                  \
    float safe_noise(T p)                                                                                              \
    {                                                                                                                  \
        return perlin(p - 100000.0 * trunc(p / 100000.0) + 0.5 * step(T(1000000.0), abs(p)));                          \
    }
NOISE_SAFE(float)
NOISE_SAFE(vec2)
NOISE_SAFE(vec3)
NOISE_SAFE(vec4)

// What a Noise node is set to. `most` is the number of octaves after the first, a constant where detail is one.
struct NoiseSettings {
    float detail;
    float roughness;
    float lacunarity;
    float offset;
    float gain;
    int most;
};

// The sums run to `most` and skip what lies beyond the detail: their trip counts are then known to the compiler.
#define NOISE_FRACTALS(T)                                                                                              \
    float noise_fbm(T p, NoiseSettings s, bool normalize_)                                                             \
    {                                                                                                                  \
        float sum = 0.0, amplitude = 1.0, total = 0.0, scale = 1.0;                                                    \
        for (int i = 0; i <= s.most; ++i) {                                                                            \
            if (float(i) <= s.detail) {                                                                                \
                sum += safe_noise(scale * p) * amplitude;                                                              \
                total += amplitude;                                                                                    \
                amplitude *= s.roughness;                                                                              \
                scale *= s.lacunarity;                                                                                 \
            }                                                                                                          \
        }                                                                                                              \
        float rest = fract(s.detail);                                                                                  \
        float low = normalize_ ? 0.5 * sum / total + 0.5 : sum;                                                        \
        if (rest == 0.0) {                                                                                             \
            return low;                                                                                                \
        }                                                                                                              \
        float more = sum + safe_noise(scale * p) * amplitude;                                                          \
        return mix(low, normalize_ ? 0.5 * more / (total + amplitude) + 0.5 : more, rest);                             \
    }                                                                                                                  \
    float noise_multifractal(T p, NoiseSettings s)                                                                     \
    {                                                                                                                  \
        float value = 1.0, amplitude = 1.0;                                                                            \
        for (int i = 0; i <= s.most; ++i) {                                                                            \
            if (float(i) <= s.detail) {                                                                                \
                value *= amplitude * safe_noise(p) + 1.0;                                                              \
                amplitude *= s.roughness;                                                                              \
                p *= s.lacunarity;                                                                                     \
            }                                                                                                          \
        }                                                                                                              \
        float rest = fract(s.detail);                                                                                  \
        return rest == 0.0 ? value : value * (rest * amplitude * safe_noise(p) + 1.0);                                 \
    }                                                                                                                  \
    float noise_hetero_terrain(T p, NoiseSettings s)                                                                   \
    {                                                                                                                  \
        float amplitude = s.roughness;                                                                                 \
        float value = s.offset + safe_noise(p);                                                                        \
        p *= s.lacunarity;                                                                                             \
        for (int i = 1; i <= s.most; ++i) {                                                                            \
            if (float(i) <= s.detail) {                                                                                \
                value += (safe_noise(p) + s.offset) * amplitude * value;                                               \
                amplitude *= s.roughness;                                                                              \
                p *= s.lacunarity;                                                                                     \
            }                                                                                                          \
        }                                                                                                              \
        float rest = fract(s.detail);                                                                                  \
        return rest == 0.0 ? value : value + rest * (safe_noise(p) + s.offset) * amplitude * value;                    \
    }                                                                                                                  \
    float noise_hybrid_multifractal(T p, NoiseSettings s)                                                              \
    {                                                                                                                  \
        float value = 0.0, amplitude = 1.0, weight = 1.0;                                                              \
        for (int i = 0; i <= s.most; ++i) {                                                                            \
            if (float(i) <= s.detail && weight > 0.001) {                                                              \
                weight = min(weight, 1.0);                                                                             \
                float signal = (safe_noise(p) + s.offset) * amplitude;                                                 \
                amplitude *= s.roughness;                                                                              \
                value += weight * signal;                                                                              \
                weight *= s.gain * signal;                                                                             \
                p *= s.lacunarity;                                                                                     \
            }                                                                                                          \
        }                                                                                                              \
        float rest = fract(s.detail);                                                                                  \
        if (rest != 0.0 && weight > 0.001) {                                                                           \
            value += rest * min(weight, 1.0) * (safe_noise(p) + s.offset) * amplitude;                                 \
        }                                                                                                              \
        return value;                                                                                                  \
    }                                                                                                                  \
    float noise_ridged_multifractal(T p, NoiseSettings s)                                                              \
    {                                                                                                                  \
        float amplitude = s.roughness;                                                                                 \
        float signal = s.offset - abs(safe_noise(p));                                                                  \
        signal *= signal;                                                                                              \
        float value = signal;                                                                                          \
        for (int i = 1; i <= s.most; ++i) {                                                                            \
            if (float(i) <= s.detail) {                                                                                \
                p *= s.lacunarity;                                                                                     \
                float weight = clamp(signal * s.gain, 0.0, 1.0);                                                       \
                signal = s.offset - abs(safe_noise(p));                                                                \
                signal *= signal * weight;                                                                             \
                value += signal * amplitude;                                                                           \
                amplitude *= s.roughness;                                                                              \
            }                                                                                                          \
        }                                                                                                              \
        return value;                                                                                                  \
    }                                                                                                                  \
    float noise_fbm_raw(T p, NoiseSettings s) { return noise_fbm(p, s, false); }                                       \
    float noise_fbm_normalized(T p, NoiseSettings s) { return noise_fbm(p, s, true); }
NOISE_FRACTALS(float)
NOISE_FRACTALS(vec2)
NOISE_FRACTALS(vec3)
NOISE_FRACTALS(vec4)

// Seeds by place: an offset in [100, 200] per axis.
float noise_seed(float seed, float kind) { return 100.0 + hash_unit(seed) * 100.0; }
vec2 noise_seed(float seed, vec2 kind)
{
    return 100.0 + 100.0 * vec2(hash_unit(vec2(seed, 0.0)), hash_unit(vec2(seed, 1.0)));
}
vec3 noise_seed(float seed, vec3 kind)
{
    return 100.0 + 100.0 * vec3(hash_unit(vec2(seed, 0.0)), hash_unit(vec2(seed, 1.0)), hash_unit(vec2(seed, 2.0)));
}
vec4 noise_seed(float seed, vec4 kind)
{
    return 100.0 + 100.0 * vec4(hash_unit(vec2(seed, 0.0)), hash_unit(vec2(seed, 1.0)), hash_unit(vec2(seed, 2.0)),
                                hash_unit(vec2(seed, 3.0)));
}
float noise_distort(float p, float d) { return p + safe_noise(p + noise_seed(0.0, p)) * d; }
vec2 noise_distort(vec2 p, float d)
{
    return p + vec2(safe_noise(p + noise_seed(0.0, p)), safe_noise(p + noise_seed(1.0, p))) * d;
}
vec3 noise_distort(vec3 p, float d)
{
    return p + vec3(safe_noise(p + noise_seed(0.0, p)), safe_noise(p + noise_seed(1.0, p)),
                    safe_noise(p + noise_seed(2.0, p))) * d;
}
vec4 noise_distort(vec4 p, float d)
{
    return p + vec4(safe_noise(p + noise_seed(0.0, p)), safe_noise(p + noise_seed(1.0, p)),
                    safe_noise(p + noise_seed(2.0, p)), safe_noise(p + noise_seed(3.0, p))) * d;
}
