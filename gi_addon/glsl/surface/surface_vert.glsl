// Vertices of the scene's meshes for any view: camera, light map, voxels. One instance per draw of a mesh, its transform
// in instance attributes, so that one indirect call draws any number of objects.

#include "lib/math_lib.glsl"

in vec3 in_position;
in vec3 instance_row_0; // rows of world_from_object
in vec3 instance_row_1;
in vec3 instance_row_2;
in vec3 instance_translation;

uniform mat4 clip_from_world;

#if SURFACE_FULL
in ivec4 in_normal; // unit vector × 32767
out vec3 vary_position_ws;
out vec3 vary_normal_ws;
out float vary_height; // dot(vertex − instance origin, vertex normal), see surface_bulge
out vec3 vary_relative_ws; // position − instance origin
#if SURFACE_OBJECT_SPACE
in vec3 instance_texspace_min;
in vec3 instance_texspace_scale;
in vec4 instance_color;
in vec2 instance_info; // object index, random
out vec3 vary_position_os;
out vec3 vary_normal_os;
out vec3 vary_generated;
flat out vec4 vary_color;
flat out vec2 vary_info;
flat out vec3 vary_location;
flat out mat3 vary_world_from_object;
#endif
#if SURFACE_ATTRIBUTES > 0
in vec4 in_attribute_0;
out vec4 vary_attribute_0;
#endif
#if SURFACE_ATTRIBUTES > 1
in vec4 in_attribute_1;
out vec4 vary_attribute_1;
#endif
#if SURFACE_ATTRIBUTES > 2
in vec4 in_attribute_2;
out vec4 vary_attribute_2;
#endif
#if SURFACE_ATTRIBUTES > 3
in vec4 in_attribute_3;
out vec4 vary_attribute_3;
#endif
#else
#if SURFACE_DEPTH
out vec3 vary_position_ws;
#endif
#endif

void main()
{
    mat3 m = transpose(mat3(instance_row_0, instance_row_1, instance_row_2));
    vec3 position_ws = m * in_position + instance_translation;
    gl_Position = clip_from_world * vec4(position_ws, 1.0);
#if SURFACE_FULL
    vary_position_ws = position_ws;
    vec3 normal_os = vec3(in_normal.xyz) * (1.0 / 32767.0);
    vary_normal_ws = normal_matrix(m) * normal_os;
    float l2 = dot(vary_normal_ws, vary_normal_ws);
    vary_normal_ws *= l2 > 0.0 ? inversesqrt(l2) : 0.0;
    vary_relative_ws = m * in_position;
    vary_height = dot(vary_relative_ws, vary_normal_ws);
#if SURFACE_OBJECT_SPACE
    vary_position_os = in_position;
    vary_normal_os = normal_os;
    vary_generated = (in_position - instance_texspace_min) * instance_texspace_scale;
    vary_color = instance_color;
    vary_info = instance_info;
    vary_location = instance_translation;
    vary_world_from_object = m;
#endif
#if SURFACE_ATTRIBUTES > 0
    vary_attribute_0 = in_attribute_0;
#endif
#if SURFACE_ATTRIBUTES > 1
    vary_attribute_1 = in_attribute_1;
#endif
#if SURFACE_ATTRIBUTES > 2
    vary_attribute_2 = in_attribute_2;
#endif
#if SURFACE_ATTRIBUTES > 3
    vary_attribute_3 = in_attribute_3;
#endif
#elif SURFACE_DEPTH
    vary_position_ws = position_ws;
#endif
}
