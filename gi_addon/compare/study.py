# SPDX-License-Identifier: GPL-3.0-or-later
"""A comparison: every candidate rendered, timed and scored, kept on disk so that an interrupted sweep goes on.

A result is named by scene content, picture size, settings, driver and version (with a fingerprint of the sources), so a
change of any of them measures anew, and nothing else does.
"""

from __future__ import annotations

import csv
import hashlib
import json
import zipfile
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np

from .. import __version__
from ..gl.context import MIB
from ..scene import Scene
from ..settings import Settings
from .bench import nudged
from .metrics import error_map, score
from .page import dump, finite
from .references import Halves
from .studio import Studio
from .sweeps import Candidate

# What is compared, in the order of the report.
COMPARED = (
    "Combined",
    "Diffuse Direct",
    "Diffuse Indirect",
    "Glossy Direct",
    "Glossy Indirect",
    "Emission",
    "Environment",
    "Ambient Occlusion",
)
_TILE = 8


@cache
def source_version() -> str:
    """The version with a fingerprint of everything that makes pictures."""
    root = Path(__file__).resolve().parent.parent
    h = hashlib.blake2b(digest_size=6)
    for path in sorted([*root.rglob("*.py"), *root.rglob("*.glsl")]):
        if "compare" not in path.relative_to(root).parts and not path.name.startswith("cli"):
            h.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    return f"{__version__}+{h.hexdigest()}"


@dataclass
class Run:
    """A candidate on one scene: its pictures, and milliseconds of whole frames in both visits. ``moving`` is a frame in
    which the lights changed; ``per_pass`` ms of one whole picture by pass; ``mib`` of the plan."""

    candidate: Candidate
    passes: dict[str, np.ndarray]
    times: list[float] = field(default_factory=list)
    moving: float | None = None
    per_pass: dict[str, float] = field(default_factory=dict)
    mib: float | None = None
    visits: int = 0

    @property
    def ms(self) -> float:
        return float(np.median(self.times))

    @property
    def mad(self) -> float:
        return float(np.median(np.abs(np.array(self.times) - self.ms)))


def run_key(
    scene_key: str, size: tuple[int, int], candidate: Candidate, settings: Settings | None, driver: str, version: str
) -> str:
    """The file name of a result."""
    chosen = sorted(settings.as_dict().items()) if settings is not None else None
    text = repr((scene_key, tuple(size), candidate.method, candidate.options, chosen, driver, version))
    return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()


def save_run(path: Path, run: Run) -> None:
    """Write a run, whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    meta = {"times": run.times, "moving": run.moving, "per_pass": run.per_pass, "mib": run.mib, "visits": run.visits}
    arrays = {f"pass:{k}": v for k, v in run.passes.items()}
    part = path.with_suffix(".part.npz")
    np.savez_compressed(part, meta=np.frombuffer(json.dumps(meta).encode(), np.uint8), **arrays)
    part.replace(path)


def load_run(path: Path, candidate: Candidate) -> Run | None:
    """Read a run; None where there is none or it is damaged."""
    try:
        with np.load(path, allow_pickle=False) as data:
            meta = json.loads(bytes(data["meta"]).decode())
            passes = {k[5:]: data[k] for k in data.files if k.startswith("pass:")}
            return Run(candidate, passes, **meta)
    except (OSError, ValueError, KeyError, TypeError, zipfile.BadZipFile, EOFError):
        return None


# A peer's renderer: options and pass names in, (passes, seconds) out.
PeerRender = Callable[[Candidate, Sequence[str]], tuple[dict[str, np.ndarray], float]]


def visit(studio: Studio, scene: Scene, run: Run, base: Settings, size: tuple[int, int], repeats: int) -> None:
    """Render a technique's candidate once for its pictures and ``repeats`` times for its time."""
    settings = run.candidate.settings(base)
    if not run.passes:
        result = studio.render(scene, settings, COMPARED, size)
        run.passes = {n: p[..., :3].astype(np.float32) for n, p in result.passes.items()}
    first = studio.render(scene, settings, ("Combined",), size)
    run.mib = first.plan.nbytes() / MIB
    run.times += [studio.render(scene, settings, ("Combined",), size).seconds * 1e3 for _ in range(repeats)]
    if not run.per_pass:
        timed = studio.render(scene, settings, ("Combined",), size, timed=True)
        run.per_pass = {k: float(np.sum(v)) for k, v in timed.milliseconds.items()}
        run.moving = studio.render(nudged(scene, 1), settings, ("Combined",), size).seconds * 1e3


def measure(
    scene: Scene,
    scene_key: str,
    size: tuple[int, int],
    candidates: Sequence[Candidate],
    *,
    base: Settings,
    driver: str,
    cache: Path,
    peer: PeerRender | None = None,
    peer_version: str = "",
    repeats: int = 2,
    visits: int = 2,
    progress: Callable[[str], None] = lambda text: None,
) -> list[Run]:
    """Every candidate, from the cache where it is whole. They are visited there and back (A B … B A), or only there
    with ``visits`` 1; each visit is saved as it ends. A candidate that fails is left out, and said."""
    runs: dict[Candidate, tuple[Path, Run]] = {}
    for candidate in candidates:
        settings = None if candidate.peer else candidate.settings(base)
        version = peer_version if candidate.peer else source_version()
        path = cache / f"{run_key(scene_key, size, candidate, settings, driver, version)}.npz"
        runs[candidate] = (path, load_run(path, candidate) or Run(candidate, {}))
    with Studio() as studio:
        for number, order in ((1, list(runs)), (2, list(reversed(runs))))[:visits]:
            for candidate in order:
                if candidate not in runs:
                    continue
                path, run = runs[candidate]
                if run.visits >= number:
                    continue
                progress(f"{candidate.method}: {candidate.label} ({'there' if number == 1 else 'back'})")
                try:
                    if candidate.peer:
                        if peer is None:
                            raise RuntimeError("this scene is not open in Blender")
                        passes, _ = peer(candidate, COMPARED)  # the first one loads, builds and compiles
                        run.passes = run.passes or {n: np.ascontiguousarray(p[..., :3]) for n, p in passes.items()}
                        run.times += [peer(candidate, COMPARED)[1] * 1e3 for _ in range(max(1, repeats // 2))]
                    else:
                        visit(studio, scene, run, base, size, repeats)
                except RuntimeError as error:
                    progress(f"  left out: {error}")
                    del runs[candidate]
                    continue
                run.visits = number
                save_run(path, run)
    return [run for _, run in runs.values()]


# --- scores -------------------------------------------------------------------------------------------------------------


def interval(test: np.ndarray, a: np.ndarray, b: np.ndarray, *, rounds: int = 400, seed: int = 1) -> tuple[float, float]:
    """95 % bootstrap interval of the debiased relMSE, over tiles of 8 × 8 pixels: neighbours are not independent."""
    errors = error_map(test, a, b).mean(axis=-1)
    height, width = errors.shape
    rows = [errors[y : y + _TILE, x : x + _TILE] for y in range(0, height, _TILE) for x in range(0, width, _TILE)]
    sums, counts = np.array([r.sum() for r in rows]), np.array([r.size for r in rows])
    draw = np.random.default_rng(seed).integers(0, len(rows), (rounds, len(rows)))
    means = sums[draw].sum(axis=1) / counts[draw].sum(axis=1)
    low, high = np.percentile(means, [2.5, 97.5])
    return float(low), float(high)


def score_run(run: Run, references: dict[str, Halves], passes: Iterable[str] = COMPARED) -> dict[str, dict[str, dict]]:
    """pass -> reference -> figures, for passes that either side has light in."""
    out: dict[str, dict[str, dict]] = {}
    for name in passes:
        test = run.passes.get(name)
        for kind, halves in references.items():
            if test is None or name not in halves.a or (run.candidate.peer and kind == "R1"):
                continue
            a, b = halves.a[name], halves.b[name]
            if a.max() <= 0 and test.max() <= 0:
                continue
            low, high = interval(test, a, b)
            out.setdefault(name, {})[kind] = {**vars(score(test, a, b, flip=True)), "low": low, "high": high}
    return out


def scene_record(
    name: str,
    scene_key: str,
    size: tuple[int, int],
    samples: int,
    runs: list[Run],
    references: dict[str, Halves],
    triangles: int,
) -> dict:
    """All figures of one scene as plain data."""
    return {
        "scene": name,
        "key": scene_key,
        "size": list(size),
        "reference_samples": samples,
        "triangles": triangles,
        "candidates": [
            {
                "method": r.candidate.method,
                "technique": not r.candidate.peer,
                "label": r.candidate.label,
                "options": dict(r.candidate.options),
                "ms": r.ms,
                "mad": r.mad,
                "moving_ms": r.moving,
                "mib": r.mib,
                "passes_ms": r.per_pass,
                "scores": score_run(r, references),
            }
            for r in runs
        ],
    }


def write_results(folder: Path, head: dict, records: list[dict]) -> list[Path]:
    """results.json and results.csv: one line per candidate, pass and reference."""
    folder.mkdir(parents=True, exist_ok=True)
    files = [folder / "results.json", folder / "results.csv"]
    files[0].write_text(dump({**head, "scenes": records}))
    rows = [
        {
            "scene": r["scene"],
            "method": c["method"],
            "settings": c["label"],
            "ms": c["ms"],
            "moving_ms": c["moving_ms"],
            "mib": c["mib"],
            "pass": p,
            "reference": kind,
            **s,
        }
        for r in records
        for c in r["candidates"]
        for p, kinds in c["scores"].items()
        for kind, s in kinds.items()
    ]
    with files[1].open("w", newline="") as stream:
        writer = csv.DictWriter(stream, list(rows[0]) if rows else ["scene"])
        writer.writeheader()
        writer.writerows([finite(row) for row in rows])
    return files
