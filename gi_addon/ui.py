# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels, generated from the settings. A setting that no panel here names lands in the technique's panel."""

from __future__ import annotations

import dataclasses

import bpy
from bl_ui.utils import PresetPanel

from . import presets
from .effects import RESOURCES, source_of
from .gl import shared
from .host import comparison, status
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
_GROUPS = [f.name for f in dataclasses.fields(Settings) if dataclasses.is_dataclass(getattr(Settings(), f.name))]
_TECHNIQUES = {name: label for name, label, _ in TECHNIQUES}
_SAMPLING = ("samples", "viewport_samples", "motion_steps")
_FILM = ("pixel_filter", "filter_width")
_ELSEWHERE = {"technique", *RESOURCES, *_SAMPLING, *_FILM}
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


def lines(text: str, width: int) -> list[str]:
    """``text`` in lines for labels, which Blender does not wrap."""
    out: list[str] = []
    for word in text.split():
        if out and len(out[-1]) + 1 + len(word) <= width:
            out[-1] += f" {word}"
        else:
            out.append(word)
    return out


# About: a letter of Blender's font and what else stands in a line of a panel, in pixels at scale 1.
_LETTER, _AROUND = 6.5, 75


def _letters() -> int:
    """How many letters fit into a line of the region that is being drawn."""
    region = bpy.context.region
    if region is None or region.width <= 1:
        return 52
    return max(16, int((region.width / bpy.context.preferences.system.ui_scale - _AROUND) / _LETTER))


def _say(layout, text: str, icon: str = "NONE") -> None:
    column = layout.column(align=True)
    for number, line in enumerate(lines(text, _letters())):
        column.label(text=line, icon=icon if number == 0 else "BLANK1" if icon != "NONE" else "NONE")


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
        row = self.layout.row(align=True)
        for name, preset in presets.PRESETS.items():
            row.operator(QUARTET_OT_preset.bl_idname, text=preset.label).preset = name
        column = self._column()
        column.prop(settings, "technique")
        strength, weakness = CHARACTER.get(settings.technique, ("", ""))
        if strength:
            _say(column, strength, "ADD")
            _say(column, weakness, "REMOVE")
        for name in _TOP:
            if name not in _ELSEWHERE:
                column.prop(settings, name)


class QUARTET_PT_sampling(_Panel, bpy.types.Panel):
    """Sub-frames."""

    bl_label = "Sampling"

    def draw(self, context):
        column = self._column()
        for name, text in zip(_SAMPLING, ("Render", "Viewport", "Motion Steps"), strict=True):
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
            row = column.row()
            row.prop(settings, effect)
            row = row.row()
            row.active = False
            row.label(text=f"{_KINDS[source.kind]}: {source.text}" if source.kind != "none" else source.text,
                      icon=_ICONS[source.kind])  # fmt: skip
            if source.detail:
                row = column.row()
                row.active = False
                row.label(text=source.detail, icon="BLANK1")
            why = left_out.get(source.text)
            if getattr(settings, effect) and why:
                row = column.row()
                row.active = False
                row.label(text=f"left out: {why}", icon="INFO")


class QUARTET_PT_film(_Panel, bpy.types.Panel):
    """Pixel filter and transparency."""

    bl_label = "Film"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        column = self._column()
        column.prop(context.scene.render, "film_transparent", text="Transparent")
        for name in _FILM:
            column.prop(context.scene.quartet, name)


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
        group = getattr(context.scene.quartet, self.group)
        for field in dataclasses.fields(getattr(Settings(), self.group)):
            column.prop(group, field.name)


def _group_label(name: str) -> str:
    """A settings group's title: its technique's, or what its docstring opens with."""
    if name.upper() in _TECHNIQUES:
        return _TECHNIQUES[name.upper()]
    text = type(getattr(Settings(), name)).__doc__ or name
    return text.split("(")[0].split(",")[0].strip(" .").title()


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
            box.label(text=f"{report.kind.title()}: {report.technique}, {width} × {height}, {report.subframes} sub-frames, "
                           f"{report.seconds:.2f} s, {report.mib:.1f} MiB")  # fmt: skip
            grid = box.grid_flow(row_major=True, columns=3, align=True)
            for row in report.rows:
                grid.label(text=row.title)
                grid.label(text="" if row.milliseconds is None else f"{row.milliseconds:.2f} ms")
                grid.label(text=f"{row.mib:.2f} MiB")
            column = box.column(align=True)
            column.active = False
            for title, reason in report.skipped:
                column.label(text=f"{title}: {reason}", icon="CHECKBOX_DEHLT")


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
        row = layout.row()
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
        box.label(text=outcome.title)
        grid = box.grid_flow(row_major=True, columns=5, align=True)
        for title in ("Pass", "Gain", "relMSE", "Noise", "FLIP"):
            grid.label(text=title)
        for name, score in outcome.scores.items():
            grid.label(text=name)
            for value in (score.gain, score.rel_mse, score.noise_floor, score.flip):
                grid.label(text=f"{value:.3g}")
        box.operator(QUARTET_OT_open_page.bl_idname, icon="URL")
        _say(box, "relMSE is the error beyond Cycles' own noise; gain is the ratio of all light")


class QUARTET_PT_passes(_Panel, bpy.types.Panel):
    """The passes that a render writes."""

    bl_label = "Passes"
    bl_context = "view_layer"

    def draw(self, context):
        column = self._column()
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
    if not bpy.app.timers.is_registered(_look):
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
                   QUARTET_PT_film, QUARTET_PT_performance, QUARTET_PT_materials, QUARTET_PT_compare,
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
