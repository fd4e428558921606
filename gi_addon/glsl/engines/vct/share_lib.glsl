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

// The block's point, if there is one and it is on the same surface as `here`, off the plane by no more than `off_plane` (m).
bool on_same_surface(Gatherer here, ivec2 block, vec3 position_ws, float off_plane, out Gatherer there)
{
    if (any(lessThan(block, ivec2(0))) || any(greaterThanEqual(block, textureSize(low_depth, 0)))) {
        return false;
    }
    Receiver r = gather_receiver(block);
    there = gatherer(r.position_ws, r.n, r.ng);
    return on_surface(r, position_ws, here.ng, off_plane);
}

// Whether nothing stands between two points of a surface: seen from as far above it as a surface may bend away within two cells.
bool see_each_other(Gatherer here, Gatherer there)
{
    vec3 way = there.at - here.at;
    float reach = length(way);
    Cone cone = Cone(here.at + OWN_HEIGHT * here.ng, way / max(reach, 1e-6), 0.0, reach, 0.0);
    return trace_open(voxel_sheets, voxel_rows, voxel_kinds, voxel_grid(), cone) > 0.5;
}

// Adds a cone's light and its weight.
void add_hit(inout Gathered sum, inout float weights, Gatherer g, Hit hit, float weight)
{
    weights += weight;
    if (hit.radiance != vec3(0.0)) {
        sum.radiance += hit.radiance * weight;
        sum.direction += directional(normalize(hit.offset), g.n, hit.radiance * weight);
    }
}

// E/π at a point by its own cones, and those of `side` × `side` blocks around `block`; not of `block` itself if the point is its own.
// All weights add up to the number of cones but for their noise, which their sum takes out: what meets nothing counts as the side of
// the grid where it leaves.
Gathered shared_light(Gatherer here, uvec4 own[CONES], vec3 position_ws, float off_plane, ivec2 block, int side, bool is_block)
{
    Gatherer there;
    uint shared_ = 0u; // a bit for each block around
    for (int i = 0; i < side * side; ++i) {
        ivec2 step_ = ivec2(i % side, i / side) - side / 2;
        if ((!is_block || step_ != ivec2(0)) && on_same_surface(here, block + step_, position_ws, off_plane, there)) {
            shared_ |= see_each_other(here, there) ? 1u << i : 0u;
        }
    }
    float k = float(bitCount(shared_));
    Gathered sum = Gathered(vec3(0.0), vec4(0.0));
    float weights = 0.0;
    for (int j = 0; j < (k > 0.0 ? 0 : CONES); ++j) {
        add_hit(sum, weights, here, unpack_hit(own[j]), 1.0);
    }
    for (int i = 0; i < (k > 0.0 ? side * side : 0); ++i) {
        ivec2 step_ = ivec2(i % side, i / side) - side / 2;
        if ((shared_ >> i & 1u) == 0u) {
            continue;
        }
        on_same_surface(here, block + step_, position_ws, off_plane, there);
        for (int j = 0; j < CONES; ++j) {
            Hit hit = unpack_hit(own[j]);
            float g_here = facing(here, hit.offset, hit.normal);
            float g_there = facing(there, hit.offset == vec3(0.0) ? hit.offset : here.at + hit.offset - there.at, hit.normal);
            add_hit(sum, weights, here, hit, g_here / max(k * g_there + g_here, 1e-30) / k);
            hit = unpack_hit(texelFetch(cone_hits, ivec3(block + step_, j), 0));
            g_there = facing(there, hit.offset, hit.normal);
            if (hit.offset != vec3(0.0)) {
                hit.offset += there.at - here.at;
            }
            g_here = facing(here, hit.offset, hit.normal);
            add_hit(sum, weights, here, hit, g_here / max(k * g_there + g_here, 1e-30));
        }
    }
    sum.radiance /= max(weights, 1e-6);
    return sum;
}
