# SPDX-License-Identifier: GPL-3.0-or-later
"""EEVEE as a rival, in a Blender of its own: Blender's OpenGL context and Quartet's do not live well side by side
(EGL_BAD_MATCH, and then a hang), and the ``bpy`` wheel has none on machines without a screen where the program has.

This module is both ends: the caller's, and what the other Blender runs, which needs neither moderngl nor click.
"""

from __future__ import annotations

import hashlib
import json
import os
import queue
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ..compare.references import cache_folder
from . import cycles

if TYPE_CHECKING:
    from ..compare.sweeps import Candidate

# A software driver compiles EEVEE's shaders for minutes; longer than this it is not coming back.
_PATIENCE_S = 600.0
_MARK = "QUARTET-PEER "
_ROOT = str(Path(__file__).resolve().parents[2])
# EEVEE's light passes are not split into direct and indirect light as Cycles' are, and its occlusion is of another distance.
_PASSES = ("Combined", "Emission", "Environment")


def program(named: str | os.PathLike | None = None) -> str | None:
    """The Blender to run: ``named``, ``$QUARTET_BLENDER``, ``blender`` on the path; None for this Python's own.

    Raises RuntimeError where one is named that is not there.
    """
    chosen = named or os.environ.get("QUARTET_BLENDER")
    if not chosen:
        return shutil.which("blender")
    found = shutil.which(str(chosen))
    if found is None:
        raise RuntimeError(f"{chosen}: no such program")
    return str(Path(found).absolute())


class Eevee:
    """EEVEE with a copy of the open ``scene``, started on the first render; ``blender`` as from :func:`program`."""

    def __init__(self, scene: bpy.types.Scene, blender: str | None = None) -> None:
        self._scene, self._blender = scene.name, blender
        self._folder = tempfile.TemporaryDirectory(prefix="quartet-eevee-")
        self._process: subprocess.Popen | None = None
        self._lines: queue.SimpleQueue = queue.SimpleQueue()

    def __enter__(self) -> Eevee:
        return self

    def __exit__(self, *_) -> None:
        if self._process is not None:
            # It ends when there is nothing more to read; it is ended where its driver hangs.
            self._process.stdin.close()
            try:
                self._process.wait(timeout=5.0)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        self._folder.cleanup()

    @property
    def version(self) -> str:
        """What makes the pictures, as the program itself says."""
        if self._blender is None:
            return f"Blender {bpy.app.version_string} (bpy)"
        try:
            said = subprocess.run([self._blender, "--version"], capture_output=True, text=True, timeout=60.0).stdout
        except (OSError, subprocess.TimeoutExpired) as error:
            raise RuntimeError(f"{self._blender} does not run ({type(error).__name__})") from error
        return next((line.strip() for line in said.splitlines() if line.startswith("Blender")), "Blender")

    def render(self, candidate: Candidate, names: Sequence[str]) -> tuple[dict[str, np.ndarray], float]:
        """As ``peers.render``. Raises RuntimeError if the process fails or takes longer than ten minutes."""
        if self._process is None:
            self._start()
        path = Path(self._folder.name) / "passes.npz"
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

    def _start(self) -> None:
        folder = Path(self._folder.name)
        file = folder / "scene.blend"
        with cycles.quiet():
            bpy.ops.wm.save_as_mainfile(filepath=str(file), copy=True, relative_remap=True, compress=False)
        code = (
            f"import sys; sys.path.insert(0, {_ROOT!r}); from gi_addon.host import eevee; "
            f"eevee.serve({str(file)!r}, {self._scene!r})"
        )
        environment = dict(os.environ)
        if self._blender is None:
            command = [sys.executable, "-c", code]
        else:
            command = [self._blender, "-b", "--factory-startup", "--python-exit-code", "1", "--python-expr", code]
            # That program may have another Mesa: two of them in one shader cache end in a bus error now and then.
            kept = cache_folder() / "eevee" / hashlib.blake2b(self._blender.encode(), digest_size=6).hexdigest()
            kept.mkdir(parents=True, exist_ok=True)
            environment["MESA_SHADER_CACHE_DIR"] = str(kept)
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=environment
        )
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        for line in self._process.stdout:
            # Blender writes lines of its own, and not always whole ones.
            _, mark, answer = line.partition(_MARK)
            if mark:
                self._lines.put(json.loads(answer))
        self._lines.put({"error": "the process ended"})


# --- in the other process -----------------------------------------------------------------------------------------------


def serve(path: str, name: str, requests: Iterable[str] | None = None) -> None:
    """Answer a request a line on standard input with a line on standard output, for scene ``name`` of the file ``path``."""
    bpy.ops.wm.open_mainfile(filepath=path)
    for line in requests if requests is not None else sys.stdin:
        request = json.loads(line)
        try:
            passes, seconds = render(bpy.data.scenes[name], request["options"], request["names"])
            np.savez(request["path"], **passes)
            answer = {"seconds": seconds}
        except Exception as error:
            answer = {"error": f"{type(error).__name__}: {error}"}
        print(f"\n{_MARK}{json.dumps(answer)}", flush=True)
    if requests is None:
        # Blender's own end waits for drivers that may not answer.
        os._exit(0)


def render(scene: bpy.types.Scene, options: dict, names: Sequence[str]) -> tuple[dict[str, np.ndarray], float]:
    """EEVEE's passes of ``scene`` and the seconds of Blender's render call; options ``samples`` and ``raytracing``.

    Raises RuntimeError where this Blender can't run it.
    """
    _set_up(scene, int(options["samples"]), bool(options["raytracing"]))
    scene.render.use_persistent_data = True
    start = time.perf_counter()
    passes = cycles.render_passes(scene, [n for n in names if n in _PASSES])
    return passes, time.perf_counter() - start


def _set_up(scene: bpy.types.Scene, samples: int, raytracing: bool) -> None:
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
