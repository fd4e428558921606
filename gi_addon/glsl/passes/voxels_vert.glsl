// surface_vert.glsl under names of its own: the geometry shader hands its values on under the names that materials read.

#define vary_position_ws corner_position_ws
#define vary_normal_ws corner_normal_ws
#define vary_height corner_height
#define vary_relative_ws corner_relative_ws
#define vary_position_os corner_position_os
#define vary_normal_os corner_normal_os
#define vary_generated corner_generated
#define vary_color corner_color
#define vary_info corner_info
#define vary_location corner_location
#define vary_world_from_object corner_world_from_object
#define vary_attribute_0 corner_attribute_0
#define vary_attribute_1 corner_attribute_1
#define vary_attribute_2 corner_attribute_2
#define vary_attribute_3 corner_attribute_3
#define main surface_main
#include "surface/surface_vert.glsl"
#undef main

void main() { surface_main(); }
