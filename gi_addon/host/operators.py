# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators of the panels: presets, and a viewport in Cycles beside Quartet's."""

from __future__ import annotations

import bpy
from bl_operators.presets import AddPresetBase

from .. import presets
from ..settings import walk
from . import properties


class QUARTET_OT_preset(bpy.types.Operator):
    """Set the quality settings to a named set"""

    bl_idname = "quartet.preset"
    bl_label = "Quality Preset"
    bl_options = {"REGISTER", "UNDO"}
    __annotations__ = {
        "preset": bpy.props.EnumProperty(
            name="Preset", items=[(name, p.label, p.help) for name, p in presets.PRESETS.items()]
        ),
    }

    @classmethod
    def description(cls, context, values):
        return presets.PRESETS[values.preset].help

    def execute(self, context):
        properties.write(context.scene, presets.apply(properties.read(context.scene), self.preset))
        return {"FINISHED"}


class QUARTET_MT_presets(bpy.types.Menu):
    """The user's own presets."""

    bl_label = "Quartet Presets"
    preset_subdir = "quartet"
    preset_operator = "script.execute_preset"
    COMPAT_ENGINES = {"QUARTET"}
    draw = bpy.types.Menu.draw_preset


class QUARTET_OT_add_preset(AddPresetBase, bpy.types.Operator):
    """Add or remove a preset of all Quartet settings"""

    bl_idname = "quartet.add_preset"
    bl_label = "Add Quartet Preset"
    preset_menu = "QUARTET_MT_presets"
    preset_defines = ["quartet = bpy.context.scene.quartet"]
    preset_values = [f"quartet.{path}" for path, _, _ in walk()]
    preset_subdir = "quartet"


class QUARTET_OT_split_view(bpy.types.Operator):
    """Open a second window that shows this scene in Cycles from the same view; what is edited in one changes in both"""

    bl_idname = "quartet.split_view"
    bl_label = "Cycles Beside"

    @classmethod
    def poll(cls, context):
        return context.engine == "QUARTET" and not bpy.app.background

    def execute(self, context):
        area = next((a for a in context.screen.areas if a.type == "VIEW_3D"), None)
        if area is None:
            self.report({"ERROR"}, "There is no 3D viewport in this window")
            return {"CANCELLED"}
        beside(context, area)
        return {"FINISHED"}


def beside(context, area) -> bpy.types.Window:
    """A second window that shows ``context``'s scene in Cycles from the same view, and ``area`` in Quartet.

    Blender has one engine per scene and one scene per window. So the window shows a scene of its own that links the same
    collections: what is edited in one changes in both.
    """
    scene = context.scene
    space = area.spaces.active
    space.shading.type = "RENDERED"
    name = f"{scene.name} in Cycles"
    twin = bpy.data.scenes.get(name) or bpy.data.scenes.new(name)
    _link_alike(scene, twin)
    before = set(context.window_manager.windows)
    # A main window: child windows have their parent's scene.
    with context.temp_override(window=context.window, area=area):
        bpy.ops.wm.window_new_main()
    window = next(w for w in context.window_manager.windows if w not in before)
    window.scene = twin
    other = max(window.screen.areas, key=lambda a: a.width * a.height)
    other.type = "VIEW_3D"
    shown = other.spaces.active
    shown.shading.type = "RENDERED"
    for attribute in ("view_perspective", "view_location", "view_rotation", "view_distance", "view_camera_zoom",
                      "view_camera_offset"):  # fmt: skip
        setattr(shown.region_3d, attribute, getattr(space.region_3d, attribute))
    shown.lens, shown.clip_start, shown.clip_end = space.lens, space.clip_start, space.clip_end
    return window


def _link_alike(scene: bpy.types.Scene, twin: bpy.types.Scene) -> None:
    """Make ``twin`` show what ``scene`` does, in Cycles and with the same view transform."""
    for shown, wanted in ((twin.collection.children, scene.collection.children),
                          (twin.collection.objects, scene.collection.objects)):  # fmt: skip
        for item in list(shown):
            if item.name not in wanted:
                shown.unlink(item)
        for item in wanted:
            if item.name not in shown:
                shown.link(item)
    twin.world, twin.camera = scene.world, scene.camera
    twin.frame_set(scene.frame_current)
    for name in ("resolution_x", "resolution_y", "resolution_percentage", "film_transparent", "pixel_aspect_x",
                 "pixel_aspect_y"):  # fmt: skip
        setattr(twin.render, name, getattr(scene.render, name))
    for name in ("view_transform", "look", "exposure", "gamma"):
        setattr(twin.view_settings, name, getattr(scene.view_settings, name))
    twin.render.engine = "CYCLES"


register, unregister = bpy.utils.register_classes_factory(
    (QUARTET_OT_preset, QUARTET_MT_presets, QUARTET_OT_add_preset, QUARTET_OT_split_view)
)
