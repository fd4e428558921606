// A point of the picture that light is gathered for. Included after view_lib and math_lib.

const float SAME_FACING = 0.906; // cos 25°

struct Receiver {
    bool exists;
    ivec2 pixel;
    float depth;
    vec3 position_ws;
    vec3 n;     // shading normal
    vec3 ng;    // the triangle's
};

Receiver receiver_of(ivec2 pixel, float depth, vec4 normals)
{
    vec3 position_ws = position_ws_from_depth((vec2(pixel) + 0.5) * view.inverse_resolution, depth);
    return Receiver(depth > 0.0, pixel, depth, position_ws, octahedral_decode(normals.xy), octahedral_decode(normals.zw));
}

// Whether it lies on the surface of normal `ng` through a point, the plane missed by no more than `off_plane` (m).
bool on_surface(Receiver r, vec3 position_ws, vec3 ng, float off_plane)
{
    return r.exists && dot(r.ng, ng) >= SAME_FACING && abs(dot(r.position_ws - position_ws, ng)) <= off_plane;
}

// The pairs of opposite neighbours in a grid, and their weight in a tent of three by three.
const int PAIRS = 4;
const ivec2 PAIR[PAIRS] = ivec2[PAIRS](ivec2(1, 0), ivec2(0, 1), ivec2(1, 1), ivec2(1, -1));
const float WEIGHT[PAIRS] = float[PAIRS](0.5, 0.5, 0.25, 0.25);
