// What mirrors and panes show.

#include "engines/vct/diffuse_lib.glsl"

// Cones that the light of one more bounce is gathered by where a mirror or a pane shows a surface. Sub-frames add to them.
const int SEEN_CONES = 2;

// What a mirror or a pane shows: a surface with what light it gathers and scatters on. Cells hold the light that
// arrives at surfaces by one bounce less.
ConeResult trace_seen(Grid grid, Cone cone)
{
    ConeResult seen = trace_cone(voxel_radiance, voxel_back, voxel_sheets, voxel_rows, voxel_kinds, grid, cone);
    Meeting met = seen.first;
    if (met.opacity > 0.0) {
        mat3 frame = frame_from_normal(met.normal);
        vec3 start = cone.start + cone.direction * met.t + LIFT * met.normal;
        float spread = cone_spread(1.0 / (float(SEEN_CONES) * cone_sets));
        uint run = hash_u32(uvec2(gl_FragCoord.xy)) + view.subframe * uint(SEEN_CONES);
        vec3 gathered = vec3(0.0);
        vec4 albedo = sheet_albedo(voxel_sheets, met.number);
        for (int i = 0; i < SEEN_CONES; ++i) {
            Cone next = Cone(start, frame * cone_direction(run + uint(i)), spread, 1e30, met.front ? 1.0 : -1.0);
            gathered += trace_cone(voxel_radiance, voxel_back, voxel_sheets, voxel_rows, voxel_kinds, grid, next).radiance;
        }
        seen.radiance += albedo.rgb * albedo.a * gathered * (met.opacity / float(SEEN_CONES));
    }
    return seen;
}
