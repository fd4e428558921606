// Sums of the sheets in the making to means (passes/voxels.py says what a texel is).

#include "passes/voxel_sums.glsl"
#if VOXEL_BODIES
#include "lib/body_lib.glsl"
#endif

layout(local_size_x = 64) in;
layout(binding = 4, r32ui) uniform uimage3D cells_now;
layout(binding = 6, r32ui) readonly uniform uimage2D rows_now;
layout(binding = 7, r32ui) readonly uniform uimage2D places_now;

float sum_at(uint at) { return float(int(voxel_sums[at])); }

void main()
{
    uint own = chunk.x + gl_GlobalInvocationID.y * STORE_WIDTH + gl_GlobalInvocationID.x;
    if (own >= min(chunk.x + chunk.y, sheet_count)) {
        return;
    }
    uint place = imageLoad(places_now, store_texel(own)).r;
    ivec3 cell = place_cell(place);
    int part = place_part(place);
    uint word = imageLoad(cells_now, cell).r;
    uint number = imageLoad(rows_now, store_texel(row_of(cell, grid_size, 0))).r + word_sheets(word);
    // A cell's sheets are made together, where its first is.
    if (number < chunk.x || number >= chunk.x + chunk_step) {
        return;
    }
    uint first = (number - chunk.x) * uint(VOXEL_WORDS);
    uint sheet = (own - chunk.x) * uint(VOXEL_WORDS);
    float weight = float(voxel_sums[first + SUM_AREA]);
    float opaque = float(voxel_sums[first + SUM_OPAQUE]);
    // Colours are those of the opaque share: what is seen where a ray is stopped.
    float color = opaque > 0.0 ? 1.0 / opaque : 0.0;
    float share = sum_at(sheet + SUM_SHARE);
    vec3 plane = vec3(sum_at(sheet + SUM_PLANE), sum_at(sheet + SUM_PLANE + 1u), sum_at(sheet + SUM_PLANE + 2u)) / max(share, 1.0);
    vec4 extent = vec4(voxel_sums[sheet + SUM_EXTENT], voxel_sums[sheet + SUM_EXTENT + 1u], voxel_sums[sheet + SUM_EXTENT + 2u],
                       voxel_sums[sheet + SUM_EXTENT + 3u]) / EXTENT_UNITS;
    vec3 albedo = vec3(voxel_sums[first + SUM_ALBEDO], voxel_sums[first + SUM_ALBEDO + 1u], voxel_sums[first + SUM_ALBEDO + 2u]);
    vec4 reflected = vec4(min(albedo * color, vec3(1.0)), float(voxel_sums[first + SUM_DIFFUSE]) / max(weight, 1.0));
    imageStore(voxel_sheets, store_texel(own), uvec4(
        packUnorm2x16(0.5 + 0.5 * plane.xy),
        packUnorm2x16(vec2(0.5 + plane.z / 3.0, 0.0)) | voxel_sums[sheet + SUM_SQUARES] << 16u,
        packUnorm4x8(extent),
        packUnorm4x8(reflected)));
    if (own == number) {
        imageStore(cells_now, cell, uvec4(word | uint(round(255.0 * opaque / max(weight, 1.0))) << 8u));
    }
#if HAS_VOXEL_EMISSION
    vec3 emission = vec3(voxel_sums[first + SUM_EMISSION], voxel_sums[first + SUM_EMISSION + 1u], voxel_sums[first + SUM_EMISSION + 2u]);
    imageStore(voxel_emission, store_texel(own), vec4(emission * (float(VOXEL_UNITS) * color / float(EMISSION_UNITS)), 0.0));
#endif
#if HAS_VOXEL_BODIES
    uint body = sheet + uint(SUM_BODY);
    float whole = 1.0 / max(float(voxel_sums[body]), 1.0);
    vec4 path = vec4(voxel_sums[body + 1u], voxel_sums[body + 2u], voxel_sums[body + 3u], voxel_sums[body + 4u]) * whole;
    vec3 below = vec3(voxel_sums[body + 5u], voxel_sums[body + 6u], voxel_sums[body + 7u]) * whole;
    vec2 entry = vec2(voxel_sums[body + 8u], voxel_sums[body + 9u]) * whole;
    imageStore(voxel_bodies, store_texel(own), pack_body(Body(path.rgb * LONGEST_PATH, path.a, below, entry.x, entry.y)));
#endif
#if HAS_VOXEL_LAMPS
    imageStore(voxel_lamps, store_texel(own), vec4(min(float(voxel_sums[sheet + SUM_LAMPS]) / float(VOXEL_UNITS), 1.0)));
#endif
}
