# SPDX-License-Identifier: GPL-3.0-or-later
"""``scene.quartet``: property groups generated from the settings tree."""

from __future__ import annotations

import dataclasses

import bpy

from ..settings import Meta, Settings, meta_of, walk

_classes: list[type] = []


def _redraw(_settings, _context) -> None:
    """Have the viewports drawn again: Blender does not know that they depend on these."""
    for window_manager in bpy.data.window_managers:
        for window in window_manager.windows:
            for area in window.screen.areas:
                if area.type == "VIEW_3D":
                    area.tag_redraw()


def _property(default, meta: Meta):
    common = {"name": meta.label, "description": meta.text, "default": default, "update": _redraw}
    if meta.choices:
        return bpy.props.EnumProperty(items=list(meta.choices), **common)
    if isinstance(default, bool):
        return bpy.props.BoolProperty(**common)
    limits = {}
    if meta.low is not None:
        limits["min"] = meta.low
    if meta.high is not None:
        limits["max"] = meta.high
    if meta.soft_high is not None:
        limits["soft_max"] = meta.soft_high
    if isinstance(default, int):
        whole = {k: int(v) for k, v in limits.items()}
        return bpy.props.IntProperty(**common, **whole)
    kind = {"m": {"subtype": "DISTANCE", "unit": "LENGTH"}}.get(meta.unit, {})
    return bpy.props.FloatProperty(**common, **limits, **kind)


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


def _show(window, _context) -> None:
    from . import comparison  # which reads settings through this module

    comparison.show(window)


def _make_window() -> type:
    """What this session of Blender shows; saved in no file and no part of the picture."""
    from . import comparison

    annotations = {
        "reference": bpy.props.EnumProperty(
            name="Reference", default="Rinf",
            description="What Cycles renders to compare with",
            items=[("R1", "One Bounce", "What the paper's techniques approximate"),
                   ("Rinf", "All Bounces", "32 bounces: the truth")],
        ),
        "reference_samples": bpy.props.IntProperty(
            name="Cycles Samples", default=64, min=1, max=65536, soft_max=1024,
            description="Samples of each of two Cycles renders. Higher: less noise in the reference. Lower: sooner",
        ),
        "compare_percentage": bpy.props.IntProperty(
            name="Size", default=50, min=1, max=100, subtype="PERCENTAGE",
            description="Size of the compared pictures, as a share of the render size",
        ),
        "compare_pass": bpy.props.EnumProperty(
            name="Pass", items=comparison.passes, update=_show, description="Pass of the comparison that is shown"
        ),
        "compare_view": bpy.props.EnumProperty(
            name="View", items=comparison.VIEWS, update=_show, description="How the two pictures are shown together"
        ),
        "open_page": bpy.props.BoolProperty(
            name="Open Page", default=True,
            description="Open the comparison's page in the web browser when it is done",
        ),
        "cancel_compare": bpy.props.BoolProperty(name="Cancel", description="Give the comparison up"),
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


def owner_of(scene: bpy.types.Scene, path: str) -> tuple[bpy.types.PropertyGroup, str]:
    """The group in ``scene.quartet`` that holds the setting ``path``, and its name there."""
    owner = scene.quartet
    *groups, name = path.split(".")
    for group in groups:
        owner = getattr(owner, group)
    return owner, name


def read(scene: bpy.types.Scene) -> Settings:
    """Settings from ``scene.quartet``."""
    settings = Settings()
    for path, _, _ in walk():
        settings.set(path, getattr(*owner_of(scene, path)))
    return settings


def write(scene: bpy.types.Scene, settings: Settings) -> None:
    """Put ``settings`` into ``scene.quartet``."""
    for path, value in settings.as_dict().items():
        setattr(*owner_of(scene, path), value)
