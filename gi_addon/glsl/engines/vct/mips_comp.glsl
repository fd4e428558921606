// One level of the directional mips (Crassin et al. 2011, §4.2; paper §IV-D): along a part's axis two cells lie one behind
// the other, across it four columns side by side. What the front cell covers hides the one behind.

#include "engines/vct/volume_lib.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;
layout(binding = 4, rgba16f) readonly uniform image3D finer;
layout(binding = 5, rgba16f) writeonly uniform image3D coarser;
uniform ivec3 coarse_size;
uniform int coarse_level;

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(cell, coarse_size))) {
        return;
    }
    uint kinds = kinds_of(texelFetch(voxel_kinds, cell, coarse_level));
    kinds = kinds >= 64u ? 0u : kinds;
    if (kinds == 0u && first_time == 0) {
        return; // as it was
    }
    ivec3 fine_size = 2 * coarse_size;
    for (int part = 0; part < 6; ++part) {
        int axis = part >> 1;
        int side = part & 1;
        ivec3 along = ivec3(axis_vector(axis));
        ivec3 u = along.zxy;
        ivec3 v = along.yzx;
        // The cell on the part's side is in front.
        ivec3 front = 2 * cell + along * (1 - side);
        ivec3 behind = 2 * cell + along * side;
        vec4 light = vec4(0.0);
        bool there = (kinds >> part & 1u) == 1u || (kinds >> (part ^ 1) & 1u) == 1u;
        if (!there && first_time == 0) {
            continue;
        }
        for (int column = 0; column < (there ? 4 : 0); ++column) {
            ivec3 across = u * (column & 1) + v * (column >> 1);
            vec4 near = imageLoad(finer, part_texel(front + across, fine_size, axis, side));
            vec4 far = imageLoad(finer, part_texel(behind + across, fine_size, axis, side));
            float seen = min(far.a, 1.0 - min(near.a, 1.0));
            light += 0.25 * (near + (far.a > 0.0 ? far * (seen / far.a) : vec4(0.0)));
        }
        imageStore(coarser, part_texel(cell, coarse_size, axis, side), light);
    }
}
