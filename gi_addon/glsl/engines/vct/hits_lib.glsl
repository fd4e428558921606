// Where the cones of a point end, to be kept for its neighbours. Included after diffuse_lib.glsl, with CONES defined.

struct Hit {
    vec3 offset;    // from the point, cells
    vec3 normal;    // of the side that was met, or of the grid's where nothing was
    vec3 radiance;  // 0 from there
};

// Radiance of any strength and sign: 12 bits of each colour's magnitude and its sign, an exponent of 8 bits for all three. Halves
// would end at 65504 and be zero in dim scenes.
const float MANTISSA = 4096.0;
const int EXPONENT_BIAS = 127;

uvec4 pack_hit(Hit hit)
{
    float most = max3(abs(hit.radiance));
    int exponent = most > 0.0 ? clamp(int(floor(log2(most))) + 1, -126, 126) : -EXPONENT_BIAS;
    uvec3 m = uvec3(min(round(abs(hit.radiance) * exp2(float(-exponent)) * MANTISSA), MANTISSA - 1.0));
    m |= uvec3(lessThan(hit.radiance, vec3(0.0))) << 12u;
    uint high = m.b >> 6u | uint(exponent + EXPONENT_BIAS) << 7u;
    return uvec4(packHalf2x16(hit.offset.xy), packHalf2x16(vec2(hit.offset.z, 0.0)) | high << 16u, m.r | m.g << 13u | m.b << 26u,
                 packUnorm2x16(octahedral_encode(hit.normal)));
}

Hit unpack_hit(uvec4 texel)
{
    uint high = texel.y >> 16u;
    uvec3 m = uvec3(texel.z, texel.z >> 13u, texel.z >> 26u | high << 6u) & 8191u;
    vec3 radiance = vec3(m & 4095u) / MANTISSA * exp2(float(int(high >> 7u) - EXPONENT_BIAS));
    return Hit(vec3(unpackHalf2x16(texel.x), unpackHalf2x16(texel.y).x), octahedral_decode(unpackUnorm2x16(texel.w)),
               mix(radiance, -radiance, greaterThan(m, uvec3(4095u))));
}

// Of the grid's side where the cone leaves it, inwards.
vec3 box_normal(Cone cone, Grid grid)
{
    vec3 d = mix(cone.direction, vec3(1e-9), lessThan(abs(cone.direction), vec3(1e-9)));
    vec3 far = max(-cone.start / d, (grid.size - cone.start) / d);
    float first = min(far.x, min(far.y, far.z));
    int axis = far.x == first ? 0 : far.y == first ? 1 : 2;
    return -sign(d[axis]) * axis_vector(axis);
}

// Traces run `run` of cones from a point. They are as wide as their share of all that count there: of SIDE × SIDE blocks'. Wider
// ones would bring light around thin walls, from the lit side of what goes on behind them.
void trace_hits(vec3 position_ws, vec3 n, vec3 ng, uint run, out uvec4 hits[CONES])
{
    Grid grid = voxel_grid();
    mat3 frame = frame_from_normal(n);
    Cone cone = surface_cone(grid, position_ws, ng, n, cone_spread(1.0 / (float(cone_count * SIDE * SIDE) * cone_sets)), 1e30);
    for (int i = 0; i < CONES; ++i) {
        cone.direction = frame * cone_direction(run + uint(i));
        hits[i] = uvec4(0u);
        if (dot(cone.direction, ng) > 0.0) { // else into the triangle
            ConeResult result = trace_cone(voxel_radiance, voxel_back, voxel_sheets, voxel_rows, voxel_kinds, grid, cone);
            bool met = result.first.t < 1e30;
            float t = max(met ? result.first.t : cone_end(cone, grid), LIFT);
            vec3 normal = met ? result.first.normal : box_normal(cone, grid);
            hits[i] = pack_hit(Hit(cone.direction * t, normal, result.radiance));
        }
    }
}
