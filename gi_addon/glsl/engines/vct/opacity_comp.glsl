// Optical depth of a level's cells from their coverage (volume_lib.glsl, cell_alpha).

#include "engines/vct/volume_lib.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;
layout(binding = 2) uniform sampler3D coverage;
layout(binding = 3, rgba16f) writeonly uniform image3D alpha;

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    if (all(lessThan(cell, size))) {
        imageStore(alpha, cell, vec4(cell_alpha(coverage, cell, level), 0.0));
    }
}
