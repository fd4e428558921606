// Coverage of cells from their surfaces' area. A face can't be covered more than whole.

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(cell, size))) {
        return;
    }
    vec3 area = texelFetch(voxel_area, cell, 0).rgb;
    vec3 normal = texelFetch(voxel_normal, cell, 0).rgb;
    imageStore(voxel_coverage, cell, vec4(min(area, vec3(1.0)), 0.0));
    imageStore(voxel_facing, cell, vec4(normal / max(area, vec3(1e-6)), 0.0));
}
