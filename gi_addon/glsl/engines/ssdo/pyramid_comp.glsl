// Nearness of what is nearest in each 2 × 2, 4 × 4 … pixels: what a ray in front of passes over in one step (Y. Uludag, "Hi-Z
// Screen-Space Cone-Traced Reflections", GPU Pro 5, 2014). At the first level a pixel's own plane over its whole square.

layout(local_size_x = 8, local_size_y = 8) in;

#if FIRST_LEVEL
layout(binding = 0, r32f) writeonly uniform image2D coarser;
#else
layout(binding = 0, r32f) readonly uniform image2D finer;
layout(binding = 1, r32f) writeonly uniform image2D coarser;
#endif

void main()
{
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = imageSize(coarser);
    if (any(greaterThanEqual(p, size))) {
        return;
    }
#if FIRST_LEVEL
    vec4 plane = texelFetch(ssdo_planes, p, 0);
    imageStore(coarser, p, vec4(plane.x + 0.5 * (abs(plane.y) + abs(plane.z))));
#else
    ivec2 last = imageSize(finer) - 1;
    // Sizes halve downwards: the last texel of a level holds what is left over of the finer one.
    ivec2 low = min(2 * p, last);
    ivec2 high = ivec2(p.x == size.x - 1 ? last.x : min(2 * p.x + 1, last.x), p.y == size.y - 1 ? last.y : min(2 * p.y + 1, last.y));
    float nearest = -1e30;
    for (int y = 0; y < 3; ++y) {
        for (int x = 0; x < 3; ++x) {
            nearest = max(nearest, imageLoad(finer, min(low + ivec2(x, y), high)).r);
        }
    }
    imageStore(coarser, p, vec4(nearest));
#endif
}
