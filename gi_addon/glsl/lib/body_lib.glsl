// What a cell's surfaces that light scatters below are made of, in one texel (passes/voxels.py).

#include "lib/math_lib.glsl"

struct Body {
    vec3 path;      // mean free path, cells
    float share;    // of what is reflected that has been below the surface
    vec3 albedo;    // of a half space
    uint parts;     // a bit for each kind of sheet that is its surface
    float rough;    // roughness of the way in
    float inverse;  // one over its index of refraction
};

// Through what is longer than the largest grid light goes straight.
const float LONGEST_PATH = 512.0;

uvec4 pack_body(vec3 path, float share, vec3 albedo, uint parts, vec2 entry)
{
    return uvec4(packHalf2x16(path.rg), packHalf2x16(vec2(path.b, share)), packUnorm4x8(vec4(albedo, float(parts) / 255.0)),
                 packUnorm2x16(entry));
}

uint body_parts(uvec4 texel) { return texel.z >> 24u; }

Body unpack_body(uvec4 texel)
{
    vec4 path = vec4(unpackHalf2x16(texel.x), unpackHalf2x16(texel.y));
    vec2 entry = unpackUnorm2x16(texel.w);
    return Body(path.rgb, path.a, unpackUnorm4x8(texel.z).rgb, body_parts(texel), entry.x, entry.y);
}
