# SPDX-License-Identifier: GPL-3.0-or-later
"""Write the bundled example scenes: ``.venv/bin/python scripts/make_examples.py``."""

from __future__ import annotations

from pathlib import Path

import bpy

import gi_addon
from gi_addon.compare import scenes
from gi_addon.host.build import build

FOLDER = Path(__file__).resolve().parent.parent / "examples"


def main() -> None:
    gi_addon.register()
    scene = build(scenes.cornell(fov=1.15))
    scene.name = "Cornell box"
    scene.render.engine = "QUARTET"
    scene.render.resolution_x, scene.render.resolution_y = 960, 540
    scene.view_settings.view_transform = "Standard"
    bpy.context.preferences.filepaths.save_version = 0
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "cornell.blend"), compress=True)
    gi_addon.unregister()


if __name__ == "__main__":
    main()
