// What a ray sees of the surfaces that the lights see: ray casts in the RSMs (the paper's §IV-B; T. Lambru et al. on rays
// in RSM pixels). The grid of cells finds where along the ray there is anything at all; there, the ray is compared with
// each light's map, and where it passes from before the map's surface to behind it, that surface is what it sees. A ray
// that finds nothing adds nothing. Included where the RSM's textures, `occupancy`, `rsm_light_count` and cells are declared.

#ifndef RAY_SEES_EMISSION
#define RAY_SEES_EMISSION 0 // a mirror's view of emitters is direct light, which has its own pass
#endif
#include "engines/rsm/rsm_lib.glsl"
#include "lib/occupancy_lib.glsl"
#if HAS_VPLS
#include "engines/rsm/gather_lib.glsl"
#endif

// What a surface that a ray has met reflects besides the light that its light's map tells: bounces, W/(m²·sr). Negative
// `albedo`: no map shows it, and `normal_ws` is nothing. `u` in [0, 1). RSM's own are the virtual lights; who has a volume
// defines RAY_BOUNCES and the function.
#ifndef RAY_BOUNCES
#define RAY_BOUNCES HAS_VPLS
#endif
#if RAY_BOUNCES
vec3 ray_bounces(vec3 position_ws, vec3 normal_ws, vec3 albedo, vec3 direction, float u);
#endif

// Runs of occupied cells that a ray may graze before it is given up.
const int RAY_RUNS = 6;
// Points of a run that are compared with a map, and halvings of the interval in which the ray passes the surface.
const int RAY_POINTS = 8;
const int RAY_HALVINGS = 4;
// Virtual lights that light a point which the picture does not show: an even share of them, another one for every ray.
const int RAY_VPLS = 4;
// Points between a ray's start and where it is clear of its own surface's cells, at which the picture is asked for contacts.
// Rays that graze their surface are asked for so many cells at most.
const int CONTACT_POINTS = 6;
const float CONTACT_CELLS = 6.0;
const float NO_SURFACE = 1e30;
// A surface that faces as the ray's own does (within 45°) and is not half a cell above it is that one: half of what its
// place is known to.
const float OWN_FACING = 0.707;
const float OWN_HEIGHT = 0.5;

// How far behind a point (along the map's axis) the surface is that light `light` sees in its direction; negative: the
// point is behind it. `known` is false outside the light's maps.
float rsm_gap(Light light, vec3 position_ws, out bool known, out int index, out ivec2 texel)
{
    index = rsm_view_of(light, position_ws);
    LightView v = rsm_views[index];
    vec3 p = light_view_project(v, position_ws);
    known = p.z > v.near && all(lessThan(abs(p.xy), vec2(1.0)));
    texel = ivec2(v.rect.xy + (p.xy / v.guard * 0.5 + 0.5) * v.rect.zw);
    if (!known) {
        return NO_SURFACE;
    }
    float depth = texelFetch(rsm_depth, texel, 0).r;
    return depth > 0.0 ? depth - p.z : NO_SURFACE;
}

#if HAS_GBUF_DIFFUSE
// What the picture itself shows of a point: all its light, where a light's map knows what the light alone gives. False where
// the picture shows something else.
bool screen_radiance(vec3 position_ws, vec3 direction, out vec3 radiance)
{
    vec3 s = project_ws(position_ws);
    radiance = vec3(0.0);
    if (s.z <= view.clip_start || any(lessThan(s.xy, vec2(0.0))) || any(greaterThanEqual(s.xy, vec2(1.0)))) {
        return false;
    }
    ivec2 pixel = ivec2(s.xy * view.resolution);
    float depth = texelFetch(gbuf_depth, pixel, 0).r;
    if (depth <= 0.0 || abs(depth - s.z) > cell_size ||
        dot(octahedral_decode(texelFetch(gbuf_normal, pixel, 0).zw), direction) >= 0.0) {
        return false;
    }
    vec3 diffuse = texelFetch(gbuf_diffuse, pixel, 0).rgb;
    // A metal's picture hangs on who looks.
    vec3 emission = vec3(0.0);
#if RAY_SEES_EMISSION && HAS_GBUF_EMISSION
    emission = texelFetch(gbuf_emission, pixel, 0).rgb;
#endif
    if (max3(diffuse + emission) <= 0.0) {
        return false;
    }
#if HAS_DIRECT_DIFFUSE
    radiance += texelFetch(direct_diffuse, pixel, 0).rgb;
#endif
#if HAS_INDIRECT_DIFFUSE
    radiance += texelFetch(indirect_diffuse, pixel, 0).rgb;
#endif
    radiance = radiance * diffuse + emission;
    return true;
}
#endif

// Whether the ray meets a surface that the picture shows within `reach` (m): it passes through the plane of a pixel that it is
// seen at, from before it to less than a cell behind.
bool meets_on_screen(vec3 origin_ws, vec3 direction, float reach, out float distance)
{
    bool met = false;
    distance = NO_SURFACE;
    for (int k = 1; k <= CONTACT_POINTS; ++k) {
        vec3 p = origin_ws + direction * (reach * float(k) / float(CONTACT_POINTS));
        vec3 s = project_ws(p);
        ivec2 pixel = ivec2(s.xy * view.resolution);
        if (met || s.z <= view.clip_start || any(lessThan(s.xy, vec2(0.0))) || any(greaterThanEqual(s.xy, vec2(1.0)))) {
            continue;
        }
        float depth = texelFetch(gbuf_depth, pixel, 0).r;
        vec3 shown = position_ws_from_depth((vec2(pixel) + 0.5) * view.inverse_resolution, depth);
        vec3 n = octahedral_decode(texelFetch(gbuf_normal, pixel, 0).zw);
        float before = dot(origin_ws - shown, n);
        float behind = dot(shown - p, n);
        if (depth > 0.0 && before > 0.0 && behind >= 0.0 && behind < cell_size && abs(depth - s.z) < cell_size) {
            met = true;
            distance = before / max(-dot(direction, n), 1e-6);
        }
    }
    return met;
}

// Radiance along the ray, W/(m²·sr), with a unit `direction`, from a surface of geometric normal `ng` on the ray's side;
// `hit` whether anything is there. Cells before the ray is clear of its own surface's may be that surface's: of them only
// what the picture shows or a light's map confirms counts: a surface whose lit side the ray enters, or that it would leave by that
// side, coming from its dark one (from a room through its wall into the sun). `u` in [0, 1) chooses among virtual lights.
vec3 rsm_ray(vec3 origin_ws, vec3 direction, vec3 ng, float u, out bool hit, out float distance)
{
    float clear = dot(abs(ng), vec3(1.0)) / max(dot(direction, ng), 1e-3);
    vec3 start = (origin_ws - cell_origin_ws) / cell_size;
    vec3 d = mix(direction, vec3(1e-6), lessThan(abs(direction), vec3(1e-6)));
    float far = cells_far(start, d);
    float t = 0.0;
    bool free_before = true; // the run that the ray starts in counts, too: contacts
    vec3 radiance = vec3(0.0);
    vec3 albedo = vec3(-1.0);
    vec3 normal_ws = vec3(0.0);
    hit = false;
    distance = NO_SURFACE;
#if HAS_GBUF_DIFFUSE
    vec3 seen;
    if (meets_on_screen(origin_ws, direction, min(clear + 1.0, CONTACT_CELLS) * cell_size, distance)) {
        hit = true;
        return screen_radiance(origin_ws + direction * distance, direction, seen) ? seen : vec3(0.0);
    }
#endif
    for (int r = 0; r < RAY_RUNS; ++r) {
        vec2 run;
        if (hit || !cells_next_run(start, d, far, t, free_before, run)) {
            break;
        }
        // A cell before and behind: the surface may stand anywhere in its own.
        float low = max(run.x - 1.0, 0.0) * cell_size;
        float step_ = (min(run.y + 1.0, far) * cell_size - low) / float(RAY_POINTS);
        bool lit_through = false;
        float stop = NO_SURFACE; // the first surface that is met from its dark side
        vec3 stop_albedo = vec3(-1.0);
        vec3 stop_normal = vec3(0.0);
        for (int i = 0; i < rsm_light_count; ++i) {
            Light light = rsm_lights[i];
            if (light.views <= 0) {
                continue;
            }
            bool before = false;
            bool all_lit = true;
            bool found = false;
            bool under = false;
            bool leaves = false;
            float leaves_at = low;
            float a = low;
            float b = low;
            for (int k = 0; k <= RAY_POINTS; ++k) {
                bool known;
                int index;
                ivec2 texel;
                float at = low + step_ * float(k);
                float gap = rsm_gap(light, origin_ws + direction * at, known, index, texel);
                all_lit = all_lit && known && gap > 0.0;
                if (!found) {
                    // Farther behind than the ray went since the last point: it entered the shadow of something else.
                    found = before && known && gap <= 0.0 && gap > -(step_ + cell_size);
                    b = at;
                    a = found ? at - step_ : a;
                    before = known && gap > 0.0;
                    if (!leaves && under && before) {
                        leaves = true;
                        leaves_at = at;
                    }
                    under = known && gap <= 0.0;
                }
            }
            lit_through = lit_through || all_lit;
            if (leaves) {
                int index = 0;
                ivec2 texel = ivec2(0);
                float under_at = leaves_at - step_;
                float behind = NO_SURFACE;
                for (int k = 0; k < RAY_HALVINGS; ++k) {
                    bool known;
                    float middle = 0.5 * (under_at + leaves_at);
                    float gap = rsm_gap(light, origin_ws + direction * middle, known, index, texel);
                    behind = gap <= 0.0 ? -gap : behind;
                    under_at = gap <= 0.0 ? middle : under_at;
                    leaves_at = gap <= 0.0 ? leaves_at : middle;
                }
                bool known;
                float gap = rsm_gap(light, origin_ws + direction * leaves_at, known, index, texel);
                // At a shadow's edge in the air the map's depth jumps.
                known = known && gap < cell_size && (behind < cell_size || behind == NO_SURFACE);
                RsmTexel s = rsm_texel(index, texel);
                bool own = abs(dot(s.normal_ws, ng)) > OWN_FACING && leaves_at * dot(direction, ng) < OWN_HEIGHT * cell_size;
                if (known && s.area > 0.0 && dot(s.normal_ws, direction) > 0.0 && !own && leaves_at < stop) {
                    stop = leaves_at;
                    stop_albedo = texelFetch(rsm_albedo, texel, 0).rgb;
                    stop_normal = -s.normal_ws;
                }
            }
            if (!found) {
                continue;
            }
            int index = 0;
            ivec2 texel = ivec2(0);
            for (int k = 0; k < RAY_HALVINGS; ++k) {
                bool known;
                float middle = 0.5 * (a + b);
                bool behind = rsm_gap(light, origin_ws + direction * middle, known, index, texel) <= 0.0;
                a = behind ? a : middle;
                b = behind ? middle : b;
            }
            bool known;
            float gap = rsm_gap(light, origin_ws + direction * b, known, index, texel);
            RsmTexel s = rsm_texel(index, texel);
            // A light below a sheet without thickness sees its underside, which the ray has just left.
            bool left = abs(dot(s.normal_ws, ng)) > OWN_FACING && b * dot(direction, ng) < OWN_HEIGHT * cell_size;
            if (known && gap > -cell_size && s.area > 0.0 && dot(s.normal_ws, direction) < 0.0 && !left) {
                radiance += s.flux * (INV_PI / s.area);
                if (b < distance) {
                    distance = b;
                    albedo = texelFetch(rsm_albedo, texel, 0).rgb;
                    normal_ws = s.normal_ws;
                }
                hit = true;
            }
        }
        if (stop < distance - OWN_HEIGHT * cell_size) {
            hit = true;
            radiance = vec3(0.0);
            distance = stop;
            albedo = stop_albedo;
            normal_ws = stop_normal;
        }
        // Seen by no light, and not seen past by any: an unlit surface ends the ray.
        if (!hit && !lit_through && run.x > clear) {
            hit = true;
            distance = run.x * cell_size;
        }
    }
#if HAS_GBUF_DIFFUSE
    if (hit && screen_radiance(origin_ws + direction * distance, direction, seen)) {
        return seen;
    }
#endif
#if RAY_BOUNCES
    if (hit) {
        radiance += ray_bounces(origin_ws + direction * distance, normal_ws, albedo, direction, u);
    }
#endif
    return radiance;
}

#if HAS_VPLS
vec3 ray_bounces(vec3 position_ws, vec3 normal_ws, vec3 albedo, vec3 direction, float u)
{
    if (max3(albedo) <= 0.0) {
        return vec3(0.0);
    }
    int stride = max(vpl_count / RAY_VPLS, 1);
    return albedo * gather_some_vpls(position_ws, normal_ws, normal_ws, int(u * float(stride)), stride,
                                     float(view.subframes)).radiance;
}
#endif
