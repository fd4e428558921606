// Hashes of Blender's textures, bit for bit. R. Jenkins, lookup3 (public domain, 2006): numbers in [0, 1] from the bits of
// one to four floats or integers. Blender ≥ 5.0 hashes Voronoi's cells by M. Jarzynski and M. Olano, "Hash Functions for
// GPU Rendering", JCGT 9(3), 2020 (PCG), on signed integers.

uint rotate_left(uint x, int k) { return (x << k) | (x >> (32 - k)); }

void lookup3_final(inout uint a, inout uint b, inout uint c)
{
    c = (c ^ b) - rotate_left(b, 14);
    a = (a ^ c) - rotate_left(c, 11);
    b = (b ^ a) - rotate_left(a, 25);
    c = (c ^ b) - rotate_left(b, 16);
    a = (a ^ c) - rotate_left(c, 4);
    b = (b ^ a) - rotate_left(a, 14);
    c = (c ^ b) - rotate_left(b, 24);
}

// The start value of a key of n words.
uint lookup3_seed(uint n) { return 0xdeadbeefu + (n << 2) + 13u; }

uint lookup3(uint k)
{
    uint a = lookup3_seed(1u) + k;
    uint b = lookup3_seed(1u);
    uint c = b;
    lookup3_final(a, b, c);
    return c;
}
uint lookup3(uvec2 k)
{
    uint a = lookup3_seed(2u) + k.x;
    uint b = lookup3_seed(2u) + k.y;
    uint c = lookup3_seed(2u);
    lookup3_final(a, b, c);
    return c;
}
uint lookup3(uvec3 k)
{
    uint a = lookup3_seed(3u) + k.x;
    uint b = lookup3_seed(3u) + k.y;
    uint c = lookup3_seed(3u) + k.z;
    lookup3_final(a, b, c);
    return c;
}
uint lookup3(uvec4 k)
{
    uint a = lookup3_seed(4u) + k.x;
    uint b = lookup3_seed(4u) + k.y;
    uint c = lookup3_seed(4u) + k.z;
    a = (a - c) ^ rotate_left(c, 4);
    c += b;
    b = (b - a) ^ rotate_left(a, 6);
    a += c;
    c = (c - b) ^ rotate_left(b, 8);
    b += a;
    a = (a - c) ^ rotate_left(c, 16);
    c += b;
    b = (b - a) ^ rotate_left(a, 19);
    a += c;
    c = (c - b) ^ rotate_left(b, 4);
    b += a;
    a += k.w;
    lookup3_final(a, b, c);
    return c;
}

float unit_from_bits(uint h) { return float(h) * (1.0 / 4294967295.0); }
float hash_unit(float k) { return unit_from_bits(lookup3(floatBitsToUint(k))); }
float hash_unit(vec2 k) { return unit_from_bits(lookup3(floatBitsToUint(k))); }
float hash_unit(vec3 k) { return unit_from_bits(lookup3(floatBitsToUint(k))); }
float hash_unit(vec4 k) { return unit_from_bits(lookup3(floatBitsToUint(k))); }

vec3 hash_color(float k) { return vec3(hash_unit(k), hash_unit(vec2(k, 1.0)), hash_unit(vec2(k, 2.0))); }
vec3 hash_color(vec2 k) { return vec3(hash_unit(k), hash_unit(vec3(k, 1.0)), hash_unit(vec3(k, 2.0))); }
vec3 hash_color(vec3 k) { return vec3(hash_unit(k), hash_unit(vec4(k, 1.0)), hash_unit(vec4(k, 2.0))); }
vec3 hash_color(vec4 k) { return vec3(hash_unit(k), hash_unit(k.zxwy), hash_unit(k.wzyx)); }

const float PCG_UNIT = 1.0 / 2147483647.0;
vec2 pcg_unit(ivec2 k)
{
    ivec2 v = k * 1664525 + 1013904223;
    v.x += v.y * 1664525;
    v.y += v.x * 1664525;
    v ^= v >> 16;
    v.x += v.y * 1664525;
    v.y += v.x * 1664525;
    return vec2(v & 0x7FFFFFFF) * PCG_UNIT;
}
vec3 pcg_unit(ivec3 k)
{
    ivec3 v = k * 1664525 + 1013904223;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v ^= v >> 16;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    return vec3(v & 0x7FFFFFFF) * PCG_UNIT;
}
vec4 pcg_unit(ivec4 k)
{
    ivec4 v = k * 1664525 + 1013904223;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> 16;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return vec4(v & 0x7FFFFFFF) * PCG_UNIT;
}
