// A triangle to the cells it may touch, seen along the axis that it faces most (M. Schwarz and H.-P. Seidel, "Fast
// Parallel Surface and Solid Voxelization", SIGGRAPH Asia 2010): its shadow on the grid, grown by half a cell. What is
// drawn is the convex hull of a cell-sized square at each corner (J. Hasselgren et al., GPU Gems 2, ch. 42, first
// method); each of its vertices takes the values of the corner it belongs to, so that nothing is read from outside the
// triangle, however thin it is.

layout(triangles) in;
layout(triangle_strip, max_vertices = 7) out;

uniform vec3 grid_low;
uniform float grid_cell;
uniform ivec3 grid_size;

in vec3 corner_position_ws[];
in vec3 corner_normal_ws[];
in float corner_height[];
in vec3 corner_relative_ws[];
out vec3 vary_position_ws;
out vec3 vary_normal_ws;
out float vary_height;
out vec3 vary_relative_ws;
#if SURFACE_OBJECT_SPACE
in vec3 corner_position_os[];
in vec3 corner_normal_os[];
in vec3 corner_generated[];
flat in vec4 corner_color[];
flat in vec2 corner_info[];
flat in vec3 corner_location[];
flat in mat3 corner_world_from_object[];
out vec3 vary_position_os;
out vec3 vary_normal_os;
out vec3 vary_generated;
flat out vec4 vary_color;
flat out vec2 vary_info;
flat out vec3 vary_location;
flat out mat3 vary_world_from_object;
#endif
#if SURFACE_ATTRIBUTES > 0
in vec4 corner_attribute_0[];
out vec4 vary_attribute_0;
#endif
#if SURFACE_ATTRIBUTES > 1
in vec4 corner_attribute_1[];
out vec4 vary_attribute_1;
#endif
#if SURFACE_ATTRIBUTES > 2
in vec4 corner_attribute_2[];
out vec4 vary_attribute_2;
#endif
#if SURFACE_ATTRIBUTES > 3
in vec4 corner_attribute_3[];
out vec4 vary_attribute_3;
#endif
// The triangle in cells, its axes turned so that z is the axis it is seen along; that axis; its normal in the world.
flat out vec3 triangle_a;
flat out vec3 triangle_b;
flat out vec3 triangle_c;
flat out int triangle_axis;
flat out vec3 triangle_normal_ws;

vec3 turned(vec3 v, int axis) { return axis == 0 ? v.yzx : axis == 1 ? v.zxy : v; }

// Corners of the square, counter-clockwise.
vec2 square_corner(int q) { return vec2(q == 0 || q == 3 ? 0.5 : -0.5, q < 2 ? 0.5 : -0.5); }

// The corner that reaches farthest along the outward normal (d.y, −d.x) of an edge along d.
int extreme_corner(vec2 d)
{
    return d.y >= 0.0 ? (-d.x >= 0.0 ? 0 : 3) : (-d.x >= 0.0 ? 1 : 2);
}

void emit(int i, vec2 p, vec3 a, vec3 b, vec3 c, int axis, vec3 normal, vec2 span)
{
    vary_position_ws = corner_position_ws[i];
    vary_normal_ws = corner_normal_ws[i];
    vary_height = corner_height[i];
    vary_relative_ws = corner_relative_ws[i];
#if SURFACE_OBJECT_SPACE
    vary_position_os = corner_position_os[i];
    vary_normal_os = corner_normal_os[i];
    vary_generated = corner_generated[i];
    vary_color = corner_color[i];
    vary_info = corner_info[i];
    vary_location = corner_location[i];
    vary_world_from_object = corner_world_from_object[i];
#endif
#if SURFACE_ATTRIBUTES > 0
    vary_attribute_0 = corner_attribute_0[i];
#endif
#if SURFACE_ATTRIBUTES > 1
    vary_attribute_1 = corner_attribute_1[i];
#endif
#if SURFACE_ATTRIBUTES > 2
    vary_attribute_2 = corner_attribute_2[i];
#endif
#if SURFACE_ATTRIBUTES > 3
    vary_attribute_3 = corner_attribute_3[i];
#endif
    triangle_a = a;
    triangle_b = b;
    triangle_c = c;
    triangle_axis = axis;
    triangle_normal_ws = normal;
    gl_Position = vec4(p / span * 2.0 - 1.0, 0.0, 1.0);
    EmitVertex();
}

void main()
{
    vec3 corner[3];
    for (int i = 0; i < 3; ++i) {
        corner[i] = (corner_position_ws[i] - grid_low) / grid_cell;
    }
    vec3 normal = cross(corner[1] - corner[0], corner[2] - corner[0]);
    float area = length(normal);
    if (!(area > 0.0)) {
        return; // no surface, or not a number
    }
    vec3 size = abs(normal);
    int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    vec3 a = turned(corner[0], axis);
    vec3 b = turned(corner[1], axis);
    vec3 c = turned(corner[2], axis);
    // Counter-clockwise as it is seen.
    bool flipped = turned(normal, axis).z < 0.0;
    ivec3 order = flipped ? ivec3(0, 2, 1) : ivec3(0, 1, 2);
    vec2 p[3] = vec2[3](a.xy, flipped ? c.xy : b.xy, flipped ? b.xy : c.xy);

    // At each corner the square's own corners between the normals of its two edges; four turns in all.
    vec2 hull[9];
    int source[9];
    int count = 0;
    int turns = 0;
    for (int i = 0; i < 3; ++i) {
        int before = extreme_corner(p[i] - p[(i + 2) % 3]);
        int after = extreme_corner(p[(i + 1) % 3] - p[i]);
        int steps = (after - before) & 3;
        turns += steps;
        for (int k = 0; k < 3; ++k) {
            if (k <= steps) {
                hull[count] = p[i] + square_corner((before + k) & 3);
                source[count] = order[i];
                ++count;
            }
        }
    }
    if (turns != 4) {
        // So thin that rounding turned an edge: its box will do.
        vec2 low = min(p[0], min(p[1], p[2])) - 0.5;
        vec2 high = max(p[0], max(p[1], p[2])) + 0.5;
        hull[0] = low;
        hull[1] = vec2(high.x, low.y);
        hull[2] = high;
        hull[3] = vec2(low.x, high.y);
        source[0] = source[1] = source[2] = source[3] = 0;
        count = 4;
    }
    vec2 span = vec2(max(grid_size.x, max(grid_size.y, grid_size.z)));
    normal /= area;
    // A convex polygon as a strip: first, second, last, third, last but one …
    for (int k = 0; k < 7; ++k) {
        if (k < count) {
            int i = k == 0 ? 0 : (k & 1) == 1 ? (k + 1) / 2 : count - k / 2;
            emit(source[i], hull[i], a, b, c, axis, normal, span);
        }
    }
    EndPrimitive();
}
