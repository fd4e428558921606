# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles and EEVEE as rivals: what a user would render instead, timed with the scene already loaded.

EEVEE runs in a process of its own: Blender's OpenGL context and Quartet's do not live well side by side (EGL_BAD_MATCH, and
then a hang). This module is that process too: ``python -m gi_addon.host.peers``.
"""

from __future__ import annotations

import json
import os
import queue
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np

from ..compare.sweeps import Candidate
from . import cycles

# Bounces of Cycles' default light paths.
_BOUNCES = 12


# A software driver compiles EEVEE's shaders for minutes; longer than this it is not coming back.
_PATIENCE_S = 600.0
VERSION = f"Blender {bpy.app.version_string}"
_MARK = "QUARTET-PEER "
_ROOT = str(Path(__file__).resolve().parents[2])


class Eevee:
    """EEVEE with a scene open, in another process, started on the first render."""

    def __init__(self, scene: str, size: tuple[int, int], frame: int | None) -> None:
        self._arguments = json.dumps({"scene": scene, "size": size, "frame": frame})
        self._process: subprocess.Popen | None = None
        self._lines: queue.SimpleQueue = queue.SimpleQueue()

    def __enter__(self) -> Eevee:
        return self

    def __exit__(self, *_) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.wait()

    def render(self, candidate: Candidate, names: Sequence[str]) -> tuple[dict[str, np.ndarray], float]:
        """As :func:`render`. Raises RuntimeError if the process fails or takes longer than ten minutes."""
        if self._process is None:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "gi_addon.host.peers", self._arguments],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                text=True,
                env={**os.environ, "PYTHONPATH": os.pathsep.join(p for p in (_ROOT, os.environ.get("PYTHONPATH")) if p)},
            )
            threading.Thread(target=self._listen, daemon=True).start()
        with tempfile.TemporaryDirectory(prefix="quartet-") as folder:
            path = Path(folder) / "passes.npz"
            request = {"options": dict(candidate.options), "names": list(names), "path": str(path)}
            try:
                self._process.stdin.write(json.dumps(request) + "\n")
                self._process.stdin.flush()
                answer = self._lines.get(timeout=_PATIENCE_S)
            except (OSError, queue.Empty) as error:
                raise RuntimeError(f"EEVEE did not answer ({type(error).__name__})") from error
            if "seconds" not in answer:
                raise RuntimeError(f"EEVEE: {answer['error']}")
            with np.load(path) as data:
                return {name: data[name] for name in data.files}, float(answer["seconds"])

    def _listen(self) -> None:
        for line in self._process.stdout:
            if line.startswith(_MARK):
                self._lines.put(json.loads(line[len(_MARK) :]))
        self._lines.put({"error": "the process ended"})


def _serve(arguments: dict) -> None:
    """The other process: a request a line in, an answer a line out."""
    from ..cli import _blender

    with _blender(Path(arguments["scene"]), None, None, tuple(arguments["size"]), arguments["frame"], ()) as scene:
        for line in sys.stdin:
            request = json.loads(line)
            try:
                candidate = Candidate("EEVEE", tuple(request["options"].items()))
                passes, seconds = render(scene, candidate, request["names"])
                np.savez(request["path"], **passes)
                answer = {"seconds": seconds}
            except Exception as error:
                answer = {"error": f"{type(error).__name__}: {error}"}
            print(_MARK + json.dumps(answer), flush=True)
    # Blender's own end waits for drivers that may not answer.
    os._exit(0)


def render(scene: bpy.types.Scene, candidate: Candidate, names: Sequence[str]) -> tuple[dict[str, np.ndarray], float]:
    """Render ``scene`` as the peer does; passes by name and the seconds of Blender's render call, kept data included.

    The picture is formed as the reference's (box filter of a pixel); everything else is the peer's default. Raises
    RuntimeError where this Blender can't run it.
    """
    options = dict(candidate.options)
    if candidate.method.startswith("Cycles"):
        _cycles(scene, int(options["samples"]), candidate.method.endswith("OIDN"))
    else:
        _eevee(scene, int(options["samples"]), bool(options["raytracing"]))
        # EEVEE's light passes are not split into direct and indirect light as Cycles' are.
        names = [n for n in names if n in ("Combined", "Emission", "Environment", "Ambient Occlusion")]
    scene.render.use_persistent_data = True
    start = time.perf_counter()
    passes = cycles.render_passes(scene, names)
    return passes, time.perf_counter() - start


def _cycles(scene: bpy.types.Scene, samples: int, denoise: bool) -> None:
    cycles.set_up(scene, cycles.Reference(_BOUNCES, samples, seed=7, unbiased=False, denoise=denoise))
    c = scene.cycles
    # The defaults that a reference render before this one has switched off.
    c.sample_clamp_direct, c.sample_clamp_indirect = 0.0, 10.0
    c.blur_glossy = 1.0
    c.light_sampling_threshold = 0.01
    c.use_light_tree = True
    c.pixel_filter_type, c.filter_width = "BOX", 1.0


def _eevee(scene: bpy.types.Scene, samples: int, raytracing: bool) -> None:
    if bpy.app.background:
        import gpu

        try:
            gpu.init()
        except (AttributeError, SystemError, RuntimeError) as error:
            raise RuntimeError(f"EEVEE needs OpenGL in Blender: {error}") from error
    for engine in ("BLENDER_EEVEE", "BLENDER_EEVEE_NEXT"):
        try:
            scene.render.engine = engine
            break
        except TypeError:
            continue
    else:
        raise RuntimeError("this Blender has no EEVEE")
    scene.eevee.taa_render_samples = samples
    if hasattr(scene.eevee, "use_raytracing"):
        scene.eevee.use_raytracing = raytracing
    # The narrowest film filter; the reference's is a box of one pixel.
    scene.render.filter_size = 1.0


if __name__ == "__main__":
    _serve(json.loads(sys.argv[1]))
