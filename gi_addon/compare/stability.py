# SPDX-License-Identifier: GPL-3.0-or-later
"""Where methods fail: the stability suite's registry, its runs, and its page.

A test measures quantities with limits and gives a verdict; ``stability_checks.py`` holds the eighteen of the protocol. A
technique that by nature cannot pass keeps its measured value and is shown with the reason: limits are never loosened.
"""

from __future__ import annotations

import hashlib
import json
import time
import traceback
import zipfile
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..engines import TECHNIQUES
from ..gl import driver
from ..renderer import Result
from ..scene import Scene
from ..settings import walk
from .page import dump
from .source import checks_version, source_version
from .studio import Studio, has_setting, settings_for

PASS, FAIL, NATURE, NOT_APPLICABLE, REPORTED, ERROR = "pass", "fail", "fail by nature", "n/a", "reported", "error"


@dataclass(frozen=True)
class Traits:
    """What a technique is made of, as far as tests must know: its grid, its light map, the setting that draws its random
    set, what it tests visibility in (nothing: it does not), whether it knows only the screen, whether it carries flux
    through a volume, and the setting by which each light has random sets of its own."""

    grid: str = ""
    map: str = ""
    set: str = ""
    stride: int = 1  # of that setting, from one set to the next
    blockers: str = "geometry"
    screen_space: bool = False
    volume: bool = False
    own: str = ""


TRAITS: dict[str, Traits] = {
    "RSM": Traits(map="rsm.resolution", set="rsm.samples", blockers="rsm.visibility_resolution", own="rsm.own_samples"),
    "LPV": Traits(grid="lpv.resolution", blockers="lpv.resolution", volume=True),
    "VCT": Traits(grid="vct.resolution", blockers="vct.resolution"),
    "SSDO": Traits(set="ssdo.samples", stride=64, screen_space=True),
}


# Failures that are known, with their causes: shown beside the verdict. A test that fails and is not listed here fails the
# test suite too.
# Numbers beside a cause are what trying it gave; the others are measured only.
KNOWN: dict[tuple[str, str], str] = {}


@dataclass(frozen=True)
class Quantity:
    """A measured number and its limits; without limits it is only reported."""

    name: str
    value: float
    low: float | None = None
    high: float | None = None

    @property
    def limited(self) -> bool:
        return self.low is not None or self.high is not None

    @property
    def holds(self) -> bool:
        if not np.isfinite(self.value):
            return not self.limited
        return (self.low is None or self.value >= self.low) and (self.high is None or self.value <= self.high)

    @property
    def limit(self) -> str:
        if self.low is not None and self.high is not None:
            return f"{self.low:g} … {self.high:g}"
        if self.high is not None:
            return f"≤ {self.high:g}"
        return f"≥ {self.low:g}" if self.low is not None else "–"


def at_most(name: str, value: float, high: float) -> Quantity:
    return Quantity(name, float(value), None, high)


def within(name: str, value: float, low: float, high: float) -> Quantity:
    return Quantity(name, float(value), low, high)


def reported(name: str, value: float) -> Quantity:
    return Quantity(name, float(value))


@dataclass
class Curve:
    """A plot of a finding: ``lines`` by name over ``x``; ``limits`` are levels that a line must not pass, ``marks`` places
    on the x axis."""

    title: str
    x_title: str
    y_title: str
    x: list[float]
    lines: dict[str, list[float]]
    log_x: bool = False
    log_y: bool = False
    limits: dict[str, float] = field(default_factory=dict)
    marks: dict[str, float] = field(default_factory=dict)


@dataclass
class Finding:
    """What one test found of one technique. ``pictures`` (H, W, 3) linear, row 0 at the bottom; ``nature`` is the reason
    why this technique cannot pass, if there is one."""

    quantities: list[Quantity] = field(default_factory=list)
    curves: list[Curve] = field(default_factory=list)
    pictures: dict[str, np.ndarray] = field(default_factory=dict)
    nature: str = ""
    note: str = ""
    verdict: str = ""
    seconds: float = 0.0

    def judge(self) -> Finding:
        """Set the verdict from the quantities."""
        if not self.verdict:
            limited = [q for q in self.quantities if q.limited]
            if not limited:
                self.verdict = REPORTED if self.quantities else NOT_APPLICABLE
            elif all(q.holds for q in limited):
                self.verdict = PASS
            else:
                self.verdict = NATURE if self.nature else FAIL
        return self


def save_finding(path: Path, finding: Finding) -> None:
    """Keep a finding with its pictures, whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    text = json.dumps({k: v for k, v in asdict(replace(finding, pictures={})).items() if k != "pictures"})
    part = path.with_suffix(".part.npz")
    pictures = {f"picture:{name}": np.asarray(image, "f4") for name, image in finding.pictures.items()}
    np.savez_compressed(part, finding=np.frombuffer(text.encode(), np.uint8), **pictures)
    part.replace(path)


def load_finding(path: Path) -> Finding | None:
    """Read a finding; None where there is none or it is damaged."""
    try:
        with np.load(path, allow_pickle=False) as data:
            values = json.loads(bytes(data["finding"]).decode())
            values["quantities"] = [Quantity(**q) for q in values["quantities"]]
            values["curves"] = [Curve(**c) for c in values["curves"]]
            pictures = {k.removeprefix("picture:"): data[k] for k in data.files if k.startswith("picture:")}
            return Finding(**values, pictures=pictures)
    except (OSError, ValueError, KeyError, TypeError, zipfile.BadZipFile, EOFError):
        return None


def not_applicable(reason: str) -> Finding:
    return Finding(note=reason, verdict=NOT_APPLICABLE)


class Suite:
    """One technique's run: renders with one renderer. ``full`` sweeps everything the protocol lists."""

    def __init__(self, technique: str, *, full: bool = False, size: tuple[int, int] = (64, 36)) -> None:
        self.technique, self.full, self.size = technique, full, size
        self.traits = TRAITS.get(technique, Traits())
        self.studio = Studio()
        # Coarse structures keep software OpenGL in time; test 13 is the one about their size.
        self.base: dict[str, Any] = {}
        for path, value in ((self.traits.blockers, 32), (self.traits.grid, 32), (self.traits.map, 256)):
            if has_setting(path) and not full:
                self.base[path.replace(".", "__")] = value

    def close(self) -> None:
        self.studio.close()

    def settings(self, **values: Any):
        return settings_for(self.technique, **{**self.base, **values})

    def render(self, scene: Scene, *outputs: str, size: tuple[int, int] | None = None, length: float = 1.0, **values) -> Result:
        """A frame of ``scene``; settings in metres are multiplied by ``length``."""
        settings = self.settings(**values)
        if length != 1.0:
            for path, _, meta in walk():
                if meta.unit == "m" and path.startswith((self.technique.lower(), "ao.")):
                    settings.set(path, settings.get(path) * length)
        return self.studio.render(scene, settings, outputs, size or self.size)

    def indirect(self, scene: Scene, **values) -> np.ndarray:
        """The Diffuse Indirect pass, (H, W, 3): irradiance over π."""
        return self.render(scene, "Diffuse Indirect", **values).passes["Diffuse Indirect"].astype("f8")

    def cell(self, scene: Scene) -> float:
        """Side in metres of a cell of what the technique tests visibility in; 1/64 of the scene where it has none."""
        bounds = scene.bounds()
        extent = float((bounds[1] - bounds[0]).max())
        path = self.traits.blockers
        return extent / float(self.settings().get(path)) if has_setting(path) else extent / 64.0


@dataclass(frozen=True)
class Test:
    """An entry of the registry."""

    __test__ = False  # not pytest's

    key: str
    title: str
    formula: str
    check: Callable[[Suite], Finding]
    fast: bool = True


TESTS: dict[str, Test] = {}


def test(key: str, title: str, formula: str, *, fast: bool = True):
    """Register a check under the protocol's number."""

    def add(check: Callable[[Suite], Finding]) -> Callable[[Suite], Finding]:
        TESTS[key] = Test(key, title, formula, check, fast)
        return check

    return add


test.__test__ = False  # type: ignore[attr-defined]


def run_one(suite: Suite, key: str) -> Finding:
    """Run a test; an exception is a finding too."""
    start = time.perf_counter()
    try:
        finding = TESTS[key].check(suite).judge()
    except Exception as error:
        traceback.print_exc()
        finding = Finding(note=f"{type(error).__name__}: {error}", verdict=ERROR)
    finding.seconds = time.perf_counter() - start
    return finding


def run(
    techniques: Iterable[str] | None = None,
    keys: Sequence[str] | None = None,
    *,
    full: bool = False,
    cache: Path | None = None,
    progress: Callable[[str, Test, Finding], None] | None = None,
) -> dict[str, dict[str, Finding]]:
    """Technique -> test -> finding. With ``cache`` each is kept there as it ends, by driver and version, and an interrupted
    run goes on; what ended in an exception is tried again."""
    from . import stability_checks  # noqa: F401 — fills the registry

    out: dict[str, dict[str, Finding]] = {}
    for technique in techniques or TECHNIQUES:
        suite = Suite(technique, full=full)
        try:
            out[technique] = {}
            for key in keys or TESTS:
                named = (technique, key, full, suite.size, driver(), source_version(), checks_version())
                path = cache and cache / f"{hashlib.blake2b(repr(named).encode(), digest_size=16).hexdigest()}.npz"
                finding = load_finding(path) if path else None
                if finding is None:
                    finding = run_one(suite, key)
                    if path and finding.verdict != ERROR:
                        save_finding(path, finding)
                out[technique][key] = finding
                if progress:
                    progress(technique, TESTS[key], finding)
        finally:
            suite.close()
    return out


def as_json(results: dict[str, dict[str, Finding]], *, full: bool) -> dict:
    """Plain data: every quantity with limits and verdict, every curve."""
    body: dict[str, Any] = {"version": __version__, "driver": driver(), "full": full, "tests": {}, "techniques": {}}
    for findings in results.values():
        for key in findings:
            body["tests"][key] = {"title": TESTS[key].title, "formula": TESTS[key].formula}
    for technique, findings in results.items():
        body["techniques"][technique] = {
            key: {
                "verdict": f.verdict,
                "nature": f.nature,
                "note": f.note,
                "seconds": round(f.seconds, 2),
                "quantities": [{**asdict(q), "limit": q.limit, "holds": q.holds} for q in f.quantities],
                "curves": [asdict(c) for c in f.curves],
            }
            for key, f in findings.items()
        }
    return body


def write(results: dict[str, dict[str, Finding]], folder: Path, *, full: bool) -> list[Path]:
    """stability.json and stability.html in ``folder``."""
    from .stability_page import page

    folder.mkdir(parents=True, exist_ok=True)
    data = as_json(results, full=full)
    files = [folder / "stability.json", folder / "stability.html"]
    files[0].write_text(dump(data))
    files[1].write_text(page(results, data))
    return files
