// One level of the flux pyramid: sums, in a fixed order.

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0, r32f) readonly uniform image2D finer;
layout(binding = 1, r32f) writeonly uniform image2D coarser;

void main()
{
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, imageSize(coarser)))) {
        return;
    }
    ivec2 size = imageSize(finer);
    // A level that is one texel wide already has one column of children.
    ivec2 step_ = ivec2(size.x > 1 ? 2 : 1, size.y > 1 ? 2 : 1);
    float sum = 0.0;
    for (int y = 0; y < step_.y; ++y) {
        for (int x = 0; x < step_.x; ++x) {
            sum += imageLoad(finer, p * step_ + ivec2(x, y)).r;
        }
    }
    imageStore(coarser, p, vec4(sum));
}
