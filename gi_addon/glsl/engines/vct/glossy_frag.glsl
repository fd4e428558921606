// What the glossy lobe reflects: one cone per sub-frame about a direction drawn from the visible normals of GGX, as wide as
// its share of the lobe; at roughness 0 a ray march.
//
// GGX slopes have variance α²/2 per axis (Beckmann's relation), the mirrored direction turns twice as far: 2α². A uniform
// cone of angle θ has θ²/4, so θ = 2√2 α; a set of S cones divides the lobe, θ/√S each. The estimate of a direction
// drawn that way is L F G2/G1 (E. Heitz, JCGT 7(4), 2018, eq. 19).

#include "lib/view_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "lib/bsdf_lib.glsl"
#include "lib/reflection_lib.glsl"
#include "engines/vct/seen_lib.glsl"
#include "engines/vct/clear_lib.glsl"

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float depth = texelFetch(gbuf_depth, pixel, 0).r;
    traced = NO_LOBE;
    traced_ray = vec4(0.0);
    Lobe lobe = lobe_unpack(texelFetch(gbuf_specular, pixel, 0), texelFetch(gbuf_lobe, pixel, 0));
    if (depth <= 0.0 || !lobe_reflects(lobe)) {
        return;
    }
    // Each pixel turns the sequence by its own number (R. Cranley and T. Patterson, 1976).
    vec2 turn = unit_shift(hash_u32(uvec2(pixel + view.pixel_offset)));
    ReflectedRay ray = reflected_ray(pixel, fract(sobol_2d(view.subframe, 43u) + turn));
    traced = NO_LIGHT;
    traced_ray = vec4(ray.direction, ray.pdf);
    if (ray.passes) {
        Grid grid = voxel_grid();
        float spread = min(2.0 * sqrt(2.0 / cone_sets) * ray.alpha, 1.0);
        Cone cone = surface_cone(grid, ray.position_ws, ray.ng, ray.direction, spread, 1e30);
        float clear = clear_reach(ray.position_ws, ray.direction, grid.cell);
        if (clear > 0.0) {
            cone.start += clear * ray.direction;
            cone.leaving = 0.0;
        }
        ConeResult result = trace_seen(grid, cone);
        traced = traced_light(result.radiance, (clear + result.first.t) * grid.cell);
    }
}
