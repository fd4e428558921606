// The sources' harmonics along each ordinate of the batch: what a cell emits in that direction, Q(ω)/h².
//
// Orders 0 to 2 of a cosine lobe are 4 to 8 % too weak at 45° to 60° (a floor lights the foot of a wall with .96 of its light);
// order 3 is none, and order 4, −9/(96π) P₄(cosθ) per watt, leaves 2 %. It need not be stored: lobes that are spread about one
// normal as by a random walk on the sphere have moments m^(l(l+1)/2) of order l, m being that of order 1. So order 4 comes in
// about the mean normal of the cell's walls with m¹⁰, m the length of that mean: whole in a cell of one flat wall (m = 1), gone
// in one of two walls at a right angle (m = 1/√2). It carries no flux, and depends on no light: lights add up.

#include "engines/lpv/geometry_lib.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

// Order 4 of the cell's lobes in direction w, per coefficient of order 0.
float order_4(ivec3 cell, vec3 w)
{
#if HAS_LPV_WALLS
    vec3 sum = vec3(0.0);
    float covered = 0.0;
    for (int i = 0; i < 6; ++i) {
        int axis = i >> 1;
        ivec3 upper = cell;
        upper[axis] += i & 1;
        if (upper[axis] > 0 && upper[axis] < grid_size[axis]) {
            vec4 wall = lpv_walls[face_index(upper, axis)];
            sum += wall_normal(wall, axis) * ((i & 1) == 1 ? -wall.x : wall.x);
            covered += wall.x;
        }
    }
    float size = length(sum);
    if (size > 0.0) {
        float m2 = sqr(min(size / covered, 1.0));
        float x2 = sqr(dot(sum, w) / size);
        float legendre = ((35.0 * x2 - 30.0) * x2 + 3.0) / 8.0;
        return -9.0 / (96.0 * PI) * legendre * (m2 * m2 * m2 * m2 * m2) / 0.28209479177; // per Y of order 0, 1/(2√π)
    }
#endif
    return 0.0;
}

void main()
{
    ivec3 at = ivec3(gl_GlobalInvocationID); // z: cell and ordinate
    if (at.x >= grid_size.x || at.y >= grid_size.y || at.z >= grid_size.z * batch_count) {
        return;
    }
    int ordinate = at.z / grid_size.z;
    int z = at.z - ordinate * grid_size.z;
    vec3 w = ordinates[batch_first + ordinate].xyz;
    float y[SH_COUNT];
    sh_basis(w, y);
    vec3 sum = vec3(0.0);
    vec3 flux = vec3(0.0); // × Y00
    for (int c = 0; c < SH_COUNT; ++c) {
        ivec3 texel = volume_texel(ivec3(at.xy, z), c);
#if HAS_LPV_BOUNCED
        vec3 value = bounced == 1 ? imageLoad(lpv_bounced, texel).rgb : source_scale * texelFetch(lpv_source, texel, 0).rgb;
#else
        vec3 value = source_scale * texelFetch(lpv_source, texel, 0).rgb;
#endif
        sum += value * y[c];
        flux += c == 0 ? value : vec3(0.0);
    }
    if (max3(abs(flux)) > 0.0) {
        sum += flux * order_4(ivec3(at.xy, z), w);
    }
#if LPV_LIMITED
    imageStore(lpv_emitted, volume_texel(at, 0), vec4(sum, 0.0));
#else
    imageStore(lpv_radiance, volume_texel(at, 0), vec4(sum, 0.0));
#endif
}
