// The light propagation volume: its grid and its spherical harmonics.
//
// Cell (i, j, k) spans [i, i+1) × … in grid coordinates, which are (world − origin) / cell. A volume of spherical harmonics
// is one 3D texture: coefficient c of cell z lies at depth z + c · grid_size.z. Grids within each other (gi_addon/nested_grids.py)
// stand in it side by side along x, and one after the other in buffers of faces.

#include "lib/math_lib.glsl"

const int SH_COUNT = 9; // orders 0, 1, 2

// Real spherical harmonics of orders 0 … 2 of a unit vector: 1/(2√π), √3/(2√π), √15/(2√π), √5/(4√π), √15/(4√π).
void sh_basis(vec3 w, out float y[SH_COUNT])
{
    y[0] = 0.28209479177;
    y[1] = 0.48860251190 * w.y;
    y[2] = 0.48860251190 * w.z;
    y[3] = 0.48860251190 * w.x;
    y[4] = 1.09254843059 * w.x * w.y;
    y[5] = 1.09254843059 * w.y * w.z;
    y[6] = 0.31539156525 * (3.0 * w.z * w.z - 1.0);
    y[7] = 1.09254843059 * w.x * w.z;
    y[8] = 0.54627421529 * (w.x * w.x - w.y * w.y);
}

// The clamped cosine lobe over π, max(cosθ, 0)/π about n, has coefficients share(l) · Y_lm(n): 1, 2/3, 1/4 (R. Ramamoorthi
// and P. Hanrahan, SIGGRAPH 2001). In the form of Kaplanyan and Dachsbacher the lobe itself is √π/2 = .8862 · Y00-axis and
// √(π/3) = 1.0233 for order 1: π · 1 · .2821 = .8862 and π · 2/3 · .4886 = 1.0233.
float sh_cosine_share(int c) { return c == 0 ? 1.0 : c < 4 ? 2.0 / 3.0 : 0.25; }

// Henyey and Greenstein's phase function scales the harmonics of order l of what it scatters by g^l.
float phase_share(int c, float g) { return c == 0 ? 1.0 : c < 4 ? g : g * g; }

// How far a point must go along a unit normal to be in a cell whose centre is not behind the surface, in cells: the cell's
// half width along the normal. Half a cell for a wall along the grid.
float half_cell_shift(vec3 n) { return 0.5 * (abs(n.x) + abs(n.y) + abs(n.z)); }

#if LPV_CHOOSES
// The grid at hand, out of the table grid_places, grid_sizes, grid_bounds.
vec3 grid_origin;
float grid_cell;
ivec3 grid_size;
int grid_column;
int grid_first;
int grid_rim;

void use_grid(int k)
{
    grid_origin = grid_places[k].xyz;
    grid_cell = grid_places[k].w;
    grid_size = ivec3(grid_sizes[k].xyz);
    grid_column = int(grid_sizes[k].w);
    grid_first = int(grid_bounds[k].x);
    grid_rim = int(grid_bounds[k].y);
}

// How much of the light at grid point `at` is the grid's own: its rim holds what the grid around it has, whose cells are two of
// this one's. From two of its cells inside, so that all eight cells around a point are its own, it takes over within two of theirs.
float grid_share(vec3 at)
{
    float inside = 1e30;
    for (int axis = 0; axis < 3; ++axis) {
        inside = (grid_rim & (1 << (2 * axis))) != 0 ? min(inside, at[axis]) : inside;
        inside = (grid_rim & (2 << (2 * axis))) != 0 ? min(inside, float(grid_size[axis]) - at[axis]) : inside;
    }
    return saturate((inside - 2.0) / 4.0);
}
#endif

// Whether a cell is one that the grid around prescribes, `rim` as grid_rim.
bool in_rim(ivec3 cell, ivec3 size, int rim)
{
    ivec3 sides = ivec3(equal(cell, ivec3(0))) | (ivec3(equal(cell, size - 1)) << 1);
    return (rim & (sides.x | (sides.y << 2) | (sides.z << 4))) != 0;
}

// Where a cell's value number `layer` is: a harmonic, or an ordinate.
ivec3 volume_texel(ivec3 cell, int layer) { return cell + ivec3(grid_column, 0, layer * grid_size.z); }

bool inside_grid(ivec3 cell, ivec3 size) { return all(greaterThanEqual(cell, ivec3(0))) && all(lessThan(cell, size)); }

int cell_index(ivec3 cell, ivec3 size) { return (cell.z * size.y + cell.y) * size.x + cell.x; }
