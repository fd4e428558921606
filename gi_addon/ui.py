# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels, generated from the settings. A setting that no panel here names lands in the technique's panel."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable

import blf
import bpy
from bl_ui.utils import PresetPanel

from . import presets
from .effects import RESOURCES, in_effect, source_of
from .gl import shared
from .host import comparison, properties, status
from .host.comparison import QUARTET_OT_compare, QUARTET_OT_open_page
from .host.operators import QUARTET_MT_presets, QUARTET_OT_add_preset, QUARTET_OT_preset, QUARTET_OT_split_view
from .outputs import OUTPUTS
from .settings import TECHNIQUES, Settings, walk

# What each technique is good at and what it gets wrong, one line each, for who has to choose.
CHARACTER = {
    "RSM": ("Sharp first bounce from every light, sees what is off the screen",
            "Coarse visibility between surfaces; one bounce"),
    "LPV": ("Smooth, even light at a price that hardly grows with the picture",
            "Light leaks through thin walls; nothing finer than a cell"),
    "VCT": ("Several bounces, glossy and occlusion from one grid of the whole scene",
            "Memory grows with the cube of the detail; thin walls leak"),
    "SSDO": ("Finest contact detail, needs no structure but the picture",
             "What the camera does not see gives no light"),
}  # fmt: skip
# Titles that fit into a narrow properties editor; the technique's own panel is called after its letters.
_TITLES = {"shadows": "Shadow Maps", "ao": "Ambient Occlusion", "world": "World Light", "volume": "Volumetric Light"}
_GROUPS = [f.name for f in dataclasses.fields(Settings) if dataclasses.is_dataclass(getattr(Settings(), f.name))]
_TECHNIQUES = {name: label for name, label, _ in TECHNIQUES}
_SAMPLING = ("samples", "viewport_samples")
_FILM = ("pixel_filter", "filter_width")
_ELSEWHERE = {"technique", "motion_steps", *RESOURCES, *_SAMPLING, *_FILM}
_TOP = [path for path, _, _ in walk() if "." not in path]
_ICONS = {"own": "CHECKMARK", "shared": "LINKED", "none": "X"}
_KINDS = {"own": "own", "shared": "shared pass", "none": "not possible"}


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


def lines(text: str, room: float, width: Callable[[str], float] = len) -> list[str]:
    """``text`` in lines for labels, which Blender does not wrap: none wider than ``room`` by ``width`` unless one word is."""
    out: list[str] = []
    for word in text.split():
        longer = f"{out[-1]} {word}" if out else word
        if out and width(longer) <= room:
            out[-1] = longer
        else:
            out.append(word)
    return out


# What else than text stands in a line of a panel, in pixels at scale 1: tabs and scroll bar are regions of their own.
_AROUND = 62
_UNKNOWN_WIDTH = 340  # pixels, where nothing is being drawn
_NARROW = 300  # pixels at scale 1, below which four buttons beside each other lose their names


def _width() -> float:
    """Width of the region that is being drawn, in pixels at scale 1."""
    region = bpy.context.region
    if region is None or region.width <= 1:
        return _UNKNOWN_WIDTH
    return region.width / _scale()


def _scale() -> float:
    return bpy.context.preferences.system.ui_scale or 1.0  # 0 without a window


def _letters(text: str) -> float:
    """Width of ``text`` in Blender's interface font, in pixels at scale 1."""
    blf.size(0, bpy.context.preferences.ui_styles[0].widget.points * _scale())
    return blf.dimensions(0, text)[0] / _scale()


def _say(layout, text: str, icon: str = "NONE", *, active: bool = True) -> None:
    column = layout.column(align=True)
    column.active = active
    for number, line in enumerate(lines(text, _width() - _AROUND, _letters)):
        column.label(text=line, icon=icon if number == 0 else "BLANK1" if icon != "NONE" else "NONE")


def _props(layout, scene, paths: Iterable[str]) -> None:
    """Settings, each greyed out while it has no effect."""
    settings = properties.read(scene)
    for path in paths:
        row = layout.row()
        row.active = in_effect(path, settings)
        row.prop(*properties.owner_of(scene, path))


class QUARTET_PT_presets(PresetPanel, bpy.types.Panel):
    """The user's own presets, in the header as Blender's are."""

    bl_label = "Quartet Presets"
    preset_subdir = "quartet"
    preset_operator = "script.execute_preset"
    preset_add_operator = QUARTET_OT_add_preset.bl_idname
    COMPAT_ENGINES = {"QUARTET"}

    @staticmethod
    def draw_panel_header(layout):
        PresetPanel.draw_panel_header.__func__(QUARTET_PT_presets, layout)


class QUARTET_PT_technique(_Panel, bpy.types.Panel):
    """Technique and quality."""

    bl_label = "Global Illumination"

    def draw_header_preset(self, context):
        QUARTET_PT_presets.draw_panel_header(self.layout)

    def draw(self, context):
        settings = context.scene.quartet
        _watch()
        if status.problem():
            box = self.layout.box()
            _say(box, status.problem(), "ERROR")
        grid = self.layout.grid_flow(row_major=True, columns=2 if _width() < _NARROW else 4, even_columns=True, align=True)
        for name, preset in presets.PRESETS.items():
            grid.operator(QUARTET_OT_preset.bl_idname, text=preset.label).preset = name
        # Over the whole width: these names are long.
        self.layout.prop(settings, "technique", text="")
        column = self._column()
        strength, weakness = CHARACTER.get(settings.technique, ("", ""))
        if strength:
            _say(column, strength, "ADD")
            _say(column, weakness, "REMOVE")
        _props(column, context.scene, [name for name in _TOP if name not in _ELSEWHERE])


class QUARTET_PT_sampling(_Panel, bpy.types.Panel):
    """Sub-frames."""

    bl_label = "Sampling"

    def draw(self, context):
        column = self._column()
        for name, text in zip(_SAMPLING, ("Render", "Viewport"), strict=True):
            column.prop(context.scene.quartet, name, text=text)


class QUARTET_PT_effects(_Panel, bpy.types.Panel):
    """What light does, and where each effect comes from."""

    bl_label = "Effects"

    def draw(self, context):
        settings = context.scene.quartet
        report = status.latest.get("viewport") or status.latest.get("final")
        left_out = dict(report.skipped) if report is not None and report.technique == settings.technique else {}
        column = self.layout.column()
        for effect in RESOURCES:
            source = source_of(settings.technique, effect)
            used = getattr(settings, effect)
            row = column.row()
            row.prop(settings, effect)
            if source.kind != "none":
                row.label(icon=_ICONS[source.kind])
            why = left_out.get(source.text)
            if source.kind == "none":
                _say(column, source.text, _ICONS["none"], active=False)
            elif used and why:
                _say(column, f"left out: {why}", "INFO", active=False)
            else:
                _say(column, f"{_KINDS[source.kind]}: {source.text}", "BLANK1", active=False)
                if source.detail:
                    _say(column, source.detail, "BLANK1", active=False)


class QUARTET_PT_motion_blur(_Panel, bpy.types.Panel):
    """Blender's own settings of the shutter, which no panel of its own shows for other engines than Cycles and EEVEE."""

    bl_label = "Motion Blur"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header(self, context):
        self.layout.prop(context.scene.render, "use_motion_blur", text="")

    def draw(self, context):
        render = context.scene.render
        column = self._column()
        column.active = render.use_motion_blur
        column.prop(render, "motion_blur_position", text="Position")
        column.prop(render, "motion_blur_shutter")
        column.prop(context.scene.quartet, "motion_steps", text="Steps")


class QUARTET_PT_film(_Panel, bpy.types.Panel):
    """Pixel filter and transparency."""

    bl_label = "Film"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        column = self._column()
        column.prop(context.scene.render, "film_transparent", text="Transparent")
        _props(column, context.scene, _FILM)


class _GroupPanel(_Panel):
    bl_options = {"DEFAULT_CLOSED"}
    group = ""

    @classmethod
    def poll(cls, context):
        # A technique's own settings show with the technique.
        own = cls.group.upper() in _TECHNIQUES
        return super().poll(context) and (not own or context.scene.quartet.technique == cls.group.upper())

    def draw(self, context):
        column = self._column()
        fields = dataclasses.fields(getattr(Settings(), self.group))
        _props(column, context.scene, [f"{self.group}.{field.name}" for field in fields])


def _group_label(name: str) -> str:
    """A settings group's title."""
    return f"{name.upper()} Settings" if name.upper() in _TECHNIQUES else _TITLES[name]


def _group_panels() -> list[type]:
    own = [name for name in _GROUPS if name.upper() in _TECHNIQUES]
    return [
        type(f"QUARTET_PT_{name}", (_GroupPanel, bpy.types.Panel), {"bl_label": _group_label(name), "group": name})
        for name in (*own, *(name for name in _GROUPS if name not in own))
    ]


class QUARTET_PT_performance(_Panel, bpy.types.Panel):
    """What the last frame ran, what it left out and why, and what it cost."""

    bl_label = "Performance"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        layout.prop(context.window_manager.quartet, "measure")
        _say(layout, shared().driver or "OpenGL has not been started yet", "MEMORY")
        for report in status.latest.values():
            width, height = report.resolution
            box = layout.box()
            _say(box, f"{report.kind.title()}: {report.technique}, {width} × {height}, {report.subframes} sub-frames, "
                      f"{report.seconds:.2f} s, {report.mib:.1f} MiB")  # fmt: skip
            column = box.column(align=True)
            for row in report.rows:
                numbers = [f"{row.mib:.1f} MiB"]
                if row.milliseconds is not None:
                    numbers = [f"{row.milliseconds:.1f} ms"] if _width() < _NARROW else [f"{row.milliseconds:.1f} ms", *numbers]
                _row(column, row.title, numbers)
            for title, reason in report.skipped:
                _say(box, f"{title}: {reason}", "CHECKBOX_DEHLT", active=False)


class QUARTET_PT_materials(_Panel, bpy.types.Panel):
    """Which nodes of which materials are not rendered exactly, and other notes of the last frame."""

    bl_label = "Approximated"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        reports = list(status.latest.values())
        entries = list(dict.fromkeys(entry for r in reports for entry in r.approximated))
        notes = list(dict.fromkeys(note for r in reports for note in r.notes))
        if not entries and not notes:
            self.layout.label(text="Nothing so far" if reports else "Nothing has been rendered yet")
        for name, text in entries:
            _say(self.layout, f"{name}: {text}", "MATERIAL")
        for note in notes:
            _say(self.layout, note, "INFO")


class QUARTET_PT_compare(_Panel, bpy.types.Panel):
    """Beside Cycles: pictures and numbers."""

    bl_label = "Compare with Cycles"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        window = context.window_manager.quartet
        column = self._column()
        for name in ("reference", "reference_samples", "compare_percentage", "open_page"):
            column.prop(window, name)
        row = layout.column(align=True) if _width() < _NARROW else layout.row()
        row.operator(QUARTET_OT_compare.bl_idname, icon="RENDER_STILL")
        row.operator(QUARTET_OT_split_view.bl_idname, icon="WINDOW")
        if comparison.running is not None:
            row = layout.row()
            row.progress(factor=comparison.running.share, text=comparison.running.text)
            row.prop(window, "cancel_compare", text="", icon="CANCEL")
        outcome = comparison.latest
        if outcome is None:
            return
        column = self._column()
        column.prop(window, "compare_pass")
        column.prop(window, "compare_view")
        box = layout.box()
        _say(box, outcome.title)
        column = box.column(align=True)
        figures = [("Gain", "gain"), ("relMSE", "rel_mse"), ("Noise", "noise_floor"), ("FLIP", "flip")]
        if _width() < _NARROW:
            figures = [("relMSE", "rel_mse"), ("FLIP", "flip")]
        _row(column, "Pass", [title for title, _ in figures])
        for name, score in outcome.scores.items():
            _row(column, name, [f"{getattr(score, figure):.2g}" for _, figure in figures])
        box.operator(QUARTET_OT_open_page.bl_idname, icon="URL")
        _say(box, "relMSE is the error beyond Cycles' own noise; gain is the ratio of all light")


def _row(layout, name: str, cells: list[str]) -> None:
    """A row of a table: a name, and numbers that stand under each other."""
    split = layout.split(factor=0.55 if len(cells) < 3 else 0.4)
    split.label(text=name)
    row = split.row()
    for cell in cells:
        row.label(text=cell)


class QUARTET_PT_passes(_Panel, bpy.types.Panel):
    """The passes that a render writes."""

    bl_label = "Passes"
    bl_context = "view_layer"

    def draw(self, context):
        # Names as long as these need the whole width.
        column = self.layout.column()
        for output in OUTPUTS.values():
            owner, _, flag = output.flag.rpartition(".")
            target = getattr(context.view_layer, owner, None) if owner else context.view_layer
            if output.name != "Combined" and hasattr(target, flag):
                column.prop(target, flag, text=output.name)


class QUARTET_PT_object_visibility(_Panel, bpy.types.Panel):
    """Which rays see an object."""

    bl_label = "Ray Visibility"
    bl_context = "object"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return super().poll(context) and context.object is not None

    def draw(self, context):
        column = self._column()
        for name in ("camera", "diffuse", "glossy", "transmission", "volume_scatter", "shadow"):
            column.prop(context.object, f"visible_{name}", text=name.replace("_", " ").title())
        column.prop(context.object, "is_holdout")


class QUARTET_PT_light_shadow(_Panel, bpy.types.Panel):
    """Whether a light casts shadows."""

    bl_label = "Shadow"
    bl_context = "data"

    @classmethod
    def poll(cls, context):
        return super().poll(context) and context.light is not None

    def draw(self, context):
        self._column().prop(context.light, "use_shadow", text="Cast Shadow")


class QUARTET_PT_world_distance(_Panel, bpy.types.Panel):
    """How far an occluder counts in the Ambient Occlusion pass."""

    bl_label = "Ambient Occlusion"
    bl_context = "world"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return super().poll(context) and context.scene.world is not None

    def draw(self, context):
        self._column().prop(context.scene.world.light_settings, "distance")


def _render_menu(menu, context) -> None:
    """The operators in the *Render* menu: there Blender's search (F3) finds them, and a right click gives them a key."""
    if context.engine != "QUARTET":
        return
    layout = menu.layout
    layout.separator()
    layout.operator_context = "INVOKE_DEFAULT"
    layout.operator(QUARTET_OT_compare.bl_idname, icon="RENDER_STILL")
    layout.operator(QUARTET_OT_open_page.bl_idname, icon="URL")
    layout.operator(QUARTET_OT_split_view.bl_idname, icon="WINDOW")
    layout.operator_menu_enum(QUARTET_OT_preset.bl_idname, "preset", icon="PRESET")


# --- redrawing --------------------------------------------------------------------------------------------------------

# Frames end on other threads, which must not touch the interface: while the panels are in use a timer looks for news.
_LOOK = 0.5  # seconds
_seen = -1


def _watch() -> None:
    # Without a window there is nothing to redraw, and Blender 4.5 does not end while such a timer waits.
    if not bpy.app.background and not bpy.app.timers.is_registered(_look):
        bpy.app.timers.register(_look, first_interval=_LOOK)


def _look() -> float | None:
    """Redraw the panels if there is something new to say; ends when no window shows the engine."""
    global _seen
    windows = [w for m in bpy.data.window_managers for w in m.windows if w.scene.render.engine == "QUARTET"]
    if status.changes != _seen:
        _seen = status.changes
        for window in windows:
            for area in window.screen.areas:
                if area.type == "PROPERTIES":
                    area.tag_redraw()
    return _LOOK if windows else None


_classes: list[type] = []


def register() -> None:
    _classes[:] = [QUARTET_PT_presets, QUARTET_PT_technique, QUARTET_PT_sampling, QUARTET_PT_effects, *_group_panels(),
                   QUARTET_PT_motion_blur, QUARTET_PT_film, QUARTET_PT_performance, QUARTET_PT_materials, QUARTET_PT_compare,
                   QUARTET_PT_passes, QUARTET_PT_object_visibility, QUARTET_PT_light_shadow,
                   QUARTET_PT_world_distance]  # fmt: skip
    for cls in _classes:
        # Unregistering took the engine out of every panel's list, these among them.
        if hasattr(cls, "COMPAT_ENGINES"):
            cls.COMPAT_ENGINES.add("QUARTET")
        bpy.utils.register_class(cls)
    bpy.types.TOPBAR_MT_render.append(_render_menu)


def unregister() -> None:
    bpy.types.TOPBAR_MT_render.remove(_render_menu)
    if bpy.app.timers.is_registered(_look):
        bpy.app.timers.unregister(_look)
    for cls in reversed(_classes):
        bpy.utils.unregister_class(cls)
    _classes.clear()


__all__ = ["CHARACTER", "QUARTET_MT_presets", "register", "unregister"]
