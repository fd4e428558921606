# SPDX-License-Identifier: GPL-3.0-or-later
"""Quartet in the real Blender program, as a user runs it."""

from __future__ import annotations

import pytest
from real_blender import run

pytestmark = pytest.mark.realblender


def test_it_renders_in_the_background(tmp_path):
    """``blender -b``: F12's path without a window; the picture is lit and of the right size."""
    answer = run(
        f"""
import gi_addon
gi_addon.register()
from gi_addon.compare import scenes
from gi_addon.host.build import build
scene = build(scenes.cornell())
scene.render.engine = "QUARTET"
scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 64, 36, 100
scene.quartet.samples = 2
scene.view_settings.view_transform = "Standard"
scene.render.image_settings.file_format = "PNG"
scene.render.filepath = {str(tmp_path / "out.png")!r}
bpy.ops.render.render(write_still=True)
image = bpy.data.images.load(scene.render.filepath)
pixels = list(image.pixels)
report(size=list(image.size), mean=sum(pixels[0::4]) / (len(pixels) / 4), version=bpy.app.version_string)
gi_addon.unregister()
""",
        tmp_path,
        "-b",
    )
    assert answer["size"] == [64, 36]
    assert 0.02 < answer["mean"] < 0.9


def test_f12_in_the_window_renders_on_the_job_thread(tmp_path):
    """In a window render() runs on another thread while the interface lives."""
    answer = run(
        """
import os
import gi_addon
gi_addon.register()
from gi_addon.compare import scenes
from gi_addon.host.build import build

def start():
    try:
        scene = build(scenes.cornell(), clear=False)
        for o in list(scene.objects):
            if o.name in ("Cube", "Light") or (o.type == "CAMERA" and o != scene.camera):
                bpy.data.objects.remove(o)
        scene.render.engine = "QUARTET"
        scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 64, 36, 100
        scene.quartet.samples = 4
        import threading
        from gi_addon.host import engine
        seen = []
        engine.listeners.append(lambda share, text: seen.append((share, threading.current_thread().name)))
        def finished(*_):
            main = threading.main_thread().name
            report(calls=len(seen), share=seen[-1][0] if seen else 0.0,
                   other_thread=any(name != main for _, name in seen), size=list(scene.render.resolution_x for _ in "x"))
            bpy.app.timers.register(lambda: os._exit(0), first_interval=0.5)
        bpy.app.handlers.render_complete.append(finished)
        bpy.app.handlers.render_cancel.append(lambda *_: report(cancelled=True))
        bpy.ops.render.render("INVOKE_DEFAULT")
    except Exception as error:
        report(error=repr(error))
        os._exit(1)

bpy.app.timers.register(start, first_interval=1.0)
""",
        tmp_path,
        "--window",
        "1000x700",
        timeout=300,
    )
    assert "error" not in answer and "cancelled" not in answer, answer
    assert answer["share"] == 1.0 and answer["other_thread"]
