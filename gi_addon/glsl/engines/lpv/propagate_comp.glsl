// One wave of the propagation: cells on a plane i + j + k = wave, counted along each ordinate's own octant, take what their
// up to three upwind neighbours send. After nx + ny + nz − 2 waves every cell has all its light, however far it came: this is
// the paper's iteration with each cell computed once, when its sources are complete. With a number of iterations set
// (LPV_LIMITED) all cells take their neighbours' light at once, so many times: light then comes that many cells far.
//
// Balance of a cell of edge h for the ordinate ω with outgoing radiance L (donor-cell discretisation of ω·∇L = Q):
//     L h² (|ωx| + |ωy| + |ωz|) = h² Σ_a |ω_a| (1 − κ_a) L_a + Q(ω)
// L_a is the neighbour upwind along axis a, κ_a the covered share of the face between. Each term is a flux per solid angle, so
// that without surfaces flux is conserved exactly; an isotropic field in a closed black cavity is exact too.
//
// Walls at an angle to the grid are corrected for their steps (transport_lib.glsl). Alpha holds what goes on through each open
// face ahead, per L.
//
// Deviation from Kaplanyan and Dachsbacher: they send each cell's flux on as a cosine lobe about the face it passed, which
// turns light by up to 90° per cell: measured in an empty room with one lit wall, the wall opposite gets 0.010 B from 8³ cells
// and under 0.001 B from 16³ where 0.2 B is right, and finer grids are worse (tests/test_lpv.py). Light that keeps its direction
// arrives.

#include "engines/lpv/transport_lib.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main()
{
    ivec3 local = ivec3(gl_GlobalInvocationID.xy, 0);
#if LPV_LIMITED
    int ordinate = int(gl_GlobalInvocationID.z) / grid_size.z;
    local.z = int(gl_GlobalInvocationID.z) - ordinate * grid_size.z;
#else
    int ordinate = int(gl_GlobalInvocationID.z);
    local.z = wave - local.x - local.y;
#endif
    if (!inside_grid(local, grid_size) || ordinate >= batch_count) {
        return;
    }
    vec3 w = ordinates[batch_first + ordinate].xyz;
    bvec3 up = greaterThanEqual(w, vec3(0.0));
    ivec3 cell = ivec3(up.x ? local.x : grid_size.x - 1 - local.x, up.y ? local.y : grid_size.y - 1 - local.y,
                       up.z ? local.z : grid_size.z - 1 - local.z);
    vec3 share = abs(w);
#if LPV_GRIDS > 1
    if (in_rim(cell, grid_size, grid_rim)) {
        return; // has the light of the grid around (rim_comp.glsl)
    }
#endif
#if LPV_LIMITED
    vec3 flux = imageLoad(lpv_emitted, volume_texel(cell, ordinate)).rgb;
#else
    vec3 flux = imageLoad(lpv_radiance, volume_texel(cell, ordinate)).rgb;
#endif
    float whole = share.x + share.y + share.z;
#if HAS_LPV_AIR
    vec3 here = texelFetch(lpv_air, volume_texel(cell, 0), 0).rgb;
#endif
#if HAS_LPV_WALLS
    vec3 covered;
    Way way = way_through(cell, w, covered);
#else
    vec3 covered = vec3(0.0);
    Way way = Way(whole, 1.0, 0.0);
#endif
    for (int axis = 0; axis < 3; ++axis) {
        ivec3 from = cell;
        from[axis] += up[axis] ? -1 : 1;
        if (share[axis] > 0.0 && local[axis] > 0) {
            vec4 neighbour = imageLoad(lpv_radiance, volume_texel(from, ordinate));
#if LPV_LIMITED
            neighbour.rgb *= float(wave > 0); // before the first iteration a cell has only what it emits
#endif
#if HAS_LPV_AIR
            // A straight way crosses |ω|₁/h faces per metre, half of it on either side of each.
            neighbour.rgb *= exp((here + texelFetch(lpv_air, volume_texel(from, 0), 0).rgb) * (-0.5 * grid_cell / whole));
#endif
            flux += (share[axis] * (1.0 - covered[axis]) * neighbour.a) * neighbour.rgb;
        }
    }
    vec4 result = vec4(flux / way.section, way.passed);
#if LPV_LIMITED
    imageStore(lpv_carried, volume_texel(cell, ordinate), result);
#else
    imageStore(lpv_radiance, volume_texel(cell, ordinate), result);
#endif
}
