# SPDX-License-Identifier: GPL-3.0-or-later
"""A comparison: every candidate rendered, timed and scored, kept on disk so that an interrupted sweep goes on.

A result is named by scene content, picture size, settings, driver and version (with a fingerprint of the sources), so a
change of any of them measures anew, and nothing else does.
"""

from __future__ import annotations

import csv
import hashlib
import json
import time
import zipfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..gl.context import MIB
from ..scene import Scene
from ..settings import Settings
from .bench import nudged
from .metrics import error_map, score
from .page import dump, finite
from .references import Halves
from .source import scoring_version, source_version
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
# Light that no bounce changes: one reference is enough, and it is the one that peers share.
_UNBOUNCED = ("Diffuse Direct", "Glossy Direct", "Emission", "Environment", "Ambient Occlusion")
_TILE = 8


@dataclass
class Run:
    """A candidate on one scene: its pictures, and milliseconds of whole frames in all visits. ``moving`` are frames in
    which the lights changed; ``per_pass`` ms of one whole picture by pass; ``mib`` of the plan; ``path`` where it is kept."""

    candidate: Candidate
    passes: dict[str, np.ndarray]
    times: list[float] = field(default_factory=list)
    moving: list[float] = field(default_factory=list)
    per_pass: dict[str, float] = field(default_factory=dict)
    mib: float | None = None
    visits: int = 0
    path: Path | None = None

    @property
    def ms(self) -> float:
        return float(np.median(self.times))

    @property
    def p95(self) -> float:
        return float(np.percentile(self.times, 95))

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
            return Run(candidate, passes, **meta, path=path)
    except (OSError, ValueError, KeyError, TypeError, zipfile.BadZipFile, EOFError):
        return None


# A peer's renderer: options and pass names in, (passes, seconds) out.
PeerRender = Callable[[Candidate, Sequence[str]], tuple[dict[str, np.ndarray], float]]


def visit(
    studio: Studio, scene: Scene, run: Run, base: Settings, size: tuple[int, int], repeats: int, budget_s: float = np.inf
) -> None:
    """Render a technique's candidate once for its pictures and ``repeats`` times for its time, still and moving; once at
    least, and no more than fit into ``budget_s`` seconds."""
    settings = run.candidate.settings(base)

    def frame(target: Scene, outputs: Sequence[str] = ("Combined",), **options):
        return studio.render(target, settings, outputs, size, **options)

    def timed_frames(target: Callable[[int], Scene]) -> list[float]:
        out, end = [], time.perf_counter() + budget_s / 2.0
        while len(out) < repeats and (not out or time.perf_counter() + out[-1] * 1e-3 < end):
            out.append(frame(target(len(out))).seconds * 1e3)
        return out

    if not run.passes:
        run.passes = {n: p[..., :3].astype(np.float32) for n, p in frame(scene, COMPARED).passes.items()}
    run.mib = frame(scene).plan.nbytes() / MIB
    run.times += timed_frames(lambda i: scene)
    if not run.per_pass:
        run.per_pass = {k: float(np.sum(v)) for k, v in frame(scene, timed=True).milliseconds.items()}
    run.moving += timed_frames(lambda i: nudged(scene, len(run.moving) + i + 1))


def visit_peer(peer: PeerRender, run: Run, repeats: int, budget_s: float, warm: set) -> None:
    """The same of a peer. ``warm`` holds what it has rendered before in this process, but for the number of samples: only
    what is not in it needs a first picture, which loads, builds and compiles."""
    kind = (run.candidate.method, *(o for o in run.candidate.options if o[0] != "samples"))
    if kind not in warm:
        peer(run.candidate, COMPARED)
        warm.add(kind)
    end = time.perf_counter() + budget_s
    for i in range(repeats):
        if i and time.perf_counter() + run.times[-1] * 1e-3 > end:
            break
        passes, seconds = peer(run.candidate, COMPARED)
        run.passes = run.passes or {n: np.ascontiguousarray(p[..., :3]) for n, p in passes.items()}
        run.times.append(seconds * 1e3)


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
    peer_versions: Mapping[str, str] | None = None,
    repeats: int = 3,
    visits: int = 2,
    budget_s: float = np.inf,
    progress: Callable[[str], None] = lambda text: None,
) -> list[Run]:
    """Every candidate, from the cache where it is whole. They are visited there and back (A B … B A), or only there
    with ``visits`` 1; each visit is saved as it ends. A candidate that fails is left out, and said. ``peer_versions`` by
    method; a slow candidate has fewer than ``repeats`` frames of a kind a visit where they don't fit into ``budget_s``."""
    runs: dict[Candidate, tuple[Path, Run]] = {}
    for candidate in candidates:
        settings = None if candidate.peer else candidate.settings(base)
        version = (peer_versions or {}).get(candidate.method, "") if candidate.peer else source_version()
        path = cache / f"{run_key(scene_key, size, candidate, settings, driver, version)}.npz"
        runs[candidate] = (path, load_run(path, candidate) or Run(candidate, {}, path=path))
    warm: set = set()
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
                        visit_peer(peer, run, repeats, budget_s, warm)
                    else:
                        visit(studio, scene, run, base, size, repeats, budget_s)
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
    """pass -> reference -> figures, for passes that either side has light in; kept beside the run, so that an interrupted
    scoring goes on too."""
    path = run.path and run.path.with_suffix(f".{_fingerprint(references)}-{scoring_version()}.json")
    if path and path.is_file():
        return json.loads(path.read_text())
    out: dict[str, dict[str, dict]] = {}
    for name in passes:
        test = run.passes.get(name)
        for kind, halves in references.items():
            if test is None or name not in halves.a:
                continue
            if kind == "R1" and (run.candidate.peer or name in _UNBOUNCED):
                continue
            a, b = halves.a[name], halves.b[name]
            if a.max() <= 0 and test.max() <= 0:
                continue
            low, high = interval(test, a, b)
            out.setdefault(name, {})[kind] = {**vars(score(test, a, b, flip=True)), "low": low, "high": high}
    if path:
        part = path.with_suffix(".part")
        part.write_text(json.dumps(out))
        part.replace(path)
    return out


def _fingerprint(references: dict[str, Halves]) -> str:
    """What the references hold, as a short name."""
    h = hashlib.blake2b(digest_size=6)
    for kind, halves in sorted(references.items()):
        for half in (halves.a, halves.b):
            for name in sorted(half):
                h.update(f"{kind} {name}".encode() + np.ascontiguousarray(half[name]).tobytes())
    return h.hexdigest()


def scene_record(
    name: str,
    scene_key: str,
    size: tuple[int, int],
    samples: int,
    runs: list[Run],
    references: dict[str, Halves],
    triangles: int,
    base: Settings | None = None,
) -> dict:
    """All figures of one scene as plain data. ``base`` are the settings that the candidates change."""
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
                "bounces": None if r.candidate.peer else r.candidate.settings(base).bounces,
                "ms": r.ms,
                "mad": r.mad,
                "p95": r.p95,
                "frames": len(r.times),
                "moving_ms": float(np.median(r.moving)) if r.moving else None,
                "worst_ms": max(r.moving) if r.moving else None,
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
            "mad": c["mad"],
            "p95": c["p95"],
            "frames": c["frames"],
            "moving_ms": c["moving_ms"],
            "worst_ms": c["worst_ms"],
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
