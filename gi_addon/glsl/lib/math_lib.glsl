// Small numeric helpers without a physical meaning of their own.

const float PI = 3.14159265358979;
const float INV_PI = 0.318309886183791;
const float TAU = 6.28318530717959;

float saturate(float x) { return clamp(x, 0.0, 1.0); }
vec3 saturate(vec3 x) { return clamp(x, vec3(0.0), vec3(1.0)); }
float sqr(float x) { return x * x; }
float max3(vec3 v) { return max(v.x, max(v.y, v.z)); }
float min3(vec3 v) { return min(v.x, min(v.y, v.z)); }
float vector_mean(vec3 v) { return (v.x + v.y + v.z) / 3.0; }

// Rec.709 luminance (Blender's default scene-linear space).
float luminance(vec3 color) { return dot(color, vec3(0.2126, 0.7152, 0.0722)); }

float safe_divide(float a, float b) { return b != 0.0 ? a / b : 0.0; }
vec3 safe_divide(vec3 a, vec3 b)
{
    return vec3(safe_divide(a.x, b.x), safe_divide(a.y, b.y), safe_divide(a.z, b.z));
}

// The zero vector stays zero; the length is found after scaling, so that tiny and huge vectors keep their direction.
vec3 safe_normalize(vec3 v)
{
    float m = max3(abs(v));
    if (!(m > 0.0)) {
        return vec3(0.0);
    }
    v /= m;
    return v * inversesqrt(dot(v, v));
}

bool is_finite(float x) { return !(isnan(x) || isinf(x)); }
bool is_finite(vec3 v) { return is_finite(v.x) && is_finite(v.y) && is_finite(v.z); }

// What turns normals under m, of any scale: the cofactor matrix, scaled to near 1, its determinant's sign taken out so
// that normals keep their side in a mirror.
mat3 normal_matrix(mat3 m)
{
    mat3 cofactor = mat3(cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1]));
    float mirrored = dot(m[0], cofactor[0]) < 0.0 ? -1.0 : 1.0;
    float size = max(max(dot(cofactor[0], cofactor[0]), dot(cofactor[1], cofactor[1])), dot(cofactor[2], cofactor[2]));
    return cofactor * (size > 0.0 ? mirrored * inversesqrt(size) : 0.0);
}

// A right-handed frame with z = n. T. Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017.
mat3 frame_from_normal(vec3 n)
{
    float s = n.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (s + n.z);
    float b = n.x * n.y * a;
    return mat3(vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x), vec3(b, s + n.y * n.y * a, -n.y), n);
}

// Unit vectors as two numbers in [0, 1]: octahedral map, Z. Cigolle et al., JCGT 3(2), 2014.
vec2 octahedral_encode(vec3 n)
{
    n /= max(abs(n.x) + abs(n.y) + abs(n.z), 1e-20);
    vec2 folded = (1.0 - abs(n.yx)) * vec2(n.x >= 0.0 ? 1.0 : -1.0, n.y >= 0.0 ? 1.0 : -1.0);
    return (n.z >= 0.0 ? n.xy : folded) * 0.5 + 0.5;
}

vec3 octahedral_decode(vec2 e)
{
    e = e * 2.0 - 1.0;
    vec3 n = vec3(e, 1.0 - abs(e.x) - abs(e.y));
    float t = max(-n.z, 0.0);
    n.xy += vec2(n.x >= 0.0 ? -t : t, n.y >= 0.0 ? -t : t);
    return normalize(n);
}
