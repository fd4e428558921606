// Sums of the layers in the making to means (passes/voxels.py says what a texel is).

#include "passes/voxel_extent.glsl"
#if VOXEL_BODIES
#include "lib/body_lib.glsl"
#endif

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;

float sum_at(uint at) { return float(int(voxel_sums[at])); }

void main()
{
    ivec3 at = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(at, ivec3(grid_size.xy, slab.y)))) {
        return;
    }
    uint first = uint((at.z * grid_size.y + at.y) * grid_size.x + at.x) * uint(VOXEL_WORDS);
    ivec3 cell = at + ivec3(0, 0, slab.x);
    float weight = float(voxel_sums[first]);
    float opaque = float(voxel_sums[first + 1u]);
    // Colours are those of the opaque share: what is seen where a ray is stopped.
    float color = opaque > 0.0 ? 1.0 / opaque : 0.0;
    uint kinds = 0u;
    for (int part = 0; part < 6; ++part) {
        uint sheet = first + 5u + 4u * uint(part);
        float share = sum_at(sheet);
        uint bits = voxel_sums[first + 29u + uint(part >> 1)] >> (16 * (part & 1)) & 0xFFFFu;
        vec3 plane = share > 0.0 ? vec3(sum_at(sheet + 1u), sum_at(sheet + 2u), sum_at(sheet + 3u)) / share : vec3(0.0);
        kinds |= bits != 0u && opaque > 0.0 ? 1u << part : 0u;
        ivec3 texel = ivec3(cell.x + (part & 1) * grid_size.x, cell.y, cell.z + (part >> 1) * grid_size.z);
#if HAS_VOXEL_EXTENTS
        uint reach = sheet_extent(first, part);
        imageStore(voxel_extents, texel, vec4(voxel_sums[reach], voxel_sums[reach + 1u], voxel_sums[reach + 2u],
                                              voxel_sums[reach + 3u]) / EXTENT_UNITS);
#endif
        imageStore(voxel_sheets, texel, vec4(0.5 + 0.5 * plane.xy, 0.5 + plane.z / 3.0, float(bits) / 65535.0));
    }
    imageStore(voxel_kinds, cell, vec4(float(kinds) / 255.0, opaque / max(weight, 1.0), 0.0, 0.0));
#if HAS_VOXEL_ALBEDO
    vec3 albedo = vec3(voxel_sums[first + 2u], voxel_sums[first + 3u], voxel_sums[first + 4u]) * color;
    imageStore(voxel_albedo, cell, vec4(min(albedo, vec3(1.0)), float(voxel_sums[first + 32u]) / max(weight, 1.0)));
#endif
#if HAS_VOXEL_EMISSION
    vec3 emission = vec3(voxel_sums[first + 57u], voxel_sums[first + 58u], voxel_sums[first + 59u]);
    imageStore(voxel_emission, cell, vec4(emission * (float(VOXEL_UNITS) * color / float(EMISSION_UNITS)), 0.0));
#endif
#if HAS_VOXEL_BODIES
    uint body = first + uint(BODY_WORD);
    float whole = 1.0 / max(float(voxel_sums[body]), 1.0);
    vec4 path = vec4(voxel_sums[body + 1u], voxel_sums[body + 2u], voxel_sums[body + 3u], voxel_sums[body + 4u]) * whole;
    vec3 own = vec3(voxel_sums[body + 5u], voxel_sums[body + 6u], voxel_sums[body + 7u]) * whole;
    vec2 entry = vec2(voxel_sums[body + 8u], voxel_sums[body + 9u]) * whole;
    imageStore(voxel_bodies, cell, pack_body(path.rgb * LONGEST_PATH, path.a, own, voxel_sums[body + 10u], entry));
#endif
#if HAS_VOXEL_LAMPS
    vec3 lamps = vec3(0.0);
    for (int axis = 0; axis < 3; ++axis) {
        // A lamp with two sides covers what one of them does.
        lamps[axis] = float(max(voxel_sums[first + 57u + 2u * uint(axis)], voxel_sums[first + 58u + 2u * uint(axis)]));
    }
    imageStore(voxel_lamps, cell, vec4(min(lamps / float(VOXEL_UNITS), vec3(1.0)), 0.0));
#endif
}
