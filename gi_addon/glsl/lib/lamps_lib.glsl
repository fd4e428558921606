// What lamps send straight to a point of a surface, each through its shadow map by this sub-frame's point of it. Included where
// `lights`, `light_count`, `softness` and `filter_turn` are declared, after sequence_lib.glsl.

#include "lib/shadow_lib.glsl"
#include "lib/tint_lib.glsl"
#if HAS_MEDIUM
#include "lib/medium_lib.glsl"
#endif

// A lamp's light at a point, as if nothing stood between.
struct LampLight {
    vec3 arriving;     // irradiance of a surface that faces it, W/m²
    vec3 direction;    // towards it
    float angle;       // angular radius of the patch of the source that its point stands for
    float cosine;      // of the direction with the normal; 0 where none arrives
    vec3 receiver_ws;  // where, and on which plane, the shadow map is asked
    vec3 receiver_ng;
};

// The turn of a pixel's shadow filter in this sub-frame, rad.
float shadow_turn(ivec2 pixel) { return filter_turn + TAU * unit_float(hash_u32(uvec2(pixel + view.pixel_offset))); }

// The set that a pixel's surface is of (light linking).
uint set_at(sampler2D sets, ivec2 pixel) { return uint(texelFetch(sets, pixel, 0).r * 255.0 + 0.5); }

// Whether a lamp lights surfaces of the set `lit_with` (light linking).
bool lamp_lights(Light light, uint lit_with) { return (light.receivers >> lit_with & 1u) != 0u; }

// `n` is the shading normal, `ng` the triangle's. Light from behind a flat triangle does not reach its front, whatever the shading
// normal says. A triangle that stands for a curved surface, `bulge` before it, is lit up to where that surface turns away.
LampLight lamp_light(Light light, vec3 position_ws, vec3 n, vec3 ng, float bulge)
{
    LampLight lamp;
    lamp.arriving = light_arriving(light, position_ws, lamp.direction, lamp.angle);
    bool behind = dot(ng, lamp.direction) <= 0.0;
    bool arrives = (!behind || bulge > 0.0) && max3(abs(lamp.arriving)) > 0.0;
    lamp.cosine = arrives ? max(dot(n, lamp.direction), 0.0) : 0.0;
    lamp.receiver_ws = position_ws + n * bulge;
    lamp.receiver_ng = behind ? n : ng;
    return lamp;
}

// Irradiance by all lamps, W/m²; `turn` rotates the shadow filter, rad.
vec3 lamps_irradiance(vec3 position_ws, vec3 n, vec3 ng, float bulge, uint lit_with, float turn)
{
    vec3 irradiance = vec3(0.0);
    for (int i = 0; i < light_count; ++i) {
        Light light = lights[i];
        LampLight lamp = lamp_light(light, position_ws, n, ng, bulge);
        if (lamp.cosine > 0.0 && lamp_lights(light, lit_with)) {
            float visible = light_share(light, lamp.receiver_ws, lamp.receiver_ng, softness, turn);
            vec3 passes = light_tint(light, position_ws);
#if HAS_MEDIUM
            passes *= medium_transmittance(position_ws, lamp.direction, light_distance(light, position_ws));
#endif
            irradiance += lamp.arriving * passes * (light.diffuse * lamp.cosine * visible);
        }
    }
    return irradiance;
}
