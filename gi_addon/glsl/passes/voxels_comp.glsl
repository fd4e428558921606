// Sums of the layers in the making to means (passes/voxels.py says what a texel is).

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

void main()
{
    ivec3 at = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(at, ivec3(grid_size.xy, slab.y)))) {
        return;
    }
    uint first = uint((at.z * grid_size.y + at.y) * grid_size.x + at.x) * uint(VOXEL_WORDS);
    ivec3 cell = at + ivec3(0, 0, slab.x);
    float weight = float(voxel_sums[first]);
    float opaque = float(voxel_sums[first + 1u]);
    float inverse = weight > 0.0 ? 1.0 / weight : 0.0;
    // Colours are those of the opaque share: what is seen where a ray is stopped.
    float color = opaque > 0.0 ? 1.0 / opaque : 0.0;
#if HAS_VOXEL_AREA
    vec3 area = vec3(voxel_sums[first + 5u], voxel_sums[first + 6u], voxel_sums[first + 7u]) / float(VOXEL_UNITS);
    imageStore(voxel_area, cell, vec4(area, opaque * inverse));
#endif
#if HAS_VOXEL_ALBEDO
    vec3 albedo = vec3(voxel_sums[first + 2u], voxel_sums[first + 3u], voxel_sums[first + 4u]) * color;
    imageStore(voxel_albedo, cell, vec4(min(albedo, vec3(1.0)), weight > 0.0 ? 1.0 : 0.0));
#endif
#if HAS_VOXEL_NORMAL
    vec3 normal = vec3(ivec3(uvec3(voxel_sums[first + 8u], voxel_sums[first + 9u], voxel_sums[first + 10u])));
    imageStore(voxel_normal, cell, vec4(normal / float(VOXEL_UNITS), 0.0));
#endif
#if HAS_VOXEL_EMISSION
    vec3 emission = vec3(voxel_sums[first + 11u], voxel_sums[first + 12u], voxel_sums[first + 13u]);
    imageStore(voxel_emission, cell, vec4(emission * (emission_unit * float(VOXEL_UNITS) * color), 0.0));
#endif
}
