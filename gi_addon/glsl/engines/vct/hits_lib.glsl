// Where the cones of a point end, to be kept for its neighbours. Included after diffuse_lib.glsl, with CONES defined.

struct Hit {
    vec3 offset;    // from the point, cells
    vec3 normal;    // of the side that was met, or of the grid's where nothing was
    vec3 radiance;  // 0 from there
};

uvec4 pack_hit(Hit hit)
{
    return uvec4(packHalf2x16(hit.offset.xy), packHalf2x16(vec2(hit.offset.z, hit.radiance.x)), packHalf2x16(hit.radiance.yz),
                 packUnorm2x16(octahedral_encode(hit.normal)));
}

Hit unpack_hit(uvec4 texel)
{
    vec2 zr = unpackHalf2x16(texel.y);
    return Hit(vec3(unpackHalf2x16(texel.x), zr.x), octahedral_decode(unpackUnorm2x16(texel.w)), vec3(zr.y, unpackHalf2x16(texel.z)));
}

// A point that gathers.
struct Gatherer {
    vec3 at;  // cells
    vec3 n;
    vec3 ng;
};

Gatherer gatherer(vec3 position_ws, vec3 n, vec3 ng) { return Gatherer((position_ws - grid_low) / grid_cell, n, ng); }

// Of the grid's side where the cone leaves it, inwards.
vec3 box_normal(Cone cone, Grid grid)
{
    vec3 d = mix(cone.direction, vec3(1e-9), lessThan(abs(cone.direction), vec3(1e-9)));
    vec3 far = max(-cone.start / d, (grid.size - cone.start) / d);
    float first = min(far.x, min(far.y, far.z));
    int axis = far.x == first ? 0 : far.y == first ? 1 : 2;
    return -sign(d[axis]) * axis_vector(axis);
}

// Traces run `run` of cones from a point.
void trace_hits(vec3 position_ws, vec3 n, vec3 ng, uint run, out uvec4 hits[CONES])
{
    Grid grid = voxel_grid();
    mat3 frame = frame_from_normal(n);
    Cone cone = surface_cone(grid, position_ws, ng, n, set_spread(), 1e30);
    for (int i = 0; i < CONES; ++i) {
        cone.direction = frame * cone_direction(run + uint(i));
        hits[i] = uvec4(0u);
        if (dot(cone.direction, ng) > 0.0) { // else into the triangle
            ConeResult result = trace_cone(voxel_radiance, voxel_back, voxel_sheets, voxel_extents, voxel_kinds, grid, cone);
            bool met = result.first.t < 1e30;
            float t = max(met ? result.first.t : cone_end(cone, grid), LIFT);
            vec3 normal = met ? result.first.normal : box_normal(cone, grid);
            hits[i] = pack_hit(Hit(cone.direction * t, normal, result.radiance));
        }
    }
}
