// One level of coverage: along an axis two cells lie one behind the other, and cover a column together up to whole; four
// columns side by side are averaged. Facing is averaged by coverage.

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;
layout(binding = 3, rgba16f) readonly uniform image3D finer_coverage;
layout(binding = 4, rgba16f) writeonly uniform image3D coarser_coverage;
layout(binding = 5, rgba16f) readonly uniform image3D finer_facing;
layout(binding = 6, rgba16f) writeonly uniform image3D coarser_facing;

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(cell, size))) {
        return;
    }
    vec3 coverage = vec3(0.0);
    vec3 facing = vec3(0.0);
    vec3 weight = vec3(0.0);
    for (int axis = 0; axis < 3; ++axis) {
        ivec3 along = ivec3(equal(ivec3(0, 1, 2), ivec3(axis)));
        ivec3 u = along.yzx;
        ivec3 v = along.zxy;
        for (int column = 0; column < 4; ++column) {
            ivec3 near = 2 * cell + u * (column & 1) + v * (column >> 1);
            float a = imageLoad(finer_coverage, near)[axis];
            float b = imageLoad(finer_coverage, near + along)[axis];
            coverage[axis] += 0.25 * min(a + b, 1.0);
            facing[axis] += a * imageLoad(finer_facing, near)[axis] + b * imageLoad(finer_facing, near + along)[axis];
            weight[axis] += a + b;
        }
    }
    imageStore(coarser_coverage, cell, vec4(coverage, 0.0));
    imageStore(coarser_facing, cell, vec4(facing / max(weight, vec3(1e-6)), 0.0));
}
