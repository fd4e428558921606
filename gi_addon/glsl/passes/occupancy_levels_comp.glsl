// The largest empty block that holds each cell: how far a ray may jump from there.

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;
layout(binding = 0) uniform sampler3D cells;
layout(binding = 0, r8) writeonly uniform image3D free_blocks;

void main()
{
    ivec3 p = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(p, imageSize(free_blocks)))) {
        return;
    }
    float level = 0.0;
    bool open = true;
    for (int k = 0; k <= 5; ++k) {
        open = open && texelFetch(cells, p >> k, k).r < 0.5;
        level += open ? 1.0 : 0.0;
    }
    imageStore(free_blocks, p, vec4(level / 255.0));
}
