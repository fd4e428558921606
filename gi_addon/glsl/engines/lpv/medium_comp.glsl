// The air of each cell: mean extinction and scattering per metre, and the mean cosine of its scattering by what scatters, from
// the media that its points are in.

#include "engines/lpv/lpv_lib.glsl"
#include "lib/medium_lib.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

const int SIDE = 4; // points of a cell along each axis

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    if (!inside_grid(cell, grid_size)) {
        return;
    }
    vec3 extinction = vec3(0.0);
    vec3 scattering = vec3(0.0);
    float turned = 0.0;
    for (int k = 0; k < MEDIA; ++k) {
        float count = 0.0;
        for (int i = 0; i < SIDE * SIDE * SIDE; ++i) {
            vec3 at = (vec3(i % SIDE, (i / SIDE) % SIDE, i / (SIDE * SIDE)) + 0.5) / float(SIDE);
            count += float(in_medium(k, grid_origin + (vec3(cell) + at) * grid_cell));
        }
        float share = count / float(SIDE * SIDE * SIDE);
        extinction += share * medium_extinction[k].rgb;
        scattering += share * medium_scattering[k].rgb;
        turned += share * medium_scattering[k].w * vector_mean(medium_scattering[k].rgb);
    }
    float scatters = vector_mean(scattering);
    imageStore(lpv_air, volume_texel(cell, 0), vec4(extinction, 0.0));
    imageStore(lpv_air, volume_texel(cell, 1), vec4(scattering, scatters > 0.0 ? turned / scatters : 0.0));
}
