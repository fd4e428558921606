// One level of the directional mips (Crassin et al. 2011, §4.2; paper §IV-D): along a part's axis two cells lie one behind
// the other, across it four columns side by side. What the front cell covers hides the one behind.

#include "engines/vct/volume_lib.glsl"

layout(local_size_x = 64) in;
uniform int coarse_level;

// Light of `part` of a cell of the finer level: of its front, and of its back.
void finer_light(ivec3 cell, int part, out vec4 front, out vec4 back)
{
    front = back = vec4(0.0);
    int level = coarse_level - 1;
    vec4 texel = texelFetch(voxel_kinds, cell, level);
    uint kinds = kinds_of(texel);
    if (kinds < 64u && (kinds >> part & 1u) == 1u) {
        uint number = first_number(voxel_rows, texel, cell, grid_size, level) + sheets_before(kinds, part);
        front = imageLoad(voxel_radiance, store_texel(number));
        back = imageLoad(voxel_back, store_texel(number));
    }
}

// What shows of two cells one behind the other.
vec4 shown(vec4 near, vec4 far)
{
    return near + (far.a > 0.0 ? far * (min(far.a, 1.0 - min(near.a, 1.0)) / far.a) : vec4(0.0));
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
        // The cell on the part's side is in front; of what leaves backs, the other.
        ivec3 first = 2 * cell + along * (1 - side);
        ivec3 second = 2 * cell + along * side;
        vec4 fronts = vec4(0.0);
        vec4 backs = vec4(0.0);
        for (int column = 0; column < 4; ++column) {
            ivec3 across = u * (column & 1) + v * (column >> 1);
            vec4 front_first, back_first, front_second, back_second;
            finer_light(first + across, part, front_first, back_first);
            finer_light(second + across, part, front_second, back_second);
            fronts += 0.25 * shown(front_first, front_second);
            backs += 0.25 * shown(back_second, back_first);
        }
        imageStore(voxel_radiance, store_texel(own), fronts);
        imageStore(voxel_back, store_texel(own), backs);
        ++own;
    }
}
