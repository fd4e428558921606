// Radiance injection: every texel of a reflective shadow map gives its flux to the cell in front of its surface.
// A. Kaplanyan and C. Dachsbacher, "Cascaded Light Propagation Volumes", I3D 2010, §3.3.
//
// Intensity leaving a Lambertian surface element of flux Φ is Φ cosθ/π, W/sr. All texels are injected, each with the flux of
// its own share of the light, so that the sum is the reflected flux at any resolution of map or grid. Sums are integers
// (`fixed_scale` units per W), the same in any order; what is cut off below a unit is rounded by a hash of the texel, which
// leaves no bias.

#include "engines/rsm/rsm_lib.glsl"
#include "engines/lpv/geometry_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "lib/view_lib.glsl"
#if HAS_VOXEL_BODIES
#include "engines/lpv/bodies_lib.glsl"
#endif

layout(local_size_x = 8, local_size_y = 8) in;

void main()
{
    vec4 rect = rsm_views[tile].rect;
    if (any(greaterThanEqual(vec2(gl_GlobalInvocationID.xy), rect.zw))) {
        return;
    }
    ivec2 pixel = ivec2(rect.xy) + ivec2(gl_GlobalInvocationID.xy);
    RsmTexel t = rsm_texel(tile, pixel);
    if (!is_finite(t.flux) || max3(t.flux) <= 0.0) {
        return;
    }
    // A surface that lies closer to the emissive mesh that lights it than the grid can tell is covered by it: what it sends
    // back into the mesh, form factor K A/(1 + K A) of a disc of the source's area A (gather_lib.glsl), goes nowhere else.
    Light light = rsm_lights[rsm_views[tile].light];
    if (light.kind == LIGHT_MESH) {
        vec3 d = light.position_ws - t.position_ws;
        float d2 = max(dot(d, d), 1e-30);
        if (d2 < sqr(grid_cell)) {
            float facing = max(dot(d, t.normal_ws), 0.0) * abs(dot(d, light.axis_ws)) / (PI * d2 * d2);
            t.flux /= 1.0 + facing * PI * sqr(light.patch_radius) * float(view.subframes);
        }
    }
#if HAS_VOXEL_BODIES
    through_body(t, hash_u32(uvec3(uvec2(pixel), view.subframe)));
#endif
    vec3 at = (t.position_ws - grid_origin) / grid_cell;
    if (any(lessThan(at, vec3(-1.0))) || any(greaterThan(at, vec3(grid_size) + 1.0))) {
        return; // a backdrop far outside (gi_addon/focus.py)
    }
#if LPV_GRIDS > 1
    if (grid_rim != 0 && !inside_grid(ivec3(floor(at + t.normal_ws * half_cell_shift(t.normal_ws))), grid_size)) {
        return; // only the grid around has it
    }
#endif
    ivec3 cell = cell_in_front(at, t.normal_ws, grid_size);
    int base = cell_index(cell, grid_size) * SH_COUNT * 3;
    float y[SH_COUNT];
    sh_basis(t.normal_ws, y);
    float dither = unit_float(hash_u32(uvec2(pixel)));
    for (int c = 0; c < SH_COUNT; ++c) {
        vec3 units = floor(t.flux * (sh_cosine_share(c) * y[c] * fixed_scale) + dither);
        for (int k = 0; k < 3; ++k) {
            if (units[k] != 0.0) {
                atomicAdd(lpv_flux[base + c * 3 + k], int(units[k]));
            }
        }
    }
}
