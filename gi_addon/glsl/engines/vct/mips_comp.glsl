// One level of the directional mips (Crassin et al. 2011, §4.2; paper §IV-D): along a part's axis two cells lie one behind
// the other, across it four columns side by side. What the front cell covers hides the one behind.

#include "engines/vct/volume_lib.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;
layout(binding = 1, rgba16f) readonly uniform image3D finer;
layout(binding = 2, rgba16f) writeonly uniform image3D coarser;
uniform ivec3 coarse_size;
uniform int coarse_level;

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(cell, coarse_size))) {
        return;
    }
    ivec3 fine_size = 2 * coarse_size;
    vec3 alpha = cell_alpha(voxel_coverage, cell, coarse_level);
    for (int part = 0; part < 6; ++part) {
        int axis = part >> 1;
        int side = part & 1;
        ivec3 along = ivec3(equal(ivec3(0, 1, 2), ivec3(axis)));
        ivec3 u = along.yzx;
        ivec3 v = along.zxy;
        // The cell on the part's side is in front.
        ivec3 front = 2 * cell + along * (1 - side);
        ivec3 behind = 2 * cell + along * side;
        vec3 light = vec3(0.0);
        float weight = 0.0;
        for (int column = 0; column < 4; ++column) {
            ivec3 across = u * (column & 1) + v * (column >> 1);
            vec4 a = imageLoad(finer, part_texel(front + across, fine_size, axis, side));
            vec4 b = imageLoad(finer, part_texel(behind + across, fine_size, axis, side));
            float covers_a = texelFetch(voxel_coverage, front + across, coarse_level - 1)[axis];
            float covers_b = min(texelFetch(voxel_coverage, behind + across, coarse_level - 1)[axis], 1.0 - covers_a);
            light += safe_divide(a.rgb, vec3(a.a)) * covers_a + safe_divide(b.rgb, vec3(b.a)) * covers_b;
            weight += covers_a + covers_b;
        }
        vec3 color = weight > 0.0 ? light / weight * alpha[axis] : vec3(0.0);
        imageStore(coarser, part_texel(cell, coarse_size, axis, side), vec4(color, alpha[axis]));
    }
}
