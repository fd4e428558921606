# SPDX-License-Identifier: GPL-3.0-or-later
"""Table 2: how long a frame takes, for every row of the paper.

As there, only indirect diffuse light, shadows and ambient occlusion are on, and the scene has its sun alone. Two kinds of
frame are timed: *moving* (the sun turns by a hair every frame, so whatever depends on light is made anew; the paper's
kind) and *still* (all that can be kept is kept). Rows are interleaved A B … B A, so that a machine that slows down slows
all of them; medians and ratios of one run are what to look at.
"""

from __future__ import annotations

import csv
import hashlib
import json
import time
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import numpy as np

from .. import __version__
from ..gl import GL, GLError, driver, shared
from ..gl.context import MIB
from ..renderer import Renderer
from ..scene import Scene, World
from ..settings import SettingError, Settings
from .page import dump
from .paper import GTX_1070, TABLE_2, Row
from .source import source_version

_TOLERANCE = 0.03  # the protocol's upper bound for the calibration kernel's variation


@dataclass
class Calibration:
    """This machine's arithmetic (GFLOP/s) and bandwidth (GB/s) as a fixed kernel sees them, its time in ms, how much it
    still varied after warming up (coefficient of variation), and how often it ran."""

    milliseconds: float
    variation: float
    runs: int
    gflops: float
    gbytes: float

    @property
    def settled(self) -> bool:
        return self.variation <= _TOLERANCE

    @property
    def ratio(self) -> float:
        """This machine over the paper's GTX 1070: the geometric mean of the two."""
        return float(np.sqrt(self.gflops / GTX_1070["gflops"] * self.gbytes / GTX_1070["gbytes"]))


def calibrate(gl: GL, *, invocations: int = 1 << 16, most: int = 40) -> Calibration:
    """Run the fixed kernel until its last five times vary by less than 3 %, ``most`` times at the most."""
    stride = invocations
    data = np.random.default_rng(0).random((4 * stride, 4), np.float32)
    source, target = gl.buffer("calibration source", data), gl.buffer("calibration target", size=data.nbytes)
    programs = {
        name: gl.program("Calibration", {"compute": "compare/calibrate_comp.glsl"}, defines={"ARITHMETIC": flag})
        for name, flag in (("arithmetic", 1), ("bandwidth", 0))
    }

    def run(name: str, count: int = 1) -> float:
        source.bind_to_storage_buffer(0)
        target.bind_to_storage_buffer(1)
        program = programs[name]
        if "stride" in program:
            program["stride"].value = stride
        gl.ctx.finish()
        start = time.perf_counter()
        for _ in range(count):
            program.run(invocations // 64)
            gl.ctx.memory_barrier()
        gl.ctx.finish()
        return (time.perf_counter() - start) / count

    try:
        times: list[float] = []
        variation = float("inf")
        count = max(1, min(1000, int(0.005 / max(run("arithmetic"), 1e-7))))
        while len(times) < 5 or (variation > _TOLERANCE and len(times) < most):
            times.append(run("arithmetic", count))
            last = times[-5:]
            variation = float(np.std(last) / np.mean(last))
        moved = min(run("bandwidth", count) for _ in range(5))
        seconds = float(np.median(times[-5:]))
        flops = invocations * 512 * 4 * 4 * 2
        return Calibration(seconds * 1e3, variation, len(times), flops / seconds * 1e-9, 2.0 * data.nbytes / moved * 1e-9)
    finally:
        gl.release(source, target)


def frames_asked(gl: GL) -> int:
    """Frames of a kind that a median is taken of: the protocol's 50 on a GPU, 5 on a software driver."""
    return 5 if gl.software else 50


@dataclass
class Timing:
    """One row, measured: milliseconds of every moving and still frame, per pass (median), bytes; ``problem`` instead of
    numbers where it could not run; ``first`` the ms of its first frame, which builds and compiles."""

    row: Row
    size: tuple[int, int]
    moving: list[float] = field(default_factory=list)
    still: list[float] = field(default_factory=list)
    passes: dict[str, float] = field(default_factory=dict)
    planned_mib: float = 0.0
    held_mib: float = 0.0
    first: float = 0.0
    visits: int = 0
    problem: str = ""

    def summary(self) -> dict[str, float | None]:
        """Median, MAD and P95 of moving frames; the same median of still ones; frames a second."""
        if not self.moving:
            return {}
        median = float(np.median(self.moving))
        return {
            "ms": median,
            "mad": float(np.median(np.abs(np.array(self.moving) - median))),
            "p95": float(np.percentile(self.moving, 95)),
            "worst": max(self.moving),
            "mean": float(np.mean(self.moving)),
            "still_ms": float(np.median(self.still)),
            "fps": 1e3 / median,
            "still_fps": 1e3 / float(np.median(self.still)),
            "frames": len(self.moving),
            "still_frames": len(self.still),
        }

    def save(self, path: Path) -> None:
        """Keep what was measured, whole or not at all."""
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_suffix(".part")
        part.write_text(dump({k: v for k, v in vars(self).items() if k not in ("row", "size")}))
        part.replace(path)

    @staticmethod
    def load(path: Path, row: Row, size: tuple[int, int]) -> Timing:
        """What was kept, or nothing measured yet where there is none or it is damaged."""
        try:
            return Timing(row, size, **json.loads(path.read_text()))
        except (OSError, ValueError, TypeError):
            return Timing(row, size)


def bench_settings(row: Row) -> Settings:
    """The row's settings with everything off that the paper's table leaves out. Raises SettingError for a technique or
    setting that this version lacks."""
    settings = Settings()
    settings.set("technique", row.technique)
    for name, value in (("samples", 1), ("use_glossy", False), ("use_translucency", False), ("use_volumetric", False)):
        settings.set(name, value)
    for name, value in row.settings:
        settings.set(name, value)
    return settings


def bench_scene(scene: Scene) -> Scene:
    """The scene with its suns only, or its strongest light where it has none, and a black world."""
    suns = [light for light in scene.lights if light.kind == "SUN"]
    lights = suns or sorted(scene.lights, key=lambda light: -float(np.max(light.emission)))[:1]
    return replace(scene, lights=lights, world=World())


def nudged(scene: Scene, step: int) -> Scene:
    """The scene with its lights turned by ``step`` microradians: another light to every cache, the same to the eye."""
    angle = 1e-6 * step
    turn = np.eye(4)
    turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return replace(scene, lights=[replace(light, matrix=light.matrix @ turn) for light in scene.lights])


def bench(
    scene: Scene,
    *,
    techniques: Iterable[str],
    scale: float = 1.0,
    frames: int | None = None,
    rows: Iterable[Row] | None = None,
    limit_s: float = float("inf"),
    budget_s: float = float("inf"),
    cache: Path | None = None,
    progress: Callable[[str], None] = lambda text: None,
) -> tuple[Calibration, list[Timing]]:
    """Time every row of the paper's table for ``techniques`` at ``scale`` times its picture size.

    ``frames`` of each kind per row (default 50 on a GPU, 5 on a software driver), half of them on the way there and half
    on the way back; fewer, one at least, where they don't fit into ``budget_s`` seconds a row and way. A row whose first
    frame takes longer than ``limit_s`` is left out, with that as its problem. With ``cache`` each visit is kept there as it
    ends, by scene, settings, size, driver and version, and an interrupted bench goes on.
    """
    techniques = list(techniques)
    chosen = [r for r in (rows or TABLE_2) if r.technique in techniques]
    plain = bench_scene(scene)
    key, version = (plain.digest(), source_version()) if cache else ("", "")

    def job(gl: GL) -> tuple[Calibration, list[Timing]]:
        count = frames or frames_asked(gl)
        calibration = calibrate(gl)
        kept: dict[str, Path] = {}
        timings = []
        for r in chosen:
            size = (max(1, round(r.resolution[0] * scale)), max(1, round(r.resolution[1] * scale)))
            named = (key, r.key, r.settings, size, count, budget_s, driver(), version)
            if cache:
                kept[r.key] = cache / f"{hashlib.blake2b(repr(named).encode(), digest_size=16).hexdigest()}.json"
            timings.append(Timing.load(kept[r.key], r, size) if cache else Timing(r, size))
        renderer = Renderer(gl)
        steps = iter(range(1, 1 << 30))

        def frame(settings: Settings, size: tuple[int, int], moving: bool, step: int) -> float:
            target = nudged(plain, step) if moving else plain
            gl.ctx.finish()
            start = time.perf_counter()
            renderer.begin(target, settings, ("Combined",), resolution=size, subframes=1)
            renderer.subframe(0)
            gl.ctx.finish()
            return (time.perf_counter() - start) * 1e3

        def frames_of(n: int, settings: Settings, size: tuple[int, int], moving: bool) -> list[float]:
            """A frame to settle, then up to ``n``, as many as fit into half the budget."""
            end = time.perf_counter() + budget_s / 2.0
            last = frame(settings, size, moving, next(steps) if moving else 0)
            out: list[float] = []
            while len(out) < n and (not out or time.perf_counter() + last * 1e-3 < end):
                last = frame(settings, size, moving, next(steps) if moving else 0)
                out.append(last)
            return out

        def visit(timing: Timing, n: int, measure_passes: bool) -> None:
            settings = bench_settings(timing.row)
            renderer.timers.enabled = False
            timing.first = max(timing.first, frame(settings, timing.size, True, next(steps)))
            if over(timing):
                return
            timing.moving += frames_of(n, settings, timing.size, True)
            timing.still += frames_of(n, settings, timing.size, False)
            if measure_passes:
                renderer.timers.enabled = True
                renderer.timers.reset()
                frames_of(n, settings, timing.size, True)
                timing.passes = {k: float(np.median(v)) for k, v in renderer.timers.collect().items()}
                timing.planned_mib = renderer._plan.nbytes() / MIB
                timing.held_mib = gl.bytes() / MIB

        def over(timing: Timing) -> bool:
            if timing.first > limit_s * 1e3 and not timing.moving:
                timing.problem = f"its first frame took {timing.first / 1e3:.0f} s, over the limit of {limit_s:g} s"
            return bool(timing.problem)

        try:
            there = [(t, -(-count // 2), 1) for t in timings]
            back = [(t, count // 2, 2) for t in reversed(timings)]
            for timing, n, number in there + back:
                if timing.visits >= number or not n or over(timing):
                    continue
                progress(f"{timing.row.key} ({'there' if number == 1 else 'back'})")
                try:
                    visit(timing, n, number == 1)
                    timing.visits = number if not timing.problem else 0
                except (GLError, SettingError) as error:
                    timing.problem = str(error)
                if cache:
                    # A limit may be another next time, and a failure may be mended: neither is kept, the first frame is.
                    replace(timing, problem="").save(kept[timing.row.key])
        finally:
            renderer.timers.enabled = False
            renderer.close()
        return calibration, timings

    return shared().call(job)


def records(calibration: Calibration, timings: list[Timing]) -> list[dict]:
    """One flat record per row, with the paper's rate and ours over it, raw and per hardware."""
    out = []
    for t in timings:
        s = t.summary()
        fps = s.get("fps")
        out.append(
            {
                "technique": t.row.technique,
                "setting": t.row.label,
                "paper_resolution": "{}x{}".format(*t.row.resolution),
                "resolution": "{}x{}".format(*t.size),
                "paper_fps": t.row.fps,
                "paper_doubtful": t.row.doubtful,
                **s,
                "ratio": fps / t.row.fps if fps and t.row.fps else None,
                "ratio_per_hardware": fps / t.row.fps / calibration.ratio if fps and t.row.fps else None,
                "planned_mib": t.planned_mib,
                "held_mib": t.held_mib,
                "passes": t.passes,
                "problem": t.problem,
            }
        )
    return out


def write(folder: Path, scene_name: str, scale: float, calibration: Calibration, timings: list[Timing]) -> list[Path]:
    """bench.json, bench.csv and bench.html."""
    from .page import document, esc, table

    folder.mkdir(parents=True, exist_ok=True)
    rows = records(calibration, timings)
    files = [folder / name for name in ("bench.json", "bench.csv", "bench.html")]
    head = {
        "version": __version__,
        "driver": driver(),
        "scene": scene_name,
        "scale": scale,
        "calibration": {**asdict(calibration), "settled": calibration.settled, "hardware_ratio": calibration.ratio},
        "gtx_1070": GTX_1070,
    }
    files[0].write_text(
        dump({**head, "rows": rows, "frames": {t.row.key: {"moving": t.moving, "still": t.still} for t in timings}})
    )
    columns = [k for k in max(rows, key=len) if k != "passes"] if rows else []
    with files[1].open("w", newline="") as stream:
        writer = csv.DictWriter(stream, columns, extrasaction="ignore")
        writer.writeheader()
        writer.writerows(rows)
    body = [
        "<h1>Table 2: frame rates</h1>",
        f"<p class=lead>{esc(scene_name)}, picture × {scale:g}; Quartet {__version__} on {esc(head['driver'])}.</p>",
        f"<p>{esc(hardware_text(calibration))}</p>",
        "<p class=quiet>Moving: the sun turns a hair every frame, so everything that depends on light is made anew (the paper's "
        "case). Still: what can be kept is kept. ms are medians of interleaved frames (A B … B A), ± the median absolute "
        "deviation, of as many frames as the table says. A ratio at another picture size than the paper's is "
        "no statement about speed; ratios between rows are.</p>",
        table(
            [
                "technique",
                "setting",
                "paper at",
                "paper fps",
                "here at",
                "fps moving",
                "ms moving",
                "± MAD",
                "P95",
                "frames",
                "ms still",
                "× paper",
                "× paper per hardware",
                "MiB planned",
                "MiB held",
                "costliest passes, ms",
            ],
            [
                [
                    r["technique"],
                    r["setting"],
                    r["paper_resolution"],
                    "–" if r["paper_fps"] is None else f"{r['paper_fps']:g}{'?' if r['paper_doubtful'] else ''}",
                    r["resolution"],
                    *(
                        [
                            r.get(k)
                            for k in (
                                "fps",
                                "ms",
                                "mad",
                                "p95",
                                "frames",
                                "still_ms",
                                "ratio",
                                "ratio_per_hardware",
                                "planned_mib",
                                "held_mib",
                            )
                        ]
                        if r.get("ms")
                        else [r["problem"] or "–", *[""] * 9]
                    ),
                    ", ".join(f"{k} {v:.2f}" for k, v in sorted(r["passes"].items(), key=lambda i: -i[1])[:4]),
                ]
                for r in rows
            ],
        ),
    ]
    files[2].write_text(document("Quartet Table 2", "".join("–" if b is None else b for b in body), charts=False))
    return files


def hardware_text(c: Calibration) -> str:
    """The calibration in a sentence."""
    state = f"varied by {100 * c.variation:.1f} %" + (
        "" if c.settled else f" still after {c.runs} runs: times are unsettled, trust ratios only"
    )
    return (
        f"Calibration kernel {c.milliseconds:.2f} ms ({c.gflops:.1f} GFLOP/s, {c.gbytes:.1f} GB/s), {state}. "
        f"This machine is {c.ratio:.3g} × the paper's GTX 1070 ({GTX_1070['gflops']:.0f} GFLOP/s, {GTX_1070['gbytes']:.0f} GB/s)."
    )
