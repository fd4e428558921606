# SPDX-License-Identifier: GPL-3.0-or-later
"""*Compare with Cycles*: another Blender renders this file with both engines while this one stays free.

The other process gets a copy of the file, renders Cycles twice (two halves of independent noise, see ``compare.metrics``)
and Quartet once, and leaves pictures, scores and a page in a folder. Here a timer watches it, shows the pictures in the Image
Editor and the numbers in the panel, and opens the page in the web browser.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import traceback
import webbrowser
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import bpy
import numpy as np

from .. import __version__
from ..compare import flip
from ..compare.comparison_page import Side, page
from ..compare.metrics import Score, score
from ..compare.references import BOUNCES, SEEDS, cache_folder
from ..compare.sheet import exposure
from ..gl import shared
from ..settings import Settings, walk
from . import cycles, properties, status

ROOT = __package__.rpartition(".")[0]
COMPARED = (
    "Combined", "Diffuse Direct", "Diffuse Indirect", "Glossy Direct", "Glossy Indirect", "Transmission Indirect",
    "Emission", "Environment", "Ambient Occlusion",
)  # fmt: skip
VIEWS = (
    ("SIDES", "Side by Side", "Quartet left, Cycles right, the whole picture each"),
    ("WIPE", "Wipe", "One picture: Quartet in its left half, Cycles in its right"),
    ("DIFFERENCE", "Difference × 4", "The absolute difference, four times brighter"),
    ("FLIP", "FLIP", "The difference that an eye sees when the two alternate, from 0 (black) to 1 (white)"),
)
IMAGE = "Quartet Comparison"
_TICK = 0.25
_BAR = 4  # width of the line between two halves, pixels
_PAGE = "page.html"


class ComparisonError(RuntimeError):
    """The comparison can't be made; the message says why."""


@dataclass
class Outcome:
    """A finished comparison: pictures (H, W, 3) by pass and ``test`` or ``reference``, (H, W) by pass and ``flip``, scores,
    and the ``page`` that shows them: its HTML in the process that compares, its file in the one that asked."""

    title: str
    scores: dict[str, Score]
    pictures: dict[tuple[str, str], np.ndarray]
    page: str | Path

    @staticmethod
    def load(folder: Path, kept: Path) -> Outcome:
        """Read what the other process has left, and keep its page as ``kept``."""
        document = json.loads((folder / "result.json").read_text())
        with np.load(folder / "pictures.npz", allow_pickle=False) as data:
            pictures = {tuple(key.split("|")): data[key] for key in data.files}
        kept.parent.mkdir(parents=True, exist_ok=True)
        shutil.move(folder / _PAGE, kept)
        return Outcome(document["title"], {n: Score(**values) for n, values in document["scores"].items()}, pictures, kept)

    def save(self, folder: Path) -> None:
        """Leave it for the other process; ``result.json`` comes last."""
        np.savez(folder / "pictures.npz", **{"|".join(key): value for key, value in self.pictures.items()})
        (folder / _PAGE).write_text(self.page, encoding="utf-8")
        scores = {name: asdict(s) for name, s in self.scores.items()}
        (folder / "result.json").write_text(json.dumps({"title": self.title, "scores": scores}))

    def view(self, name: str, kind: str) -> np.ndarray:
        """A picture (H, W, 3) for people, at the reference's exposure: ``kind`` is one of VIEWS."""
        test, reference = self.pictures[name, "test"], self.pictures[name, "reference"]
        if kind == "FLIP":
            return np.repeat(self.pictures[name, "flip"][..., None], 3, axis=-1)
        scale = np.float32(exposure(reference))
        if kind == "DIFFERENCE":
            return 4.0 * scale * np.abs(test - reference)
        if kind == "SIDES":
            bar = np.ones((test.shape[0], _BAR, 3), np.float32)
            return np.concatenate([scale * test, bar, scale * reference], axis=1)
        middle = test.shape[1] // 2
        out = scale * np.concatenate([test[:, :middle], reference[:, middle:]], axis=1)
        out[:, middle - 1 : middle + 1] = 1.0
        return out


@dataclass
class Running:
    """A comparison under way."""

    process: subprocess.Popen
    folder: Path
    name: str
    share: float = 0.0
    text: str = "Starting Blender"

    def look(self) -> None:
        """Read how far it is."""
        with contextlib.suppress(OSError, ValueError):
            self.share, self.text = json.loads((self.folder / "progress.json").read_text())

    def stop(self) -> None:
        """End the process, if it has not ended, and remove its folder."""
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)


running: Running | None = None
latest: Outcome | None = None


# --- the other process ------------------------------------------------------------------------------------------------


def start(scene: bpy.types.Scene, reference: str, samples: int, percentage: int) -> Running:
    """Start the comparison of the current file as it is now. Raises ComparisonError."""
    if scene.camera is None:
        raise ComparisonError("the scene has no camera: add one, or make one active (Ctrl+Numpad 0)")
    folder = Path(tempfile.mkdtemp(prefix="quartet-compare-"))
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "scene.blend"), copy=True, compress=False)
    job = {"scene": scene.name, "reference": reference, "samples": samples, "percentage": percentage}
    (folder / "job.json").write_text(json.dumps(job))
    call = (
        f"import sys; sys.path[:] = {sys.path!r}; import importlib; "
        f"importlib.import_module({__name__!r}).work({str(folder)!r})"
    )
    if bpy.app.binary_path:
        command = [bpy.app.binary_path, "-b", "--python-exit-code", "1"]
        # Without the user's preferences the other Blender would not know extensions; a checkout needs none.
        command += [] if "." in ROOT else ["--factory-startup"]
        command += [str(folder / "scene.blend"), "--python-expr", call]
    else:  # Blender as a Python module
        opening = f"import bpy; bpy.ops.wm.open_mainfile(filepath={str(folder / 'scene.blend')!r}); "
        command = [sys.executable, "-c", opening + call]
    with open(folder / "output.txt", "wb") as output:
        process = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL)
    name = Path(bpy.data.filepath).stem or "untitled"
    return Running(process, folder, f"{name} {scene.quartet.technique} {time.strftime('%Y-%m-%d %H.%M.%S')}")


def reports_folder() -> Path:
    """Where the pages of comparisons are kept."""
    return cache_folder() / "reports"


def work(folder: str) -> None:
    """In the other process: render, score, save."""
    path = Path(folder)
    try:
        if not hasattr(bpy.types.Scene, "quartet"):
            importlib.import_module(ROOT).register()
        _compare(path, **json.loads((path / "job.json").read_text())).save(path)
    except BaseException as error:
        traceback.print_exc()
        (path / "error.txt").write_text(str(error) or type(error).__name__)
    # Nothing here is worth an orderly end, and Blender 4.5 knows none with an engine registered.
    sys.stdout.flush()
    os._exit(0)


def _compare(folder: Path, scene: str, reference: str, samples: int, percentage: int) -> Outcome:
    bscene = bpy.data.scenes[scene]
    for window in bpy.context.window_manager.windows:
        window.scene = bscene
    render = bscene.render
    # Of a region only what is in it: black around it would thin every error out.
    render.use_crop_to_border = True
    render.resolution_percentage = max(1, render.resolution_percentage * percentage // 100)
    settings = properties.read(bscene)
    halves: list[dict[str, np.ndarray]] = []
    seconds: dict[str, float] = {}
    stages = len(SEEDS) + 1

    def tell(stage: int, share: float, text: str) -> None:
        part = folder / "progress.part"
        part.write_text(json.dumps([(stage + share) / stages, text]))
        part.replace(folder / "progress.json")

    def stats(*values) -> None:
        found = re.search(r"Sample (\d+)/(\d+)", " ".join(str(v) for v in values))
        if found:
            done, total = map(int, found.groups())
            tell(len(halves), done / total, f"Cycles {len(halves) + 1} of 2, sample {done} of {total}")

    def timed(engine: str) -> dict[str, np.ndarray]:
        start = time.perf_counter()
        passes = cycles.render_passes(bscene, COMPARED)
        seconds[engine] = time.perf_counter() - start
        return passes

    bpy.app.handlers.render_stats.append(stats)
    for seed in SEEDS.values():
        tell(len(halves), 0.0, f"Cycles, {len(halves) + 1} of 2")
        cycles.set_up(bscene, cycles.Reference(BOUNCES[reference], samples, seed))
        halves.append(timed(f"Cycles ({samples} samples)"))
    bpy.app.handlers.render_stats.remove(stats)
    tell(2, 0.0, "Quartet")
    render.engine = "QUARTET"
    bpy.context.window_manager.quartet.measure = True
    test = timed("Quartet")
    if status.problem():
        raise ComparisonError(f"Quartet rendered nothing: {status.problem()}")
    tell(2, 0.5, "Scores")
    height, width = test["Combined"].shape[:2]
    label = "R∞ (32 bounces)" if reference == "Rinf" else "R1 (one bounce)"
    title = f"{settings.technique}, {settings.samples} sub-frames, against {label}, 2 × {samples} samples, {width} × {height}"
    scores, pictures = _judge(test, *halves)
    text = page(title, settings.technique, scores, pictures, _side(settings, seconds))
    return Outcome(title, scores, pictures, text)


def _judge(test, a, b) -> tuple[dict[str, Score], dict[tuple[str, str], np.ndarray]]:
    """Scores and pictures of every pass that all three renders have and that is not black in all."""
    scores, pictures = {}, {}
    for name in COMPARED:
        if not all(name in passes for passes in (test, a, b)):
            continue
        t, half_a, half_b = (np.ascontiguousarray(p[name][..., :3], np.float32) for p in (test, a, b))
        if half_a.max() <= 0.0 and t.max() <= 0.0:
            continue
        mean = (half_a + half_b) / 2.0
        errors = flip.hdr_flip_map(t, mean).astype(np.float32)
        values = asdict(score(t, half_a, half_b))
        values.update(flip=float(errors.mean()), flip_p95=float(np.percentile(errors, 95)))
        scores[name] = Score(**values)
        pictures[name, "test"], pictures[name, "reference"], pictures[name, "flip"] = t, mean, errors
    return scores, pictures


def _side(settings: Settings, seconds: dict[str, float]) -> Side:
    """What the page says of the frame that Quartet has just rendered."""
    made = (
        f"Quartet {__version__} in Blender {bpy.app.version_string}, {shared().driver}, {time.strftime('%Y-%m-%d %H:%M')}; "
        f"references from unbiased Cycles on the processor."
    )
    changed = [
        (path, f"{settings.get(path)}", f"{default}")
        for path, default, _ in walk()
        # Blender stores single precision.
        if settings.get(path) != (float(np.float32(default)) if isinstance(default, float) else default)
    ]
    report = status.latest["final"]
    passes = [(row.title, row.milliseconds, row.mib) for row in report.rows]
    return Side(made, seconds, passes, report.skipped, changed, report.notes, report.approximated)


# --- this process -----------------------------------------------------------------------------------------------------


class QUARTET_OT_compare(bpy.types.Operator):
    """Render this frame with Quartet and with Cycles in the background, and show pictures and numbers side by side. With a
    render region only that is compared"""

    bl_idname = "quartet.compare"
    bl_label = "Compare with Cycles"

    @classmethod
    def poll(cls, context):
        if running is not None:
            cls.poll_message_set("A comparison is under way")
            return False
        return context.engine == "QUARTET"

    def execute(self, context):
        """Wait for the outcome: scripts and ``blender -b``."""
        if not self._start(context):
            return {"CANCELLED"}
        running.process.wait()
        return self._finish(context)

    def invoke(self, context, event):
        if not self._start(context):
            return {"CANCELLED"}
        window = context.window_manager
        window.quartet.cancel_compare = False
        self._timer = window.event_timer_add(_TICK, window=context.window)
        window.progress_begin(0.0, 1.0)
        window.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        window = context.window_manager
        if running is None or window.quartet.cancel_compare or event.type == "ESC":
            self._end(context)
            stop()
            self.report({"INFO"}, "Comparison cancelled")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        running.look()
        window.progress_update(running.share)
        context.workspace.status_text_set(f"Compare with Cycles: {running.text}, Esc cancels")
        _redraw(context)
        if running.process.poll() is None:
            return {"PASS_THROUGH"}
        self._end(context)
        outcome = self._finish(context)
        if outcome == {"FINISHED"}:
            _image_editor(context)
            if window.quartet.open_page:
                _browse(latest.page, self.report)
        return outcome

    def _start(self, context) -> bool:
        global running
        window = context.window_manager.quartet
        try:
            running = start(context.scene, window.reference, window.reference_samples, window.compare_percentage)
        except (ComparisonError, OSError, RuntimeError) as error:
            self.report({"ERROR"}, f"Quartet: {error}")
            return False
        return True

    def _finish(self, context):
        global latest
        try:
            latest = collect(running)
        except ComparisonError as error:
            status.log(str(error))
            self.report({"ERROR"}, f"Quartet: {error}")
            return {"CANCELLED"}
        finally:
            stop()
        show(context.window_manager.quartet)
        combined = latest.scores.get("Combined")
        if combined is not None:
            self.report({"INFO"}, f"Combined: {combined.text()}")
        return {"FINISHED"}

    def _end(self, context) -> None:
        window = context.window_manager
        window.event_timer_remove(self._timer)
        window.progress_end()
        context.workspace.status_text_set(None)
        _redraw(context)


class QUARTET_OT_open_page(bpy.types.Operator):
    """Open the page of the last comparison in the web browser: pictures to wipe, every error figure, times, settings"""

    bl_idname = "quartet.open_page"
    bl_label = "Open Comparison Page"

    @classmethod
    def poll(cls, context):
        if latest is None:
            cls.poll_message_set("Compare with Cycles first")
        return latest is not None

    def execute(self, context):
        return {"FINISHED"} if _browse(latest.page, self.report) else {"CANCELLED"}


def _browse(path: Path, report: Callable[[set[str], str], None]) -> bool:
    """Show a page in the web browser; where there is none, say where the page lies."""
    if path.is_file() and webbrowser.open(path.as_uri()):
        return True
    report({"WARNING"}, f"No web browser answered. The page is {path}" if path.is_file() else f"{path} is no longer there")
    return False


def collect(job: Running) -> Outcome:
    """The outcome of a job whose process has ended. Raises ComparisonError with its own last words."""
    folder = job.folder
    if (folder / "result.json").is_file():
        return Outcome.load(folder, reports_folder() / f"{job.name}.html")
    why = folder / "error.txt"
    if why.is_file():
        raise ComparisonError(f"the comparison failed: {why.read_text()}")
    output = folder / "output.txt"
    last = output.read_text(errors="replace").strip().splitlines()[-3:] if output.is_file() else []
    raise ComparisonError(f"the other Blender ended with {job.process.returncode}: {' | '.join(last)}")


def stop() -> None:
    """End a comparison under way."""
    global running
    job, running = running, None
    if job is not None:
        job.stop()


def show(window) -> bpy.types.Image | None:
    """Put the chosen pass and view of the last outcome into the image *Quartet Comparison*."""
    if latest is None or not latest.scores:
        return None
    name = window.compare_pass if window.compare_pass in latest.scores else next(iter(latest.scores))
    picture = latest.view(name, window.compare_view)
    height, width = picture.shape[:2]
    image = bpy.data.images.get(IMAGE)
    if image is not None and tuple(image.size) != (width, height):
        image.scale(width, height)
    if image is None:
        image = bpy.data.images.new(IMAGE, width, height, alpha=False, float_buffer=True, is_data=False)
        # The pictures are scene-linear; the window's own display transform does the rest.
        image.colorspace_settings.name = "Linear Rec.709"
    image.use_view_as_render = False
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., :3] = picture
    image.pixels.foreach_set(pixels.reshape(-1))
    image.update()
    return image


def passes(_self=None, _context=None) -> list[tuple[str, str, str]]:
    """Passes of the last outcome, as enum items."""
    _items[:] = [(n, n, s.text()) for n, s in latest.scores.items()] if latest else [("Combined", "Combined", "")]
    return _items


# Blender keeps no reference to the strings of dynamic enums.
_items: list[tuple[str, str, str]] = []


def _image_editor(context) -> None:
    """Show the image in an open Image Editor, or in a window of its own."""
    image = bpy.data.images.get(IMAGE)
    if image is None:
        return
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "IMAGE_EDITOR":
                _fit(window, area, image)
                return
    before = set(context.window_manager.windows)
    bpy.ops.wm.window_new()
    for window in context.window_manager.windows:
        if window not in before:
            area = max(window.screen.areas, key=lambda a: a.width * a.height)
            area.type = "IMAGE_EDITOR"
            _fit(window, area, image)


def _fit(window, area, image) -> None:
    """Show ``image`` in an Image Editor, as large as fits."""
    area.spaces.active.image = image
    region = next(r for r in area.regions if r.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region), contextlib.suppress(RuntimeError):
        bpy.ops.image.view_all(fit_view=True)


def _redraw(context) -> None:
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "PROPERTIES":
                area.tag_redraw()


_CLASSES = (QUARTET_OT_compare, QUARTET_OT_open_page)


def register() -> None:
    for cls in _CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    global latest
    stop()
    latest = None
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
