// Geometry injection: the scene rasterised along one axis, 5 × 5 points a cell. Each fragment covers its point of the column
// between the two cell centres it lies between (geometry_lib.glsl). Per face: bits of the covered points; how many fragments;
// sums of their places and of their normals' two components, in 1/255 of the range. Integers: the order of fragments is nothing.

#if SURFACE_FULL
#include "surface/surface_point.glsl"
#else
in vec3 vary_position_ws;
#endif

#include "engines/lpv/geometry_lib.glsl"

const int WORDS = 5;

void main()
{
    vec3 ng = safe_normalize(cross(dFdx(vary_position_ws), dFdy(vary_position_ws)));
#if SURFACE_FULL
    // Seen from its front: a wall whose back is cut away is a wall.
    Closure c = surface_closure(surface_point(dot(vary_normal_ws, ng) < 0.0 ? -ng : ng));
    float opacity = surface_opacity(c);
    if (!surface_is_there(opacity, 2u)) {
        discard;
    }
#endif
    vec3 at = (vary_position_ws - grid_origin) / grid_cell;
    float layer = floor(at[axis] + 0.5); // the face's place along its axis; the slab reaches half a cell to each side
    ivec3 cell = ivec3(ivec2(gl_FragCoord.xy) / LPV_POINTS, 0);
    cell = axis == 0 ? ivec3(0, cell.x, cell.y) : axis == 1 ? ivec3(cell.y, 0, cell.x) : cell;
    cell[axis] = int(layer);
    lpv_raster = 1.0;
    if (!inside_grid(cell, grid_size)) {
        return;
    }
    ivec2 point = ivec2(gl_FragCoord.xy) % LPV_POINTS;
    int face = (cell_index(cell, grid_size) * 3 + axis) * WORDS;
    atomicOr(lpv_faces[face], 1u << (point.y * LPV_POINTS + point.x));
    atomicAdd(lpv_faces[face + 1], 1u);
    atomicAdd(lpv_faces[face + 2], uint((at[axis] + 0.5 - layer) * 255.0 + 0.5));
    vec3 upward = ng[axis] >= 0.0 ? ng : -ng;
    vec2 across = axis == 0 ? upward.yz : axis == 1 ? upward.zx : upward.xy;
    uvec2 units = uvec2((across + 1.0) * 127.5 + 0.5);
    atomicAdd(lpv_faces[face + 3], units.x);
    atomicAdd(lpv_faces[face + 4], units.y);
#if HAS_LPV_ALBEDO
    vec3 albedo = c.diffuse;
#if SURFACE_TABLES > 0
    albedo += lobe_albedo_average(brdf_average, brdf_energy, closure_lobe(c));
#endif
    vec3 share = saturate(albedo / max(opacity, 1e-4));
    for (int k = 0; k < 3; ++k) {
        atomicAdd(lpv_albedo[face_index(cell, axis) * 3 + k], uint(share[k] * LPV_ALBEDO_UNITS));
    }
#endif
}
