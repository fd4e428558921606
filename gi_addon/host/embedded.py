# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender as a module under the command line: scenes opened, read and written as pictures."""

from __future__ import annotations

import atexit
from pathlib import Path

import bpy

from .. import register, unregister
from ..compare.scenes import BUILTIN
from ..renderer import RenderError
from ..scene import Scene
from . import cycles, files
from .build import build
from .engine import picture
from .sync import SceneSync


def open_scene(
    name: str | Path, frame: int | None = None, resolution: tuple[int, int] | None = None
) -> tuple[bpy.types.Scene, list[str]]:
    """The scene of a file or of ``builtin:NAME`` with the extension registered, and notes on what had to be added.

    Raises RenderError for a name that isn't built in and for a file that can't be read.
    """
    if not hasattr(bpy.types.Scene, "quartet"):
        register()
        # A registered engine left behind makes Blender 4.5 hang when the process ends.
        atexit.register(lambda: hasattr(bpy.types.Scene, "quartet") and unregister())
    if str(name).startswith("builtin:"):
        builtin = str(name).removeprefix("builtin:")
        if builtin not in BUILTIN:
            raise RenderError(f"no scene builtin:{builtin}; there are {', '.join(BUILTIN)}")
        scene, notes = build(BUILTIN[builtin]()), []
    else:
        scene, notes = files.load(name)
    if resolution:
        scene.render.resolution_x, scene.render.resolution_y = resolution
        scene.render.resolution_percentage = 100
    scene.render.use_border = False
    if frame is not None:
        scene.frame_set(frame)
    return scene, notes


def plain(scene: bpy.types.Scene) -> tuple[Scene, tuple[int, int]]:
    """The plain scene of a Blender scene, and its picture's size."""
    size, _ = picture(scene.render)
    return SceneSync().read(bpy.context.evaluated_depsgraph_get(), resolution=size), size


def render_png(scene: bpy.types.Scene, output: Path) -> None:
    """Render through Blender's own writer, so that the scene's view transform applies."""
    image = scene.render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "IMAGE"
    image.file_format, image.color_mode = "PNG", "RGBA" if scene.render.film_transparent else "RGB"
    scene.render.filepath = str(output.resolve().with_suffix(""))
    scene.render.use_file_extension = True
    with cycles.quiet():
        bpy.ops.render.render(write_still=True, scene=scene.name)
