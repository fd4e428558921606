# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension's page in Blender's preferences: driver and log."""

from __future__ import annotations

import bpy

from .. import gl
from . import status

ROOT = __package__.rpartition(".")[0]
_LINES = 12


class QUARTET_OT_check_driver(bpy.types.Operator):
    """Start OpenGL and say which driver answers"""

    bl_idname = "quartet.check_driver"
    bl_label = "Check OpenGL"

    def execute(self, context):
        try:
            self.report({"INFO"}, gl.driver())
            status.resolved("driver")
        except gl.GLError as error:
            status.failed("driver", str(error))
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class QUARTET_OT_copy_log(bpy.types.Operator):
    """Copy driver and log to the clipboard, for a bug report"""

    bl_idname = "quartet.copy_log"
    bl_label = "Copy Log"

    def execute(self, context):
        context.window_manager.clipboard = log_text()
        return {"FINISHED"}


class QuartetPreferences(bpy.types.AddonPreferences):
    """Driver and log."""

    bl_idname = ROOT

    def draw(self, context):
        draw(self.layout)


def log_text() -> str:
    """Versions, driver and the log as text."""
    head = f"Blender {bpy.app.version_string}, OpenGL: {gl.shared().driver or 'not started yet'}"
    return "\n".join([head, *status.log_lines()])


def draw(layout) -> None:
    """Draw the page."""
    row = layout.row()
    row.label(text=f"OpenGL driver: {gl.shared().driver or 'not started yet'}")
    row.operator(QUARTET_OT_check_driver.bl_idname)
    if status.problem():
        layout.label(text=status.problem(), icon="ERROR")
    box = layout.box()
    row = box.row()
    row.label(text="Log")
    row.operator(QUARTET_OT_copy_log.bl_idname, icon="COPYDOWN")
    lines = status.log_lines()[-_LINES:]
    for line in lines or ["Nothing to report."]:
        box.label(text=line)


register, unregister = bpy.utils.register_classes_factory((QUARTET_OT_check_driver, QUARTET_OT_copy_log, QuartetPreferences))
