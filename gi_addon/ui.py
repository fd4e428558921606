# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels, generated from the settings."""

from __future__ import annotations

import dataclasses

import bpy

from .settings import Settings

_EFFECTS = (
    "use_indirect_diffuse", "use_glossy", "use_shadows", "use_ao", "use_translucency", "use_volumetric",
    "use_area_lights",
)  # fmt: skip
_GROUPS = {f.name for f in dataclasses.fields(Settings) if dataclasses.is_dataclass(getattr(Settings(), f.name))}


class _Panel:
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    COMPAT_ENGINES = {"QUARTET"}

    @classmethod
    def poll(cls, context):
        return context.engine in cls.COMPAT_ENGINES

    def _column(self):
        self.layout.use_property_split = True
        self.layout.use_property_decorate = False
        return self.layout.column()


class QUARTET_PT_technique(_Panel, bpy.types.Panel):
    """Technique and sampling."""

    bl_label = "Global Illumination"

    def draw(self, context):
        column = self._column()
        for name in ("technique", "bounces", "samples", "viewport_samples"):
            column.prop(context.scene.quartet, name)


class QUARTET_PT_effects(_Panel, bpy.types.Panel):
    """What light does."""

    bl_label = "Effects"

    def draw(self, context):
        column = self._column()
        for name in _EFFECTS:
            column.prop(context.scene.quartet, name)


class QUARTET_PT_film(_Panel, bpy.types.Panel):
    """Pixel filter and transparency."""

    bl_label = "Film"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        column = self._column()
        column.prop(context.scene.render, "film_transparent", text="Transparent")
        column.prop(context.scene.quartet, "pixel_filter")
        column.prop(context.scene.quartet, "filter_width")


class _GroupPanel(_Panel):
    bl_options = {"DEFAULT_CLOSED"}
    group = ""

    def draw(self, context):
        column = self._column()
        group = getattr(context.scene.quartet, self.group)
        for name in group.__annotations__:
            column.prop(group, name)


def _group_panels() -> list[type]:
    labels = {"rsm": "Reflective Shadow Maps", "ao": "Ambient Occlusion", "world": "World Light", "shadows": "Shadows"}
    return [
        type(f"QUARTET_PT_{name}", (_GroupPanel, bpy.types.Panel), {"bl_label": labels.get(name, name), "group": name})
        for name in (f.name for f in dataclasses.fields(Settings))
        if name in _GROUPS
    ]


_classes: list[type] = []


def register() -> None:
    _classes[:] = [QUARTET_PT_technique, QUARTET_PT_effects, *_group_panels(), QUARTET_PT_film]
    for cls in _classes:
        bpy.utils.register_class(cls)


def unregister() -> None:
    for cls in reversed(_classes):
        bpy.utils.unregister_class(cls)
    _classes.clear()


