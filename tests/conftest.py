# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures. Every picture is small: software OpenGL on two cores renders it."""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path

import numpy as np
import pytest

from gi_addon.gl import shared
from gi_addon.renderer import Result, render
from gi_addon.scene import Scene
from gi_addon.settings import Settings

ROOT = Path(__file__).resolve().parent.parent
SHARED = ROOT.parent / "shared"
HAS_BPY = importlib.util.find_spec("bpy") is not None
PICTURE = (96, 54)


def pytest_collection_modifyitems(config, items):
    skip = pytest.mark.skip(reason="needs bpy")
    slow = pytest.mark.skip(reason="slow: run with -m slow")
    for item in items:
        if "blender" in item.keywords and not HAS_BPY:
            item.add_marker(skip)
        if "slow" in item.keywords and "slow" not in (config.option.markexpr or ""):
            item.add_marker(slow)


@pytest.fixture(scope="session")
def gl():
    """Run ``job(gl, *args)`` on the GL thread: ``gl(job, *args)``. The driver in use is printed once."""
    thread = shared()
    print(f"\nOpenGL driver: {thread.call(lambda g: g.driver)}")
    return thread.call


@pytest.fixture(scope="session")
def shared_scenes() -> Path:
    """The folder of real scenes; skips where it is not there: the project works without it."""
    folder = SHARED / "scenes"
    if not folder.is_dir():
        pytest.skip("no shared scenes here")
    return folder


def make(scene: Scene, *outputs: str, resolution=PICTURE, **settings) -> Result:
    """Render ``scene``; settings by name with ``__`` for the dot, e.g. ``rsm__samples=64``."""
    chosen = Settings()
    for name, value in settings.items():
        chosen.set(name.replace("__", "."), value)
    return render(scene, chosen, outputs or ("Combined",), resolution=resolution)


@pytest.fixture(scope="session")
def blender():
    """The embedded Blender with Quartet registered, unregistered at the end: bpy 4.5 hangs at exit otherwise."""
    bpy = pytest.importorskip("bpy")
    import gi_addon

    gi_addon.register()
    yield bpy
    gi_addon.unregister()


def pictures_to(folder: str, name: str, **images: np.ndarray) -> None:
    """Write images (H, W, 3) of a failing test under ``$QUARTET_TEST_OUTPUT``, if that is set."""
    target = os.environ.get("QUARTET_TEST_OUTPUT")
    if not target:
        return
    from gi_addon.compare.sheet import exposure, write_png

    path = Path(target) / folder
    path.mkdir(parents=True, exist_ok=True)
    scale = exposure(images.get("reference", next(iter(images.values()))))
    for kind, image in images.items():
        write_png(path / f"{name}-{kind}.png", image * scale)
