// The sources' harmonics along each ordinate of the batch: what a cell emits in that direction, Q(ω)/h².

#include "engines/lpv/lpv_lib.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

void main()
{
    ivec3 at = ivec3(gl_GlobalInvocationID); // z: cell and ordinate
    if (at.x >= grid_size.x || at.y >= grid_size.y || at.z >= grid_size.z * batch_count) {
        return;
    }
    int ordinate = at.z / grid_size.z;
    int z = at.z - ordinate * grid_size.z;
    float y[SH_COUNT];
    sh_basis(ordinates[batch_first + ordinate].xyz, y);
    vec3 sum = vec3(0.0);
    for (int c = 0; c < SH_COUNT; ++c) {
        ivec3 texel = ivec3(at.xy, z + c * grid_size.z);
#if HAS_LPV_BOUNCED
        vec3 value = bounced == 1 ? imageLoad(lpv_bounced, texel).rgb : source_scale * texelFetch(lpv_source, texel, 0).rgb;
#else
        vec3 value = source_scale * texelFetch(lpv_source, texel, 0).rgb;
#endif
        sum += value * y[c];
    }
#if LPV_LIMITED
    imageStore(lpv_emitted, at, vec4(sum, 0.0));
#else
    imageStore(lpv_radiance, at, vec4(sum, 0.0));
#endif
}
