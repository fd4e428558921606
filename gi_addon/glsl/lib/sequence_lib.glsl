// The scrambled Sobol sequence of gi_addon/sequence.py, bit for bit (a test compares them). Sources are named there.

uint hash_u32(uint x)
{
    x ^= x >> 16;
    x *= 0x7FEB352Du;
    x ^= x >> 15;
    x *= 0x846CA68Bu;
    return x ^ (x >> 16);
}

uint hash_u32(uvec2 v) { return hash_u32(v.x ^ hash_u32(v.y + 0x9E3779B9u)); }
uint hash_u32(uvec3 v) { return hash_u32(uvec2(hash_u32(v.xy), v.z)); }

uint owen_scramble(uint x, uint seed)
{
    x = bitfieldReverse(x);
    x ^= x * 0x3D20ADEAu;
    x += seed;
    x *= (seed >> 16) | 1u;
    x ^= x * 0x05526C56u;
    x ^= x * 0x53A22864u;
    return bitfieldReverse(x);
}

float unit_float(uint x) { return float(x >> 8) * (1.0 / 16777216.0); }

// A pixel's own shift of the sequence (R. Cranley and T. Patterson, SIAM J. Numer. Anal. 13, 1976): fract(point + shift).
vec2 unit_shift(uint seed) { return vec2(unit_float(seed), unit_float(hash_u32(seed))); }

// Points in [0, 1)²; `seed` names the purpose.
vec2 sobol_2d(uint index, uint seed)
{
    uint seed0 = hash_u32(seed);
    index = owen_scramble(index, seed0);
    uint x = bitfieldReverse(index);
    uint y = 0u;
    uint v = 1u << 31;
    for (int bit = 0; bit < 32; ++bit) {
        y ^= (index >> bit & 1u) * v;
        v ^= v >> 1;
    }
    return vec2(unit_float(owen_scramble(x, hash_u32(seed0 ^ 0x9E3779B9u))),
                unit_float(owen_scramble(y, hash_u32(seed0 ^ 0x7F4A7C15u))));
}

// The R2 sequence: multiples of 1/g and 1/g², g³ = g + 1, here in units of 2^−32, whose every run is even (M. Roberts, "The
// Unreasonable Effectiveness of Quasirandom Sequences", 2018).
vec2 r2_sequence(uint index)
{
    return vec2(unit_float(index * 3242174889u + 0x80000000u), unit_float(index * 2447445414u + 0x80000000u));
}

// --- warps of the unit square ----------------------------------------------------------------------------------------

// Uniform on the unit disc: P. Shirley and K. Chiu's concentric map, JGT 2(3), 1997.
vec2 warp_disc(vec2 u)
{
    vec2 p = 2.0 * u - 1.0;
    if (p.x == 0.0 && p.y == 0.0) {
        return vec2(0.0);
    }
    float r, phi;
    if (abs(p.x) > abs(p.y)) {
        r = p.x;
        phi = 0.785398163397448 * (p.y / p.x); // π/4
    } else {
        r = p.y;
        phi = 1.5707963267949 - 0.785398163397448 * (p.x / p.y); // π/2 − π/4 · x/y
    }
    return r * vec2(cos(phi), sin(phi));
}

// Cosine-distributed about +z, pdf cosθ/π.
vec3 warp_cosine_hemisphere(vec2 u)
{
    vec2 d = warp_disc(u);
    return vec3(d, sqrt(max(0.0, 1.0 - dot(d, d))));
}
