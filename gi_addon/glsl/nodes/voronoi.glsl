// Blender's Voronoi texture in 1 to 4 dimensions, after S. Worley, "A Cellular Texture Basis Function", SIGGRAPH 1996.
// All dimensions share one code: unused components are zero and their loops run once. Dimensions, feature, metric and hash
// are the macros VORONOI_…, which the compiler makes a number where all Voronoi nodes of a material agree, and a member of
// the settings where they don't: drivers take a second to see the same through members.

#include "nodes/hash.glsl"

const int VORONOI_EUCLIDEAN = 0;
const int VORONOI_MANHATTAN = 1;
const int VORONOI_CHEBYCHEV = 2;
const int VORONOI_MINKOWSKI = 3;
const int VORONOI_F1 = 0;
const int VORONOI_F2 = 1;
const int VORONOI_SMOOTH_F1 = 2;
const float VORONOI_FAR = 3.4e38;

struct VoronoiSettings {
    int dims;
    int metric;
    int feature;
    int pcg;          // 1: cells are hashed as in Blender ≥ 5.0
    int most;         // octaves after the first
    bool normalize_;
    float detail;
    float roughness;
    float lacunarity;
    float smoothness;
    float exponent;
    float randomness;
};

struct Voronoi {
    float distance_;
    vec3 color;
    vec4 position;
};

vec4 voronoi_axes(VoronoiSettings s)
{
    return vec4(1.0, VORONOI_DIMENSIONS > 1, VORONOI_DIMENSIONS > 2, VORONOI_DIMENSIONS > 3);
}

float voronoi_distance(vec4 d, VoronoiSettings s)
{
    d = abs(d);
    if (VORONOI_DIMENSIONS == 1) {
        return d.x;
    }
    if (VORONOI_METRIC == VORONOI_MANHATTAN) {
        return d.x + d.y + d.z + d.w;
    }
    if (VORONOI_METRIC == VORONOI_CHEBYCHEV) {
        return max(max(d.x, d.y), max(d.z, d.w));
    }
    if (VORONOI_METRIC == VORONOI_MINKOWSKI) {
        float sum = pow(d.x, s.exponent) + pow(d.y, s.exponent);
        sum += VORONOI_DIMENSIONS > 2 ? pow(d.z, s.exponent) : 0.0;
        sum += VORONOI_DIMENSIONS > 3 ? pow(d.w, s.exponent) : 0.0;
        return pow(sum, 1.0 / s.exponent);
    }
    return length(d);
}

// Where a cell's point lies in it, and its colour.
vec4 voronoi_point(vec4 cell, VoronoiSettings s)
{
    vec4 at = vec4(0.0);
    if (VORONOI_DIMENSIONS == 1) {
        at.x = hash_unit(cell.x);
    } else if (VORONOI_DIMENSIONS == 2) {
        at.xy = VORONOI_PCG != 0 ? pcg_unit(ivec2(cell.xy)) : hash_color(cell.xy).xy;
    } else if (VORONOI_DIMENSIONS == 3) {
        at.xyz = VORONOI_PCG != 0 ? pcg_unit(ivec3(cell.xyz)) : hash_color(cell.xyz);
    } else {
        at = VORONOI_PCG != 0 ? pcg_unit(ivec4(cell))
                        : vec4(hash_unit(cell), hash_unit(cell.wxyz), hash_unit(cell.zwxy), hash_unit(cell.yzwx));
    }
    return at * s.randomness;
}
vec3 voronoi_color(vec4 cell, VoronoiSettings s)
{
    if (VORONOI_DIMENSIONS == 1) {
        return hash_color(cell.x);
    }
    if (VORONOI_DIMENSIONS == 2) {
        return VORONOI_PCG != 0 ? pcg_unit(ivec3(cell.xy, 0)) : hash_color(cell.xy);
    }
    if (VORONOI_DIMENSIONS == 3) {
        return VORONOI_PCG != 0 ? pcg_unit(ivec3(cell.xyz)) : hash_color(cell.xyz);
    }
    return VORONOI_PCG != 0 ? pcg_unit(ivec4(cell)).xyz : hash_color(cell);
}

// Runs BODY for each cell offset within RANGE of the point's own.
#define VORONOI_CELLS(RANGE, BODY)                                                                                     \
    {                                                                                                                  \
        const int r_ = RANGE;                                                                                          \
        for (int w_ = VORONOI_DIMENSIONS > 3 ? -r_ : 0; w_ <= (VORONOI_DIMENSIONS > 3 ? r_ : 0); ++w_) {               \
            for (int z_ = VORONOI_DIMENSIONS > 2 ? -r_ : 0; z_ <= (VORONOI_DIMENSIONS > 2 ? r_ : 0); ++z_) {           \
                for (int y_ = VORONOI_DIMENSIONS > 1 ? -r_ : 0; y_ <= (VORONOI_DIMENSIONS > 1 ? r_ : 0); ++y_) {       \
                    for (int x_ = -r_; x_ <= r_; ++x_) {                                                               \
                        vec4 offset = vec4(float(x_), float(y_), float(z_), float(w_));                                \
                        BODY                                                                                           \
                    }                                                                                                  \
                }                                                                                                      \
            }                                                                                                          \
        }                                                                                                              \
    }

Voronoi voronoi_cell(vec4 p, VoronoiSettings s)
{
    vec4 cell = floor(p);
    vec4 local = p - cell;
    if (VORONOI_FEATURE == VORONOI_SMOOTH_F1 && s.smoothness != 0.0) {
        Voronoi v = Voronoi(0.0, vec3(0.0), vec4(0.0));
        bool first = true;
        VORONOI_CELLS(2, {
            vec4 at = offset + voronoi_point(cell + offset, s);
            float d = voronoi_distance(at - local, s);
            float h = first ? 1.0 : smoothstep(0.0, 1.0, 0.5 + 0.5 * (v.distance_ - d) / s.smoothness);
            first = false;
            float correction = s.smoothness * h * (1.0 - h);
            v.distance_ = mix(v.distance_, d, h) - correction;
            correction /= 1.0 + 3.0 * s.smoothness;
            v.color = mix(v.color, voronoi_color(cell + offset, s), h) - correction;
            v.position = mix(v.position, at, h) - correction * voronoi_axes(s);
        })
        v.position += cell;
        return v;
    }
    float near = VORONOI_FAR;
    float next = VORONOI_FAR;
    vec4 near_offset = vec4(0.0);
    vec4 next_offset = vec4(0.0);
    vec4 near_at = vec4(0.0);
    vec4 next_at = vec4(0.0);
    VORONOI_CELLS(1, {
        vec4 at = offset + voronoi_point(cell + offset, s);
        float d = voronoi_distance(at - local, s);
        if (d < near) {
            next = near;
            next_offset = near_offset;
            next_at = near_at;
            near = d;
            near_offset = offset;
            near_at = at;
        } else if (d < next) {
            next = d;
            next_offset = offset;
            next_at = at;
        }
    })
    if (VORONOI_FEATURE == VORONOI_F2) {
        return Voronoi(next, voronoi_color(cell + next_offset, s), next_at + cell);
    }
    return Voronoi(near, voronoi_color(cell + near_offset, s), near_at + cell);
}

// The largest distance that F1 (twice that: F2) can have.
float voronoi_reach(VoronoiSettings s)
{
    return voronoi_distance((0.5 + 0.5 * s.randomness) * voronoi_axes(s), s) * (VORONOI_FEATURE == VORONOI_F2 ? 2.0 : 1.0);
}

Voronoi node_voronoi(vec4 p, VoronoiSettings s)
{
    Voronoi sum = Voronoi(0.0, vec3(0.0), vec4(0.0));
    float amplitude = 1.0;
    float total = 0.0;
    float scale = 1.0;
    if (s.most == 0 || s.detail == 0.0 || s.roughness == 0.0) {
        sum = voronoi_cell(p, s);
        total = 1.0;
    } else {
        for (int i = 0; i <= s.most; ++i) {
            // An octave of which the detail asks for a part counts in that part.
            float share = clamp(s.detail - float(i) + 1.0, 0.0, 1.0);
            if (share > 0.0) {
                Voronoi octave = voronoi_cell(p * scale, s);
                sum.distance_ += share * octave.distance_ * amplitude;
                sum.color += share * octave.color * amplitude;
                sum.position = mix(sum.position, mix(sum.position, octave.position / scale, amplitude), share);
                total += share * amplitude;
                scale *= s.lacunarity;
                amplitude *= s.roughness;
            }
        }
    }
    if (s.normalize_) {
        sum.distance_ /= total * voronoi_reach(s);
        sum.color /= total;
    }
    return sum;
}

float voronoi_edge(vec4 p, VoronoiSettings s)
{
    vec4 cell = floor(p);
    vec4 local = p - cell;
    if (VORONOI_DIMENSIONS == 1) {
        float middle = voronoi_point(cell, s).x;
        float left = voronoi_point(cell - vec4(1, 0, 0, 0), s).x - 1.0;
        float right = voronoi_point(cell + vec4(1, 0, 0, 0), s).x + 1.0;
        return min(abs(0.5 * (middle + left) - local.x), abs(0.5 * (middle + right) - local.x));
    }
    vec4 closest = vec4(0.0);
    float near = VORONOI_FAR;
    VORONOI_CELLS(1, {
        vec4 to = offset + voronoi_point(cell + offset, s) - local;
        float d = dot(to, to);
        if (d < near) {
            near = d;
            closest = to;
        }
    })
    near = VORONOI_FAR;
    VORONOI_CELLS(1, {
        vec4 to = offset + voronoi_point(cell + offset, s) - local;
        vec4 across = to - closest;
        if (dot(across, across) > 0.0001) {
            near = min(near, dot(0.5 * (closest + to), normalize(across)));
        }
    })
    return near;
}

float node_voronoi_edge(vec4 p, VoronoiSettings s)
{
    float reach = 0.5 + 0.5 * s.randomness;
    float amplitude = 1.0;
    float most = reach;
    float scale = 1.0;
    float found = 8.0;
    if (s.most == 0 || s.detail == 0.0 || s.roughness == 0.0) {
        found = voronoi_edge(p, s);
    } else {
        for (int i = 0; i <= s.most; ++i) {
            float share = clamp(s.detail - float(i) + 1.0, 0.0, 1.0);
            if (share > 0.0) {
                float octave = voronoi_edge(p * scale, s) / scale;
                float lower = mix(found, min(found, octave), amplitude);
                most = mix(most, mix(most, reach / scale, amplitude), share);
                found = mix(found, share < 1.0 ? min(found, lower) : lower, share);
                scale *= s.lacunarity;
                amplitude *= s.roughness;
            }
        }
    }
    return s.normalize_ ? found / most : found;
}

float node_voronoi_radius(vec4 p, VoronoiSettings s)
{
    vec4 cell = floor(p);
    vec4 local = p - cell;
    vec4 closest = vec4(0.0);
    vec4 closest_offset = vec4(0.0);
    float near = VORONOI_FAR;
    VORONOI_CELLS(1, {
        vec4 at = offset + voronoi_point(cell + offset, s);
        float d = distance(at, local);
        if (d < near) {
            near = d;
            closest = at;
            closest_offset = offset;
        }
    })
    near = VORONOI_FAR;
    VORONOI_CELLS(1, {
        if (any(notEqual(offset, vec4(0.0)))) {
            vec4 neighbour = offset + closest_offset;
            near = min(near, distance(closest, neighbour + voronoi_point(cell + neighbour, s)));
        }
    })
    return 0.5 * near;
}
