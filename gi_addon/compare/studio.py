# SPDX-License-Identifier: GPL-3.0-or-later
"""Many frames with one renderer: what sweeps, benches and the stability suite render with."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from ..engines import TECHNIQUES
from ..gl import GL, GLThread, shared
from ..gl.formats import FORMATS
from ..graph import Pass, Texture
from ..renderer import Renderer, Result
from ..scene import Scene
from ..settings import SettingError, Settings


def settings_for(technique: str, **values: Any) -> Settings:
    """Default settings of a technique with ``values`` by name, ``__`` for the dot (``rsm__samples=64``)."""
    settings = Settings()
    settings.set("technique", technique)
    for name, value in values.items():
        settings.set(name.replace("__", "."), value)
    return settings


def has_setting(path: str) -> bool:
    """Whether there is a setting of that dotted name."""
    if not path:
        return False
    try:
        Settings().get(path)
    except SettingError:
        return False
    return True


class Studio:
    """A renderer that lives on the GL thread; frames keep what the next can use, as in the viewport."""

    def __init__(self, thread: GLThread | None = None) -> None:
        self.thread = thread or shared()
        self.renderer: Renderer = self.thread.call(Renderer)

    def __enter__(self) -> Studio:
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def close(self) -> None:
        self.call(lambda gl: self.renderer.close())

    def call(self, job: Callable[[GL], Any]) -> Any:
        """Run ``job(gl)`` on the GL thread."""
        return self.thread.call(job)

    def render(self, scene: Scene, settings: Settings, outputs, resolution: tuple[int, int], **options) -> Result:
        """One frame; see ``Renderer.render``."""
        return self.call(lambda gl: self.renderer.render(scene, settings, tuple(outputs), resolution=resolution, **options))

    def textures(self) -> dict[str, np.ndarray]:
        """Every floating-point texture of the last frame's graph, flat; level 0 only."""

        def read(gl: GL) -> dict[str, np.ndarray]:
            out = {}
            frame = self.renderer.frame
            resources = {w.name: w for p in self.renderer._plan.run for w in p.writes}
            for name, declared in resources.items():
                if isinstance(declared, Texture) and declared.format != "depth24":
                    kind = {"f4": np.float32, "f2": np.float16}.get(FORMATS[declared.format].dtype)
                    if kind is not None:
                        out[name] = np.frombuffer(frame.resources[name].read(), kind)
            return out

        return self.call(read)


@contextlib.contextmanager
def without_pass(technique: str, title: str) -> Iterator[None]:
    """Plan ``technique`` as if the pass called ``title`` had nothing to do; whoever must read it goes with it."""
    make = TECHNIQUES[technique]

    def removed(settings: Settings, layers: tuple[str, ...]) -> list[Pass]:
        passes = make(settings, layers)
        for task in passes:
            if task.title == title:
                task.absent = lambda facts: "removed by the ablation"
        return passes

    TECHNIQUES[technique] = removed
    try:
        yield
    finally:
        TECHNIQUES[technique] = make
