// G-buffer: what the camera sees in this sub-frame.
//
// Where a surface covers a pixel in part (alpha) it is there in that share of the sub-frames; its lobes are then its own,
// not faded. Paper §IV-B keeps view-space position and normal, material and depth; here the position is the view depth
// (32 bit) on the pixel's ray, and normals are in world space.

#include "surface/surface_point.glsl"
#if LAYER > 1
#include "engines/ssdo/screen_lib.glsl"
#include "engines/ssdo/layer_lib.glsl"
#endif

void main()
{
    float depth = view_depth(vary_position_ws);
    vec2 uv = gl_FragCoord.xy * view.inverse_resolution;
    SurfacePoint p = surface_point(view_direction_ws(uv));
    Closure c = surface_closure(p);
    float opacity = surface_opacity(c);
    // After the look-ups: a neighbour that is gone has no texture coordinate to take derivatives from.
    if (depth < view.clip_start || depth > view.clip_end) {
        discard;
    }
#if LAYER > 1
    float before = texelFetch(PLANES_BEFORE, ivec2(gl_FragCoord.xy), 0).x;
    if (before <= 0.5 * NOTHING || depth <= depth_of_nearness(before) * BEHIND) {
        discard;
    }
#endif
#if SURFACE_TRANSPARENT
    if (!surface_is_there(opacity, 0u)) {
        discard;
    }
#endif
    // A share of the sub-frames shows the hole: nothing of the surface, and a mark where its bulge would stand.
    bool held = c.holdout > 0.0 && surface_is_there(c.holdout / max(opacity, 1e-6), 2u);
    if (held) {
        c = closure_none();
    }
    if (object_catcher > 0.5) {
        c = closure_none(); // nothing of its own: the film asks for its shadow
    }
    float gain = opacity > 0.0 ? 1.0 / opacity : 1.0;
    vec3 n = safe_normalize(c.normal_ws);
    if (dot(n, n) < 0.5) {
        n = p.normal_ws;
    }
    vec3 ng = p.geometric_normal_ws;
#if LAYER > 1
    // The eye is on neither side of what it does not see: the front counts, as it is modelled.
    float front = 1.0 - 2.0 * p.backfacing;
    n *= front;
    ng *= front;
#endif
    // Rounding of the interpolants alone lifts flat triangles by parts in a million of their place.
    float bulge = surface_bulge();
    gbuf_depth = vec2(depth, object_catcher > 0.5 ? -2.0 : held ? -1.0 : bulge > 1e-5 * length(vary_relative_ws) ? bulge : 0.0);
#if HAS_GBUF_SET
    gbuf_set = object_set;
#endif
#if HAS_GBUF_NORMAL
    gbuf_normal = vec4(octahedral_encode(n), octahedral_encode(ng));
#endif
#if HAS_GBUF_DIFFUSE
    gbuf_diffuse = vec4(c.diffuse * gain, 1.0);
#endif
    Lobe lobe = closure_lobe(c);
#if HAS_GBUF_SPECULAR
    gbuf_specular = vec4(lobe.f0 * gain, lobe.roughness);
#endif
#if HAS_GBUF_LOBE
    gbuf_lobe = vec4(lobe.eta, lobe.f90 * gain, lobe.multiscatter, 0.0);
#endif
#if HAS_GBUF_SUBSURFACE
    float scattered = luminance(c.subsurface);
    gbuf_subsurface = vec4(scattered > 0.0 ? c.subsurface_radius / scattered : vec3(0.0),
                           scattered / max(luminance(c.diffuse), 1e-6));
#endif
#if HAS_GBUF_ENTRY
    gbuf_entry = vec4(luminance(c.subsurface) > 0.0 ? c.subsurface_entry / luminance(c.subsurface) : vec3(1.0), 1.0);
#endif
#if HAS_GBUF_EMISSION
    gbuf_emission = vec4(c.emission * gain, 1.0);
#endif
}
