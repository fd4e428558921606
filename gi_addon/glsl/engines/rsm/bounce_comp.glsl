// The next bounce: points of the surfaces, lit by the virtual lights of the bounce before, are virtual lights themselves
// (A. Keller, "Instant Radiosity", SIGGRAPH 1997, with the light gathered at each point in place of random walks).
//
// A point reflects Φ = albedo · E · A. A surface has two sides: one is drawn by what it reflects, and carries both.

#include "lib/view_lib.glsl"
#include "lib/sequence_lib.glsl"
#include "engines/rsm/gather_lib.glsl"

layout(local_size_x = 64) in;

void main()
{
    int i = int(gl_GlobalInvocationID.x);
    if (i >= point_count) {
        return;
    }
    SurfaceSample s = surface_points[point_first + i];
    // Few points carry all of a sub-frame's further light: discs of full size keep near ones from outshining the rest.
    float alone = float(view.subframes);
    vec3 front = gather_some_vpls(s.position_ws, s.normal_ws, s.normal_ws, bounce_first, 1, alone).radiance * PI;
    vec3 back = gather_some_vpls(s.position_ws, -s.normal_ws, -s.normal_ws, bounce_first, 1, alone).radiance * PI;
    front *= s.albedo;
    back *= s.albedo_back;
    float a = luminance(front);
    float b = luminance(back);
    float u = unit_float(hash_u32(uvec3(uint(i), view.subframe, uint(vpl_count))));
    bool chosen = u * (a + b) < a;
    float share = chosen ? a : b;
    Vpl vpl;
    vpl.position_ws = s.position_ws;
    vpl.normal_ws = chosen ? s.normal_ws : -s.normal_ws;
    vpl.light = -1;
    vpl.anisotropy = 0.0;
    vpl.flux = share > 0.0 ? (chosen ? front : back) * (s.area * (a + b) / share) : vec3(0.0);
    vpl.area = s.area;
    vpl.key = 0u;
    vpl.clear_ws = vpl.position_ws;
#if HAS_OCCUPANCY
    vpl.clear_ws = cells_clear(vpl.position_ws, vpl.normal_ws);
#endif
    vpls[vpl_count + i] = vpl;
}
