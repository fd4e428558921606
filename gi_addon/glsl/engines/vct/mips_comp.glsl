// One level of the directional mips (Crassin et al. 2011, §4.2; paper §IV-D): along a part's axis two cells lie one behind
// the other, across it four columns side by side. What the front cell covers hides the one behind.

#include "engines/vct/volume_lib.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;
layout(binding = 4, rgba16f) readonly uniform image3D finer;
layout(binding = 5, rgba16f) writeonly uniform image3D coarser;
layout(binding = 6, rgba16f) readonly uniform image3D finer_back;
layout(binding = 7, rgba16f) writeonly uniform image3D coarser_back;
uniform ivec3 coarse_size;
uniform int coarse_level;

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(cell, coarse_size))) {
        return;
    }
    ivec3 fine_size = 2 * coarse_size;
    int fine_level = coarse_level - 1;
    vec3 alpha = texelFetch(voxel_opacity, cell, coarse_level).rgb;
    if (max3(alpha) <= 0.0) {
        if (first_time == 1) {
            for (int part = 0; part < 6; ++part) {
                imageStore(coarser, part_texel(cell, coarse_size, part >> 1, part & 1), vec4(0.0));
            }
            imageStore(coarser_back, cell, vec4(0.0));
        }
        return;
    }
    for (int part = 0; part < 6; ++part) {
        int axis = part >> 1;
        int side = part & 1;
        ivec3 along = ivec3(equal(ivec3(0, 1, 2), ivec3(axis)));
        ivec3 u = along.yzx;
        ivec3 v = along.zxy;
        // The cell on the part's side is in front.
        ivec3 front = 2 * cell + along * (1 - side);
        ivec3 behind = 2 * cell + along * side;
        vec4 light = vec4(0.0);
        float covered = 0.0;
        for (int column = 0; column < 4; ++column) {
            ivec3 across = u * (column & 1) + v * (column >> 1);
            float left = 1.0;
            for (int k = 0; k < 2; ++k) {
                ivec3 at = (k == 0 ? front : behind) + across;
                vec4 here = imageLoad(finer, part_texel(at, fine_size, axis, side));
                float covers = min(texelFetch(voxel_coverage, at, fine_level)[axis], left);
                float depth = texelFetch(voxel_opacity, at, fine_level)[axis];
                light += depth > 0.0 ? here * (covers / depth) : vec4(0.0);
                covered += covers;
                left -= covers;
            }
        }
        imageStore(coarser, part_texel(cell, coarse_size, axis, side),
                   covered > 0.0 ? light * (alpha[axis] / covered) : vec4(0.0));
    }
    vec4 back = vec4(0.0);
    for (int k = 0; k < 8; ++k) {
        back += imageLoad(finer_back, 2 * cell + ivec3(k & 1, (k >> 1) & 1, k >> 2));
    }
    float depth = alpha.x + alpha.y + alpha.z;
    imageStore(coarser_back, cell, back.a > 0.0 ? back * (depth / back.a) : vec4(0.0));
}
