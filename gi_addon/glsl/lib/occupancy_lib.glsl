// Rays through the grid of cells. Included where `occupancy`, `cell_origin_ws` and `cell_size` are declared.
//
// From cell to cell, or over the largest empty block around (J. Amanatides and A. Woo, "A Fast Voxel Traversal Algorithm
// for Ray Tracing", Eurographics 1987, with the blocks of an octree). A surface fills every cell it passes through, so a
// plane's cells reach |nx| + |ny| + |nz| edges to either side of it: a ray that starts that far off never meets its own.

const int CELL_STEPS = 96;

// How far (in cells) the ray may go from `p` within the block that `p` lies in, along `direction` (cells per unit).
float cell_exit(vec3 p, vec3 inverse, vec3 forward, float size)
{
    vec3 corner = floor(p / size) * size;
    vec3 t = (corner + forward * size - p) * inverse;
    return min(t.x, min(t.y, t.z));
}

// What the grid holds at `p` (in cells): 0 a surface, else 1 + log2 of the edge of the largest empty block around.
float cells_level(vec3 p)
{
    return floor(texelFetch(occupancy, clamp(ivec3(floor(p)), ivec3(0), textureSize(occupancy, 0) - 1), 0).r * 255.0 + 0.5);
}

// From `p` just past the block that `p` lies in.
float cells_step(vec3 p, vec3 inverse, vec3 forward, float level)
{
    return max(cell_exit(p, inverse, forward, exp2(max(level - 1.0, 0.0))), 0.0) + 1e-3;
}

// A surface's point lifted clear of the cells that the surface fills.
vec3 cells_clear(vec3 position_ws, vec3 n) { return position_ws + n * (dot(abs(n), vec3(1.0)) * cell_size); }

// The same, where another surface may stand nearer than that: on along `open`, a unit direction in which nothing stands near
// (towards the light or the eye that sees the point), to the first free cell. What stands around a point in a free cell then
// blocks, and a wall that its cell lies in does not stand open to it.
vec3 cells_clear_along(vec3 position_ws, vec3 n, vec3 open)
{
    vec3 start = (cells_clear(position_ws, n) - cell_origin_ws) / cell_size;
    vec3 found = start;
    for (int k = 4; k >= 0; --k) {
        // Whole cells: steps of a cell's edge enter no cell but through a corner without stopping in it.
        vec3 p = start + open * float(k);
        found = cells_level(p) > 0.5 ? p : found;
    }
    return cell_origin_ws + found * cell_size;
}

// The distance (in cells) at which a ray from `start` (in cells) enters the grid, and the one at which it leaves.
vec2 cells_span(vec3 start, vec3 inverse)
{
    vec3 a = -start * inverse;
    vec3 b = (vec3(textureSize(occupancy, 0)) - start) * inverse;
    vec3 low = min(a, b);
    vec3 high = max(a, b);
    return vec2(max(max(low.x, low.y), max(low.z, 0.0)), min(high.x, min(high.y, high.z)));
}

// Whether something stands between two points, each already lifted off its own surface. A run of cells that holds an end
// point is that point's own neighbourhood (a corner, a contact), not an obstacle: only what has free cells before and
// behind it blocks.
bool cells_block(vec3 from_ws, vec3 to_ws)
{
    vec3 start = (from_ws - cell_origin_ws) / cell_size;
    vec3 along = (to_ws - cell_origin_ws) / cell_size - start;
    float far = length(along);
    vec3 direction = along / max(far, 1e-6);
    direction = mix(direction, vec3(1e-6), lessThan(abs(direction), vec3(1e-6)));
    vec3 inverse = 1.0 / direction;
    vec3 forward = step(0.0, direction);
    // Outside the grid all is free.
    vec2 span = cells_span(start, inverse);
    float t = span.x > 0.0 ? span.x + 1e-3 : 0.0;
    bool free_before = span.x > 0.0;
    bool inside = false;
    bool blocked = false;
    for (int i = 0; i < CELL_STEPS; ++i) {
        if (t < min(far, span.y) && !blocked) {
            vec3 p = start + direction * t;
            float level = cells_level(p);
            bool solid = level < 0.5;
            blocked = !solid && inside;
            inside = inside || (solid && free_before);
            free_before = free_before || !solid;
            t += cells_step(p, inverse, forward, level);
        } else {
            break;
        }
    }
    return blocked;
}

// Along the unit `direction`, from `after` (m) on: how far (m) the first free cell is, and where the first cell with a surface
// in it behind that begins and ends; −1 where there is none.
vec3 cells_first(vec3 from_ws, vec3 direction, float after)
{
    vec3 start = (from_ws - cell_origin_ws) / cell_size;
    direction = mix(direction, vec3(1e-6), lessThan(abs(direction), vec3(1e-6)));
    vec3 inverse = 1.0 / direction;
    vec3 forward = step(0.0, direction);
    vec2 span = cells_span(start, inverse);
    float skip = after / cell_size;
    float t = max(span.x, skip) + 1e-3;
    float open_ = span.x > skip ? skip : -1.0;
    vec2 hit = vec2(-1.0);
    for (int i = 0; i < CELL_STEPS; ++i) {
        if (t < span.y && hit.x < 0.0) {
            vec3 p = start + direction * t;
            float level = cells_level(p);
            bool solid = level < 0.5;
            float next = t + cells_step(p, inverse, forward, level);
            hit = solid && open_ >= 0.0 ? vec2(t, next) : hit;
            open_ = open_ < 0.0 && !solid ? t : open_;
            t = next;
        } else {
            break;
        }
    }
    // Out of steps within the grid: among surfaces, so not past them.
    hit = hit.x < 0.0 && t < span.y ? vec2(t) : hit;
    // Outside the grid all is free.
    open_ = open_ < 0.0 ? t : open_;
    return vec3(open_ * cell_size, hit.x < 0.0 ? vec2(-1.0) : hit * cell_size);
}

// Distance (m) along the unit `direction` to the first cell with a surface in it after a free one; −1 if there is none.
float cells_distance(vec3 from_ws, vec3 direction) { return cells_first(from_ws, direction, 0.0).y; }

// Whether a ray along the unit `direction` leaves the grid through free cells only; one that starts in a surface's does not.
bool cells_open(vec3 from_ws, vec3 direction)
{
    vec3 start = (from_ws - cell_origin_ws) / cell_size + direction * 1e-3;
    bool within = all(greaterThanEqual(start, vec3(0.0))) && all(lessThan(start, vec3(textureSize(occupancy, 0))));
    return !(within && cells_level(start) < 0.5) && cells_distance(from_ws, direction) < 0.0;
}

// The next run of occupied cells along a ray in cells (`direction` a unit vector without zeros) that free cells come before,
// from `t` on; `t` ends behind it. `far` in cells. False where there is none.
bool cells_next_run(vec3 start, vec3 direction, float far, inout float t, inout bool free_before, out vec2 run)
{
    vec3 inverse = 1.0 / direction;
    vec3 forward = step(0.0, direction);
    bool inside = false;
    bool left = false;
    run = vec2(far);
    for (int i = 0; i < CELL_STEPS; ++i) {
        if (t < far && !left) {
            vec3 p = start + direction * t;
            float level = cells_level(p);
            bool solid = level < 0.5;
            if (solid && free_before && !inside) {
                inside = true;
                run.x = t;
            }
            left = !solid && inside;
            if (left) {
                run.y = t;
            } else {
                t += cells_step(p, inverse, forward, level);
            }
            free_before = free_before || !solid;
        } else {
            break;
        }
    }
    return inside;
}

// Where a ray in cells leaves the grid.
float cells_far(vec3 start, vec3 direction)
{
    vec3 size = vec3(textureSize(occupancy, 0));
    vec3 t = (mix(vec3(0.0), size, step(0.0, direction)) - start) / direction;
    return max(min(t.x, min(t.y, t.z)), 0.0);
}
