// One level of the directional mips (Crassin et al. 2011, §4.2; paper §IV-D): along a part's axis two cells lie one behind
// the other, across it four columns side by side. What the front cell covers hides the one behind.

#include "engines/vct/volume_lib.glsl"

layout(local_size_x = 64) in;
uniform int coarse_level;

// Light of `part` of a cell of the finer level; `part` −1 is that of backs.
vec4 finer_light(ivec3 cell, int part)
{
    int level = coarse_level - 1;
    vec4 texel = texelFetch(voxel_kinds, cell, level);
    uint kinds = kinds_of(texel);
    if (kinds >= 64u || (part >= 0 && (kinds >> part & 1u) == 0u)) {
        return vec4(0.0);
    }
    uint number = first_number(voxel_rows, texel, cell, grid_size, level);
    return part < 0 ? imageLoad(voxel_back, store_texel(number))
                    : imageLoad(voxel_radiance, store_texel(number + sheets_before(kinds, part)));
}

void main()
{
    uint number = invoked_number();
    ivec3 cell;
    uint kinds;
    if (!first_of_cell(voxel_places, voxel_rows, voxel_kinds, grid_size, coarse_level, number, cell, kinds)) {
        return;
    }
    uint own = number;
    for (int part = 0; part < 6; ++part) {
        if ((kinds >> part & 1u) == 0u) {
            continue;
        }
        int side = part & 1;
        ivec3 along = ivec3(axis_vector(part >> 1));
        ivec3 u = along.zxy;
        ivec3 v = along.yzx;
        // The cell on the part's side is in front.
        ivec3 front = 2 * cell + along * (1 - side);
        ivec3 behind = 2 * cell + along * side;
        vec4 light = vec4(0.0);
        for (int column = 0; column < 4; ++column) {
            ivec3 across = u * (column & 1) + v * (column >> 1);
            vec4 near = finer_light(front + across, part);
            vec4 far = finer_light(behind + across, part);
            float seen = min(far.a, 1.0 - min(near.a, 1.0));
            light += 0.25 * (near + (far.a > 0.0 ? far * (seen / far.a) : vec4(0.0)));
        }
        imageStore(voxel_radiance, store_texel(own), light);
        ++own;
    }
    vec4 back = vec4(0.0);
    for (int k = 0; k < 8; ++k) {
        back += finer_light(2 * cell + ivec3(k & 1, (k >> 1) & 1, k >> 2), -1);
    }
    imageStore(voxel_back, store_texel(number), 0.125 * back);
}
