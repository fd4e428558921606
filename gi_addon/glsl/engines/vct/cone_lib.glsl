// A cone through the voxels: C. Crassin et al., "Interactive Indirect Illumination Using Voxel Cone Tracing", Pacific
// Graphics 2011; paper §IV-D. Radiance front to back, dL = T (1 − e^−τ) S, T ← T e^−τ, at the mip as wide as the cone.

#include "engines/vct/volume_lib.glsl"

struct ConeResult {
    vec3 radiance;        // that arrives along the cone, W/(m²·sr)
    float transmittance;  // share of the cone that nothing blocks
};

// Below this nothing behind changes a picture: 1/1000.
const float CONE_END = 1e-3;
const int CONE_MOST_STEPS = 512;

// A surface in the grid reaches as far from its plane as half a cell (it may lie anywhere in it) and the one cell that
// interpolation spreads it, measured along the axes: 1.5 (|n_x| + |n_y| + |n_z|) cells.
float surface_reach(vec3 n) { return 1.5 * (abs(n.x) + abs(n.y) + abs(n.z)); }

// A start lies within the blur of its own surface, and maybe of a wall beside it. Leaving them, a cone sees their backs (or
// their fronts, where it starts from the back of a sheet), which stop nothing yet. Measured on an empty Cornell box
// (docs/techniques/vct.md): relMSE .0145 without, .0114 with 2 cells.
const float LEAVING = 2.0;

// Where a cone leaves a surface: `above` in cells along its normal, and the side (1 its front, −1 its back).
struct Departure {
    float above;
    float leaving;
};

// Off the surface by half a cell that its surface may bend or step within its cell, and half of the blur. Where fronts face apart (a
// slab thinner than a cell) the cell's own light can't be told from what it should see: then by all that it is blurred to.
Departure cone_departure(sampler3D facing, vec3 p, vec3 n)
{
    vec3 f = texelFetch(facing, clamp(ivec3(floor(p - 0.01 * n)), ivec3(0), textureSize(facing, 0) - 1), 0).rgb;
    float l1 = abs(n.x) + abs(n.y) + abs(n.z);
    float one_way = dot(f, n) / l1;
    return Departure(mix(1.5, 1.0, saturate(abs(one_way))) * l1, one_way < -0.5 ? -1.0 : 1.0);
}

// `start` in cells, `direction` a unit vector, `spread` the tangent of the half angle, `apex` how far behind `start` the tip
// lies, `reach` how far it goes, all in cells. Over a receiver of normal `n` (0 for none) that the start has left as `from`
// says, mips are kept so fine that they don't reach back down to it.
struct Cone {
    vec3 start;
    vec3 direction;
    float spread;
    float apex;
    float reach;
    vec3 n;
    Departure from;
};

// Leaves the grid, or has gone its way, here.
float cone_end(Cone cone, Grid grid)
{
    vec3 d = mix(cone.direction, vec3(1e-9), lessThan(abs(cone.direction), vec3(1e-9)));
    vec3 far = max(-cone.start / d, (grid.size - cone.start) / d);
    return min(min(far.x, min(far.y, far.z)), cone.reach);
}

// Enters the grid here: 0 where it starts within.
float cone_begin(Cone cone, Grid grid)
{
    vec3 d = mix(cone.direction, vec3(1e-9), lessThan(abs(cone.direction), vec3(1e-9)));
    vec3 near = min(-cone.start / d, (grid.size - cone.start) / d);
    return max(max(near.x, max(near.y, near.z)), 0.0);
}

// Which level to read at `t`. A disc of diameter D varies by D/4 a side; a cell of width s, blended with its
// neighbours, by s/2. So s = D/2.
float cone_level(Cone cone, Grid grid, float t)
{
    float lod = log2(max(cone.spread * (t + cone.apex), 1e-6));
    float span = surface_reach(cone.n);
    if (span > 0.0) {
        // Of the two levels that are blended the coarser one must not reach the receiver.
        lod = min(lod, floor(log2(max((cone.from.above + t * dot(cone.direction, cone.n)) / span, 1e-6))));
    }
    return clamp(lod, 0.0, grid.levels);
}

// Where all around is empty a cone takes four steps at once: a filtered 0 of three levels above says that nothing lies
// within half a cell of that level, four of this.
float empty_stride(sampler3D opacity, Grid grid, vec3 p, float lod)
{
    if (lod + 3.0 > grid.levels) {
        return 1.0;
    }
    return textureLod(opacity, p / grid.size, ceil(lod) + 3.0).rgb == vec3(0.0) ? 3.0 : 1.0;
}

// `phase` in [0, 1) shifts the first step.
ConeResult trace_cone(sampler3D atlas, sampler3D back, sampler3D opacity, Grid grid, Cone cone, float phase)
{
    ConeResult result = ConeResult(vec3(0.0), 1.0);
    float end = cone_end(cone, grid);
    float t = cone_begin(cone, grid);
    for (int i = 0; i < CONE_MOST_STEPS; ++i) {
        if (t >= end || result.transmittance < CONE_END) {
            break;
        }
        float lod = cone_level(cone, grid, t);
        float size = exp2(lod);
        float step_ = min(i == 0 ? size * (1.0 - phase) : size, end - t);
        vec3 p = cone.start + cone.direction * (t + 0.5 * step_);
        vec4 medium = medium_at(atlas, back, opacity, grid, p, cone.direction, lod,
                                t < LEAVING * size ? cone.from.leaving : 0.0);
        float through = exp(-medium.a * step_ / size);
        result.radiance += result.transmittance * (1.0 - through) * medium.rgb;
        result.transmittance *= through;
        t += medium.a > 0.0 ? step_ : step_ * empty_stride(opacity, grid, p, lod);
    }
    return result;
}

// The same without light: what of the cone is open.
float trace_open(sampler3D atlas, sampler3D opacity, Grid grid, Cone cone, float phase)
{
    float transmittance = 1.0;
    float end = cone_end(cone, grid);
    float t = cone_begin(cone, grid);
    for (int i = 0; i < CONE_MOST_STEPS; ++i) {
        if (t >= end || transmittance < CONE_END) {
            break;
        }
        float lod = cone_level(cone, grid, t);
        float size = exp2(lod);
        float step_ = min(i == 0 ? size * (1.0 - phase) : size, end - t);
        vec3 p = cone.start + cone.direction * (t + 0.5 * step_);
        float depth = depth_at(atlas, opacity, grid, p, cone.direction, lod, t < LEAVING * size ? cone.from.leaving : 0.0);
        transmittance *= exp(-depth * step_ / size);
        t += depth > 0.0 ? step_ : step_ * empty_stride(opacity, grid, p, lod);
    }
    return transmittance;
}
