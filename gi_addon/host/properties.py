# SPDX-License-Identifier: GPL-3.0-or-later
"""``scene.quartet``: property groups generated from the settings tree."""

from __future__ import annotations

import dataclasses

import bpy

from ..settings import Meta, Settings, meta_of, walk

_classes: list[type] = []


def _property(default, meta: Meta):
    text = meta.text
    if meta.choices:
        return bpy.props.EnumProperty(name=meta.label, description=text, items=list(meta.choices), default=default)
    if isinstance(default, bool):
        return bpy.props.BoolProperty(name=meta.label, description=text, default=default)
    limits = {}
    if meta.low is not None:
        limits["min"] = meta.low
    if meta.high is not None:
        limits["max"] = meta.high
    if meta.soft_high is not None:
        limits["soft_max"] = meta.soft_high
    if isinstance(default, int):
        whole = {k: int(v) for k, v in limits.items()}
        return bpy.props.IntProperty(name=meta.label, description=text, default=default, **whole)
    kind = {"m": {"subtype": "DISTANCE", "unit": "LENGTH"}}.get(meta.unit, {})
    return bpy.props.FloatProperty(name=meta.label, description=text, default=default, **limits, **kind)


def _make(cls: type, name: str) -> type:
    """A PropertyGroup class for a settings dataclass and, below it, for its groups."""
    instance = cls()
    annotations = {}
    for field in dataclasses.fields(cls):
        value = getattr(instance, field.name)
        if dataclasses.is_dataclass(value):
            group = _make(type(value), f"{name}_{field.name}")
            annotations[field.name] = bpy.props.PointerProperty(type=group)
        else:
            annotations[field.name] = _property(value, meta_of(cls, field.name))
    made = type(name, (bpy.types.PropertyGroup,), {"__annotations__": annotations, "__doc__": cls.__doc__})
    bpy.utils.register_class(made)
    _classes.append(made)
    return made


_window_class: list[type] = []


def _make_window() -> type:
    """What this session of Blender shows; saved in no file and no part of the picture."""
    annotations = {
        "measure": bpy.props.BoolProperty(
            name="Measure Passes", default=False,
            description="Time every pass of the viewport. On software OpenGL this costs a little speed",
        ),
    }  # fmt: skip
    made = type("QuartetWindow", (bpy.types.PropertyGroup,), {"__annotations__": annotations})
    bpy.utils.register_class(made)
    _window_class.append(made)
    return made


def register() -> None:
    bpy.types.Scene.quartet = bpy.props.PointerProperty(type=_make(Settings, "QuartetSettings"), name="Quartet GI")
    bpy.types.WindowManager.quartet = bpy.props.PointerProperty(
        type=_make_window(), name="Quartet GI", options={"SKIP_SAVE"}
    )


def unregister() -> None:
    del bpy.types.WindowManager.quartet
    bpy.utils.unregister_class(_window_class.pop())
    del bpy.types.Scene.quartet
    for cls in reversed(_classes):
        bpy.utils.unregister_class(cls)
    _classes.clear()


def read(scene: bpy.types.Scene) -> Settings:
    """Settings from ``scene.quartet``."""
    settings = Settings()
    for path, _, _ in walk():
        owner = scene.quartet
        *groups, name = path.split(".")
        for group in groups:
            owner = getattr(owner, group)
        settings.set(path, getattr(owner, name))
    return settings


def write(scene: bpy.types.Scene, settings: Settings) -> None:
    """Put ``settings`` into ``scene.quartet``."""
    for path, value in settings.as_dict().items():
        owner = scene.quartet
        *groups, name = path.split(".")
        for group in groups:
            owner = getattr(owner, group)
        setattr(owner, name, value)
