// Which blocks lie on one surface, with nothing between them. Included after passes/gather_receiver.glsl and diffuse_lib.glsl.

// A point that gathers.
struct Gatherer {
    vec3 at;  // cells
    vec3 n;
    vec3 ng;
};

Gatherer gatherer(vec3 position_ws, vec3 n, vec3 ng) { return Gatherer((position_ws - grid_low) / grid_cell, n, ng); }

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

// The bit of the side that `n` faces most.
uint kind_facing(vec3 n)
{
    vec3 size = abs(n);
    int axis = size.x >= max(size.y, size.z) ? 0 : size.y >= size.z ? 1 : 2;
    return 1u << (2 * axis + (n[axis] > 0.0 ? 0 : 1));
}

// Whether nothing stands between two points of a surface: seen from as far above it as a surface may bend away within two cells. Most
// points share a cell, or have two side by side, that hold nothing but what faces as they do: so much is known without a walk.
bool see_each_other(Gatherer here, Gatherer there)
{
    vec3 from = here.at + OWN_HEIGHT * here.ng;
    vec3 way = there.at - here.at;
    ivec3 last = grid_size - 1;
    ivec3 a = clamp(ivec3(floor(from)), ivec3(0), last);
    ivec3 b = clamp(ivec3(floor(from + way)), ivec3(0), last);
    uint others = ~kind_facing(here.ng);
    uint in_a = kinds_of(texelFetch(voxel_kinds, a, 0));
    uint in_b = kinds_of(texelFetch(voxel_kinds, b, 0));
    ivec3 apart = abs(b - a);
    if (apart.x + apart.y + apart.z <= 1 && (in_a >= 64u || (in_a & others) == 0u) && (in_b >= 64u || (in_b & others) == 0u)) {
        return true;
    }
    float reach = length(way);
    Cone cone = Cone(from, way / max(reach, 1e-6), 0.0, reach, 0.0);
    return trace_open(voxel_sheets, voxel_rows, voxel_kinds, voxel_grid(), cone) > 0.5;
}

// The i-th block of a window of `side` × `side` about a block.
ivec2 window_step(int i, int side) { return ivec2(i % side, i / side) - side / 2; }

// A bit for each neighbour PAIR[k] of a block that lies on its surface and that it sees.
uint joined_blocks(Receiver r, ivec2 block)
{
    Gatherer here = gatherer(r.position_ws, r.n, r.ng);
    Gatherer there;
    uint joined = 0u;
    for (int k = 0; k < PAIRS; ++k) {
        if (on_same_surface(here, block + PAIR[k], r.position_ws, float(GATHER_SCALE) * pixel_width(r.depth), there)) {
            joined |= see_each_other(here, there) ? 1u << k : 0u;
        }
    }
    return joined;
}
