// Light that comes into an inner grid: the cells of its rim have the radiance of the grid around it, along each ordinate.
//
// That grid, the one at hand here, has all the scene's light at its own coarser cells. The inner grid carries on from there, so
// what is outside of it reaches it, and what its own surfaces send out is already part of the grid around. Rims are whole cells,
// not faces, so that walls between them and the next cells are the inner grid's own. A value is the mean of the eight cells
// around, without those behind a wall.

#include "engines/lpv/geometry_lib.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID); // z: cell and ordinate
    int ordinate = cell.z / inner_size.z;
    ivec3 texel = cell + ivec3(inner_column, 0, 0);
    cell.z -= ordinate * inner_size.z;
    if (!inside_grid(cell, inner_size) || ordinate >= batch_count || !in_rim(cell, inner_size, inner_rim)) {
        return;
    }
    vec3 at = vec3(inner_low) + 0.5 * (vec3(cell) + 0.5);
    vec3 base = floor(at - 0.5);
    vec3 f = at - 0.5 - base;
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 8; ++i) {
        ivec3 corner = ivec3(i & 1, (i >> 1) & 1, i >> 2);
        ivec3 other = ivec3(base) + corner;
        vec3 t = mix(1.0 - f, f, vec3(corner));
        float weight = t.x * t.y * t.z;
        if (!inside_grid(other, grid_size)) {
            continue;
        }
#if HAS_LPV_WALLS
        weight *= open_way(at, other);
#endif
        sum += weight * vec4(imageLoad(lpv_radiance, volume_texel(other, ordinate)).rgb, 1.0);
    }
    imageStore(lpv_radiance, texel, vec4(sum.a > 0.0 ? sum.rgb / sum.a : vec3(0.0), 1.0)); // alpha: all of it goes on
}
