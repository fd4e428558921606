// The surface that a block of the low-resolution gather stands for. Included after view_lib, math_lib and sequence_lib, where the
// low-resolution G-buffer is declared.

#include "passes/gather_grid.glsl"

const float SAME_FACING = 0.906; // cos 25°

struct Receiver {
    bool exists;
    ivec2 pixel;
    float depth;
    vec3 position_ws;
    vec3 n;     // shading normal
    vec3 ng;    // the triangle's
};

Receiver gather_receiver(ivec2 block)
{
    float depth = texelFetch(low_depth, block, 0).r;
    ivec2 pixel = gather_grid_pixel(block, texelFetch(low_pixel, block, 0).rg);
    vec3 position_ws = position_ws_from_depth((vec2(pixel) + 0.5) * view.inverse_resolution, depth);
    vec4 normals = texelFetch(low_normal, block, 0);
    return Receiver(depth > 0.0, pixel, depth, position_ws, octahedral_decode(normals.xy), octahedral_decode(normals.zw));
}

// Whether it lies on the surface of normal `ng` through a point, the plane missed by no more than `off_plane` (m).
bool on_surface(Receiver r, vec3 position_ws, vec3 ng, float off_plane)
{
    return r.exists && dot(r.ng, ng) >= SAME_FACING && abs(dot(r.position_ws - position_ws, ng)) <= off_plane;
}
