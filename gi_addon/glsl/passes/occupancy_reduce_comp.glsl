// A block is occupied where any of its eight is.

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;
layout(binding = 0, r8) readonly uniform image3D finer;
layout(binding = 1, r8) writeonly uniform image3D coarser;

void main()
{
    ivec3 p = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(p, imageSize(coarser)))) {
        return;
    }
    float any_ = 0.0;
    for (int k = 0; k < 8; ++k) {
        any_ = max(any_, imageLoad(finer, 2 * p + ivec3(k & 1, k >> 1 & 1, k >> 2)).r);
    }
    imageStore(coarser, p, vec4(any_));
}
