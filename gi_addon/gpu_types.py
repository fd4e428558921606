# SPDX-License-Identifier: GPL-3.0-or-later
"""Structs shared with the shaders; their GLSL is generated from these dtypes as ``generated/*.glsl``."""

from __future__ import annotations

from .gl.structs import glsl_struct, struct

# One sub-frame's camera. A point at view depth z (along the view axis) under pixel coordinate uv in [0, 1]² is
#   (origin + origin_u u + origin_v v) + (direction + direction_u u + direction_v v) z
# for perspective, orthographic, shifted, jittered and lens-sampled cameras alike.
VIEW = struct(
    ("clip_from_world", "f4", (4, 4)),
    ("view_from_world", "f4", (4, 4)),
    ("origin_ws", "f4", 3), ("pixel_size", "f4"),  # width of a pixel: at depth 1 (perspective), or anywhere
    ("origin_u", "f4", 3), ("orthographic", "f4"),
    ("origin_v", "f4", 3), ("clip_start", "f4"),
    ("direction_ws", "f4", 3), ("clip_end", "f4"),
    ("direction_u", "f4", 3), ("scene_radius", "f4"),
    ("direction_v", "f4", 3), ("lod_bias", "f4"),
    ("forward_ws", "f4", 3), ("film_transparent", "f4"),
    ("resolution", "f4", 2), ("inverse_resolution", "f4", 2),
    ("pixel_offset", "i4", 2), ("subframe", "u4"), ("subframes", "u4"),
    ("margin", "i4"), ("_pad0", "u4"), ("_pad1", "u4"), ("_pad2", "u4"),  # px drawn around the picture, within resolution
    # What world coordinates on the GPU leave out: a scene far from the origin is moved near it, for the sake of 32 bits.
    ("world_origin", "f4", 3), ("_pad3", "u4"),
)  # fmt: skip

# One point of a light, good for one sub-frame. `kind` is one of the LIGHT_ constants; `emission` is irradiance (W/m²)
# for a sun, radiant intensity (W/sr) on the axis or in every direction for the others. `views` of them from
# `first_view` in the list of LIGHT_VIEW cover where it shines; 0 views cast no shadow and are not bounced.
LIGHT = struct(
    ("position_ws", "f4", 3), ("kind", "i4"),
    ("axis_ws", "f4", 3), ("first_view", "i4"),   # towards which it shines (SUN, SPOT, AREA)
    ("emission", "f4", 3), ("views", "i4"),
    ("u_ws", "f4", 3), ("spot_cos", "f4"),        # spot's and area's own axes; u, v hold the size of an area light
    ("v_ws", "f4", 3), ("spot_scale", "f4"),      # spot: 1 / ((1 − cos) blend)
    ("center_ws", "f4", 3), ("spread_tan", "f4"),  # of the whole light; tan of half the spread (area)
    ("patch_radius", "f4"), ("spread_scale", "f4"), ("shape", "i4"), ("flags", "i4"),
    ("soft_radius2", "f4"), ("diffuse", "f4"), ("glossy", "f4"), ("receivers", "u4"),  # m², of a soft disc; sets lit
    ("salt", "u4"),  # of its own sequences; the points of one world or of all emissive meshes share theirs
    # Blender's Light Falloff: the irradiance is that without, times distance^falloff · d²/(d² + smooth).
    ("falloff", "f4"), ("falloff_smooth", "f4"),
)  # fmt: skip
LIGHT_SUN, LIGHT_POINT, LIGHT_SPOT, LIGHT_AREA, LIGHT_WORLD, LIGHT_MESH = range(6)
LIGHT_FLAG_SHADOW, LIGHT_FLAG_BOUNCE, LIGHT_FLAG_CAMERA = 1, 2, 4
SHAPE_RECTANGLE, SHAPE_ELLIPSE = 0, 1
MAP_SHADOW, MAP_BOUNCE = 0, 1

# One map's worth of a light's surroundings. A point p has depth dot(p − origin, axis_z) and map coordinates
# (dot(p − origin, axis_x)/|axis_x|², dot(p − origin, axis_y)/|axis_y|²), divided by the depth where `perspective`;
# the light's own span is [−1, 1]². `rect` is (x, y, width, height) of the tile in texels of the atlas; the tile shows
# `guard` times the span, so that filters don't leave it. `map` says which atlas: MAP_SHADOW or MAP_BOUNCE.
LIGHT_VIEW = struct(
    ("origin_ws", "f4", 3), ("perspective", "f4"),
    ("axis_x", "f4", 3), ("near", "f4"),
    ("axis_y", "f4", 3), ("far", "f4"),
    ("axis_z", "f4", 3), ("guard", "f4"),
    ("rect", "f4", 4),
    ("light", "i4"), ("map", "i4"), ("_pad0", "u4"), ("_pad1", "u4"),
)  # fmt: skip

# A virtual point light: `flux` (W) reflected by a disc of `area` (m²) at `position_ws` facing `normal_ws`. A point of the air
# (`light` is VPL_AIR) scatters `flux` that goes along `normal_ws`, by the phase function's mean cosine `anisotropy`.
VPL_AIR = -2
VPL = struct(
    ("position_ws", "f4", 3), ("area", "f4"),
    ("normal_ws", "f4", 3), ("light", "i4"),  # that lit it, in rsm.lights; −1 another virtual light
    ("flux", "f4", 3), ("anisotropy", "f4"),
    ("clear_ws", "f4", 3), ("key", "u4"),  # where rays to it end: clear of the cells of its own surface; its place in order
)  # fmt: skip


def _constants() -> str:
    names = {k: v for k, v in globals().items() if isinstance(v, int) and k.startswith(("LIGHT_", "SHAPE_", "MAP_"))}
    return "\n".join(f"const int {name} = {value};" for name, value in names.items())


GENERATED = {
    "generated/view.glsl": glsl_struct("View", VIEW)
    + "\nlayout(std140, binding = 0) uniform view_block { View view; };\n",
    "generated/light.glsl": glsl_struct("Light", LIGHT)
    + "\n"
    + glsl_struct("LightView", LIGHT_VIEW)
    + "\n"
    + _constants()
    + "\n",
    "generated/vpl.glsl": glsl_struct("Vpl", VPL) + f"\nconst int VPL_AIR = {VPL_AIR};\n",
}

# Which of them declares a struct.
STRUCT_FILES = {"Light": "generated/light.glsl", "LightView": "generated/light.glsl", "Vpl": "generated/vpl.glsl"}
