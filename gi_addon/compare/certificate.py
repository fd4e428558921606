# SPDX-License-Identifier: GPL-3.0-or-later
"""No more than a scene needs, shown for one scene: closed-form choices, what dearer settings would gain, what every pass
is for, and where the technique must be expected to fail."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ..graph import Plan
from ..scene import Scene
from ..settings import SettingError, Settings, walk
from .metrics import Score, rel_mse, score
from .page import number
from .references import Halves
from .stability import TRAITS, Suite, Traits
from .studio import Studio, has_setting, without_pass
from .study import interval
from .sweeps import AXES
from .visible_light import light_unseen

# What counts as a difference: of the error, and of a frame's time, relative.
TOLERANCE, TIME_TOLERANCE = 0.02, 0.10
# Indirect light that may be missing: after D bounces a closed room of albedo ρ lacks ρ^D of it.
LIGHT_TOLERANCE = 0.05


@dataclass(frozen=True)
class Step:
    """A dearer setting and what it would gain: share of the error and of the time."""

    label: str
    gain: float
    cost: float


@dataclass(frozen=True)
class Removal:
    """A pass taken out: relMSE and ms without it (None: no picture is left), what goes with it, and the verdict."""

    title: str
    rel_mse: float | None
    ms: float | None
    with_it: tuple[str, ...]
    verdict: str


@dataclass
class Certificate:
    """All that is said of one technique and its settings on one scene."""

    technique: str
    settings: dict[str, object]
    against: str
    score: Score
    low: float
    high: float
    ms: float
    choices: list[str] = field(default_factory=list)
    steps: list[Step] = field(default_factory=list)
    removals: list[Removal] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)

    def text(self) -> str:
        """For people."""
        sign = "R∞" if self.against == "Rinf" else self.against
        changed = ", ".join(f"{k} {v}" for k, v in self.settings.items()) or "defaults"
        best = max(self.steps, key=lambda s: s.gain, default=None)
        lines = [
            f"certificate: {self.technique} ({changed})",
            f"  Combined against Cycles {sign}: relMSE {number(self.score.rel_mse)} "
            f"[{number(self.low)} … {number(self.high)}], gain {self.score.gain:.3f}, "
            f"best constant {number(self.score.constant)}, noise floor {number(self.score.noise_floor)}",
            f"  {self.ms:.3g} ms for the picture",
        ]
        if best is not None:
            share = f"gains {100 * best.gain:.1f} %" if best.gain > 0 else "gains nothing"
            lines.append(f"  the best of the next dearer settings ({best.label}) {share} for {best.cost:.2g} × the time")
        lines += ["", "closed-form choices:", *(f"  {line}" for line in self.choices)]
        lines += ["", "next dearer settings:"]
        lines += [f"  {s.label}: error {-100 * s.gain:+.1f} %, time × {s.cost:.2g}" for s in self.steps]
        lines += ["", "ablation (each pass removed in turn):"]
        for r in self.removals:
            numbers = "no picture" if r.rel_mse is None else f"relMSE {number(r.rel_mse)}, {r.ms:.3g} ms"
            also = f"; takes {', '.join(r.with_it)} with it" if r.with_it else ""
            lines.append(f"  {r.title}: {numbers} — {r.verdict}{also}")
        lines += ["", "predicted failures:", *(f"  {line}" for line in self.failures or ["none known"])]
        return "\n".join(lines)


# --- what the scene asks for ---------------------------------------------------------------------------------------------


def wall_thickness(scene: Scene, *, points: int = 64, seed: int = 5) -> np.ndarray:
    """Distances (N,) in metres from sampled surface points to the next surface behind them: how thick things are. Points
    with nothing behind are left out."""
    triangles = []
    inst = scene.instances
    for i in range(len(inst)):
        mesh = scene.meshes[inst.mesh[i]]
        if not mesh.empty:
            corners = mesh.positions[mesh.triangles].astype("f8")
            triangles.append(corners @ inst.matrix[i, :3, :3].T + inst.matrix[i, :3, 3])
    if not triangles:
        return np.zeros(0)
    t = np.concatenate(triangles)
    edge1, edge2 = t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]
    normal = np.cross(edge1, edge2)
    area = np.linalg.norm(normal, axis=1)
    if area.sum() <= 0:
        return np.zeros(0)
    rng = np.random.default_rng(seed)
    chosen = rng.choice(len(t), points, p=area / area.sum())
    u, v = rng.random((2, points))
    flip = u + v > 1
    u, v = np.where(flip, 1 - u, u), np.where(flip, 1 - v, v)
    origins = t[chosen, 0] + u[:, None] * edge1[chosen] + v[:, None] * edge2[chosen]
    inward = -normal[chosen] / area[chosen, None]
    extent = float(np.linalg.norm(t.reshape(-1, 3).max(axis=0) - t.reshape(-1, 3).min(axis=0)))
    found = []
    for origin, direction in zip(origins, inward, strict=True):
        # T. Möller and B. Trumbore, JGT 2(1), 1997.
        p = np.cross(direction, edge2)
        determinant = np.sum(edge1 * p, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            s = origin - t[:, 0]
            a = np.sum(s * p, axis=1) / determinant
            q = np.cross(s, edge1)
            b = q @ direction / determinant
            distance = np.sum(edge2 * q, axis=1) / determinant
            hit = (a >= 0) & (b >= 0) & (a + b <= 1) & (distance > 1e-6 * extent)
        if hit.any():
            found.append(float(distance[hit].min()))
    return np.array(found)


def bounces_needed(albedo: float, tolerance: float = LIGHT_TOLERANCE) -> int:
    """The smallest D with ρ^D ≤ tolerance."""
    if albedo <= 0.0:
        return 0
    return max(1, math.ceil(math.log(tolerance) / math.log(min(albedo, 0.99))))


def closed_forms(
    scene: Scene, settings: Settings, plan: Plan, color: np.ndarray, wall: float | None, wall_limit: float | None
) -> list[str]:
    """One line per choice that needs no search. ``color``: the Diffuse Color pass; ``wall`` the scene's thin walls, m;
    ``wall_limit`` the technique's w*, cells."""
    lines = []
    lit = color.mean(axis=-1)
    lit = lit[lit > 0]
    traits = TRAITS.get(settings.technique, Traits())
    if lit.size:
        albedo = float(np.percentile(lit, 95))
        needed = bounces_needed(albedo)
        limit = int(next(m.high for p, _, m in walk() if p == "bounces"))
        state = (
            "as set"
            if settings.bounces >= needed
            else f"set to {settings.bounces}" + (f", at most {limit}" if limit < needed else "")
        )
        lines.append(f"bounces {needed}: smallest D with ρ_p95^D ≤ {LIGHT_TOLERANCE:g} at ρ_p95 = {albedo:.2f} ({state})")
    if has_setting(traits.blockers):
        bounds = scene.bounds()
        extent = float((bounds[1] - bounds[0]).max())
        resolution = int(settings.get(traits.blockers))
        if wall and wall_limit and math.isfinite(wall_limit):
            asked = math.ceil(extent * wall_limit / wall)
            least = int(next(m.low for p, _, m in walk() if p == traits.blockers))
            state = f"set to {resolution}" + (": holds" if resolution >= asked else "")
            lines.append(
                f"{traits.blockers} at least {max(asked, least)}: cell ≤ thinnest wall / w* = {wall:.3g} m / {wall_limit:g}, "
                f"over {extent:.3g} m ({state})"
            )
        elif wall:
            lines.append(f"{traits.blockers}: no cell size keeps light out of walls (w* was not reached up to 4 cells)")
        path = f"{settings.technique.lower()}.iterations"
        if has_setting(path):
            # Light steps over a face at a time: corner to corner are three sides of the box.
            steps = math.ceil(float((bounds[1] - bounds[0]).sum()) / extent * resolution)
            chosen = int(settings.get(path))
            state = "0: light crosses the whole grid" if chosen == 0 else "holds" if chosen >= steps else f"set to {chosen}"
            lines.append(f"{path} {steps}: cells from corner to corner of the scene, face by face ({state})")
    lines += [f"no {task.title}: {reason}" for task, reason in plan.skipped]
    return lines


# --- measuring -------------------------------------------------------------------------------------------------------------


def dearer(settings: Settings, against: str) -> list[tuple[str, Settings]]:
    """The next dearer setting along every axis: twice the sub-frames, the next value up of each of the technique's own.
    More bounces are none where the reference ``against`` has one: they model something else."""
    out = []
    paths = [p for p in dict.fromkeys(("samples", *AXES.get(settings.technique, {}))) if has_setting(p)]
    if against == "R1":
        paths.remove("bounces")
    for path in paths:
        value = settings.get(path)
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            continue
        new = max(1, value // 2) if path == "gather_scale" else value * 2
        if new == value:
            continue
        other = settings.copy()
        try:
            other.set(path, new)
        except SettingError:
            continue
        out.append((f"{path} {new}", other))
    return out


def certify(
    scene: Scene,
    settings: Settings,
    size: tuple[int, int],
    references: dict[str, Halves],
    *,
    progress: Callable[[str], None] = lambda text: None,
) -> Certificate:
    """Measure everything. The reference is the one the settings model: one bounce (R1) or all of them (R∞)."""
    against = "R1" if settings.bounces <= 1 else "Rinf"
    halves = references[against]
    a, b = halves.a["Combined"], halves.b["Combined"]

    def measured(studio: Studio, chosen: Settings) -> tuple[np.ndarray, float, Plan]:
        result = studio.render(scene, chosen, ("Combined",), size)
        # The least of four: other work on the machine only ever adds.
        times = [studio.render(scene, chosen, ("Combined",), size).seconds for _ in range(4)]
        return result.passes["Combined"][..., :3], min(times) * 1e3, result.plan

    with Studio() as studio:
        progress("the configuration")
        color = studio.render(scene, settings, ("Diffuse Color",), size).passes["Diffuse Color"]
        image, ms, plan = measured(studio, settings)
        s = score(image, a, b)
        low, high = interval(image, a, b)
        defaults = Settings()
        changed = {p: v for p, v in settings.as_dict().items() if p != "technique" and _differs(v, defaults.get(p))}
        out = Certificate(settings.technique, changed, against, s, low, high, ms)
        for label, other in dearer(settings, against):
            progress(f"dearer: {label}")
            picture, cost, _ = measured(studio, other)
            out.steps.append(Step(label, 1.0 - rel_mse(picture, a, b) / max(s.rel_mse, 1e-12), cost / ms))
    for planned in plan.run:
        if any(w.name == "film" for w in planned.writes):
            out.removals.append(Removal(planned.title, None, None, (), "needed: it makes the picture"))
            continue
        progress(f"without {planned.title}")
        out.removals.append(_remove(planned.title, scene, settings, size, plan, measured, (a, b), s.rel_mse, ms))
    progress("walls")
    thickness = wall_thickness(scene)
    wall = float(np.percentile(thickness, 5)) if thickness.size else None
    limit, leak = _wall_limit(settings)
    out.choices = closed_forms(scene, settings, plan, color, wall, limit)
    out.failures = predictions(scene, settings, color, wall, limit, leak, s, size)
    return out


def _differs(value: object, default: object) -> bool:
    """Blender keeps single precision: 0.05 comes back as another double."""
    if isinstance(value, float) and isinstance(default, float):
        return not math.isclose(value, default, rel_tol=1e-6)
    return value != default


def _remove(title, scene, settings, size, plan, measured, halves, error: float, ms: float) -> Removal:
    """Take one pass out and look."""
    with without_pass(settings.technique, title), Studio() as studio:
        image, other_ms, other = measured(studio, settings)
    left = {p.title for p in other.run}
    with_it = tuple(p.title for p in plan.run if p.title not in left and p.title != title)
    if not left or not image.any():
        return Removal(title, None, None, with_it, "needed: no picture without it")
    other_error = rel_mse(image, *halves)
    if other_error > error * (1.0 + TOLERANCE):
        verdict = f"needed: error × {other_error / max(error, 1e-12):.3g} without it"
    elif other_ms > ms * (1.0 + TIME_TOLERANCE):
        verdict = f"pays: time × {other_ms / ms:.2g} without it"
        if other_error < error * (1.0 - TOLERANCE):
            verdict += f", for error × {other_error / max(error, 1e-12):.3g}"
    else:
        verdict = f"not needed here: error × {other_error / max(error, 1e-12):.3g}, time × {other_ms / ms:.2g} without it"
    return Removal(title, other_error, other_ms, with_it, verdict)


def _blind(settings: Settings) -> bool:
    """Whether bounced light is not tested for visibility at all."""
    return settings.technique == "RSM" and settings.as_dict().get("rsm.visibility") == "NONE"


def _wall_limit(settings: Settings) -> tuple[float | None, float]:
    """The technique's w* by stability test 5, and its leak at two cells."""
    from .stability_checks import thin_wall

    suite = Suite(settings.technique)
    if _blind(settings):
        suite.base["rsm__visibility"] = "NONE"
    try:
        found = {q.name: q.value for q in thin_wall(suite).quantities}
    finally:
        suite.close()
    return next((v for k, v in found.items() if k.startswith("w*")), None), found.get("leak at w = 2", math.nan)


def predictions(
    scene: Scene, settings: Settings, color: np.ndarray, wall: float | None, limit: float | None, leak: float, s: Score,
    size: tuple[int, int],
) -> list[str]:  # fmt: skip
    """Where this technique must be expected to fail on this scene, each with its reason."""
    traits = TRAITS.get(settings.technique, Traits())
    out = []
    lit = color.mean(axis=-1)
    mean = float(lit[lit > 0].mean()) if (lit > 0).any() else 0.0
    missing = mean ** max(1, settings.bounces)
    if missing > LIGHT_TOLERANCE:
        out.append(
            f"with {settings.bounces} bounce{'s' * (settings.bounces != 1)} a closed room of this mean albedo ({mean:.2f}) lacks "
            f"{100 * missing:.0f} % of its indirect light"
        )
    if not traits.blockers or _blind(settings):
        out.append(f"bounced light passes through walls (stability test 5: {100 * leak:.1f} % leak at a wall of two cells)")
    elif has_setting(traits.blockers) and wall and limit:
        bounds = scene.bounds()
        cell = float((bounds[1] - bounds[0]).max()) / float(settings.get(traits.blockers))
        if wall / cell < limit:
            out.append(f"walls of {wall:.3g} m are {wall / cell:.2g} cells thick and leak below w* = {limit:g} cells")
    if traits.screen_space:
        out += light_unseen(scene, settings, size)
    if s.rel_mse > s.constant:
        out.append(
            f"on this scene it is worse than one constant colour (relMSE {number(s.rel_mse)} against {number(s.constant)})"
        )
    if s.noise_floor > 0.05 * s.rel_mse:
        out.append("the reference's noise is over 5 % of the error: take more reference samples before trusting the last digits")
    return out
