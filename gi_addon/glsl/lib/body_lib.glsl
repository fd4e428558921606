// What light scatters below a sheet of the voxels in, in one texel (passes/voxels.py).

#include "lib/math_lib.glsl"

struct Body {
    vec3 path;      // mean free path, cells
    float share;    // of what is reflected that has been below the surface; 0 where nothing has
    vec3 albedo;    // of a half space
    float rough;    // roughness of the way in
    float inverse;  // one over its index of refraction
};

// Through what is longer than the largest grid light goes straight.
const float LONGEST_PATH = 512.0;

uvec4 pack_body(Body body)
{
    return uvec4(packHalf2x16(body.path.rg), packHalf2x16(vec2(body.path.b, body.share)), packUnorm4x8(vec4(body.albedo, 0.0)),
                 packUnorm2x16(vec2(body.rough, body.inverse)));
}

Body unpack_body(uvec4 texel)
{
    vec4 path = vec4(unpackHalf2x16(texel.x), unpackHalf2x16(texel.y));
    vec2 entry = unpackUnorm2x16(texel.w);
    return Body(path.rgb, path.a, unpackUnorm4x8(texel.z).rgb, entry.x, entry.y);
}
