// What a point takes of the cones of the blocks around it. Included after passes/gather_receiver.glsl and diffuse_lib.glsl, where
// `cone_hits` is declared.
//
// Neighbours' cones end on surfaces that this point sees too, in another direction and at another distance. A cone of block i ends
// at y with density g_i/π per area, g_i = cosθ_i cosθ_y/r_i²; what y sends here is L g_c/π per area. So its light counts here by
// g_c/g_i: neighbours add no blur, but for what one point sees and the other does not (E. Veach and L. Guibas, SIGGRAPH 1995;
// P. Bekaert, M. Sbert and J. Halton, "Accelerating Path Tracing by Re-Using Paths", EGWR 2002). Weights are the balance heuristic's,
// pair by pair (B. Bitterli, "Correlations and Reuse for Fast and Accurate Physically Based Light Transport", 2022): of K neighbours each shares 1/K of this
// point's cones, so that a cone of its own counts by Σ_i (g_c/K)/(g_i + g_c/K)/K, a neighbour's by g_c/(g_i + g_c/K)/K, which never
// exceeds a cone's full weight. Both add up to one for every y.
//
// That a point sees what its neighbour does is taken for granted where both lie on one surface and nothing stands between them.

#include "engines/vct/hits_lib.glsl"
#include "engines/vct/joined_lib.glsl"

// cosθ cosθ_y/r² of a surface of normal `normal` at `offset`.
float facing(Gatherer g, vec3 offset, vec3 normal)
{
    float square = dot(offset, offset);
    if (square == 0.0) {
        return 1.0; // not traced, into the triangle: of each point as many
    }
    float cosines = max(dot(offset, g.n), 0.0) * max(-dot(offset, normal), 0.0);
    return dot(offset, g.ng) > 0.0 ? cosines / sqr(square) : 0.0;
}

// Adds a cone's light, its weight, and that over its length in cells.
void add_hit(inout Gathered sum, inout vec2 weights, Gatherer g, Hit hit, float weight)
{
    weights += weight * vec2(1.0, inversesqrt(max(dot(hit.offset, hit.offset), sqr(LIFT))));
    sum.radiance += hit.radiance * weight;
#if GATHER_SCALE > 1 // else nothing is interpolated
    if (hit.radiance != vec3(0.0)) {
        sum.direction += directional(normalize(hit.offset), g.n, hit.radiance * weight);
    }
#endif
}

// E/π at a point by its own cones, and those of `side` × `side` blocks around `block`, a bit in `shared_` each. All weights add up
// to the number of cones but for their noise, which their sum takes out: what meets nothing counts as the side of the grid where it
// leaves. `nearness` is the mean of 1/distance of all that is met, 1/m.
Gathered shared_light(Gatherer here, uvec4 own[CONES], ivec2 block, int side, uint shared_, out float nearness)
{
    float k = float(bitCount(shared_));
    Gathered sum = Gathered(vec3(0.0), vec4(0.0));
    vec2 weights = vec2(0.0);
    Hit hits[CONES];
    float g_own[CONES];
    float own_weights[CONES];
    for (int j = 0; j < CONES; ++j) {
        hits[j] = unpack_hit(own[j]);
        g_own[j] = facing(here, hits[j].offset, hits[j].normal);
        own_weights[j] = k > 0.0 ? 0.0 : 1.0;
    }
    for (int i = 0; i < (k > 0.0 ? side * side : 0); ++i) {
        if ((shared_ >> i & 1u) == 0u) {
            continue;
        }
        ivec2 other = block + window_step(i, side);
        Receiver r = gather_receiver(other);
        Gatherer there = gatherer(r.position_ws, r.n, r.ng);
        vec3 way = there.at - here.at;
        for (int j = 0; j < CONES; ++j) {
            vec3 offset = hits[j].offset;
            float g_there = facing(there, offset == vec3(0.0) ? offset : offset - way, hits[j].normal);
            own_weights[j] += g_own[j] / max(k * g_there + g_own[j], 1e-30) / k;
            Hit hit = unpack_hit(texelFetch(cone_hits, ivec3(other, j), 0));
            g_there = facing(there, hit.offset, hit.normal);
            hit.offset += hit.offset == vec3(0.0) ? vec3(0.0) : way;
            float g_here = facing(here, hit.offset, hit.normal);
            add_hit(sum, weights, here, hit, g_here / max(k * g_there + g_here, 1e-30));
        }
    }
    for (int j = 0; j < CONES; ++j) {
        add_hit(sum, weights, here, hits[j], own_weights[j]);
    }
    sum.radiance /= max(weights.x, 1e-6);
    nearness = weights.y / max(weights.x * grid_cell, 1e-30);
    return sum;
}
