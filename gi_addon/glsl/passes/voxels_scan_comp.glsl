// How many sheets are before each row, of what each has: every thread adds up its share of the rows, one thread the threads' sums.

#include "passes/voxel_store.glsl"

layout(local_size_x = 256) in;
layout(binding = 6, r32ui) uniform uimage2D rows_now;

shared uint sums[256];

void main()
{
    uint thread = gl_LocalInvocationID.x;
    uint each = (row_count + 255u) / 256u;
    uint first = min(thread * each, row_count);
    uint last = min(first + each, row_count);
    uint sum = 0u;
    for (uint row = first; row < last; ++row) {
        sum += imageLoad(rows_now, store_texel(row)).r;
    }
    sums[thread] = sum;
    barrier();
    if (thread == 0u) {
        uint before = 0u;
        for (int i = 0; i < 256; ++i) {
            uint own = sums[i];
            sums[i] = before;
            before += own;
        }
        imageStore(rows_now, store_texel(row_count), uvec4(before));
        voxel_total[1] = before;
    }
    barrier();
    sum = sums[thread];
    for (uint row = first; row < last; ++row) {
        if (row == cell_rows) {
            voxel_total[0] = sum; // all rows of the cells are before
        }
        uint own = imageLoad(rows_now, store_texel(row)).r;
        imageStore(rows_now, store_texel(row), uvec4(sum));
        sum += own;
    }
}
