# SPDX-License-Identifier: GPL-3.0-or-later
"""The eighteen tests of the protocol (shared measurement page, §4), in its order and with its limits.

References are closed forms (``closed_forms.py``), so that the suite needs neither Blender nor another renderer. Ambient
occlusion, an effect of its own, is off where irradiance is compared with a closed form.
"""

from __future__ import annotations

import itertools

import numpy as np

from ..outputs import OUTPUTS
from ..scene import Camera, Scene
from ..settings import walk
from . import scenes
from .closed_forms import camera_rays, hits, polygon_form_factor, visible_share
from .metrics import rel_mse
from .stability import (
    Curve,
    Finding,
    Quantity,
    Suite,
    at_most,
    not_applicable,
    reported,
    test,
    within,
)
from .studio import Studio, has_setting

_SCREEN = "screen space has no off-screen data"
_BLIND = "virtual lights are not tested for visibility"
_X, _Y, _Z = np.eye(3)


def _gray(image: np.ndarray) -> np.ndarray:
    return image[..., :3].mean(axis=-1)


def _picture(values: np.ndarray, scale: float = 1.0) -> np.ndarray:
    """A scalar map as a grey picture."""
    return np.repeat(np.nan_to_num(values)[..., None] * scale, 3, axis=-1)


# --- the corner and the sliding plate, with what their walls receive ------------------------------------------------


def wall_reference(
    camera: Camera,
    size: tuple[int, int],
    polygon: np.ndarray,
    radiosity: float,
    *,
    floor: float = 0.0,
    turn: np.ndarray | None = None,
) -> np.ndarray:
    """E/π (H, W) on the wall y = 0 of ``scenes.corner`` that a horizontal ``polygon`` of ``radiosity`` W/m² lights; NaN
    on whatever else a pixel shows, on the wall's rim (2 %), and below ``floor``. ``turn`` (4, 4) moved the scene."""
    back = np.linalg.inv(np.eye(4) if turn is None else turn)
    origin, direction = camera_rays(camera, size)
    origin, direction = origin @ back[:3, :3].T + back[:3, 3], direction @ back[:3, :3].T
    wall, s, t = hits(origin, direction, np.array([-1.0, 0, 0]), 2 * _X, _Z)
    ground, _, _ = hits(origin, direction, np.array([-1.0, 0, 0]), 2 * _X, _Y)
    low, high = polygon.min(axis=0), polygon.max(axis=0)
    plate, _, _ = hits(origin, direction, low, (high - low) * _X, (high - low) * _Y)
    seen = np.isfinite(wall) & (wall < np.minimum(ground, plate)) & (np.abs(s - 0.5) < 0.49) & (np.abs(t - 0.5) < 0.48)
    seen &= t > floor
    # Sub-frames move a pixel's point by up to half a pixel: those at an edge see both sides.
    inside = seen.copy()
    inside[[0, -1]], inside[:, [0, -1]] = False, False
    for axis in (0, 1):
        for step in (-1, 1):
            inside &= np.roll(seen, step, axis)
    seen = inside
    points = (origin + wall[..., None] * direction)[seen]
    out = np.full((size[1], size[0]), np.nan)
    out[seen] = radiosity * polygon_form_factor(points, np.broadcast_to(_Y, points.shape), polygon) / np.pi
    return out


_FLOOR = np.array([[-1.0, 0, 0], [1, 0, 0], [1, 1, 0], [-1, 1, 0]])


def _corner(suite: Suite, scene: Scene | None = None, *, size=None, turn=None, **values) -> tuple[np.ndarray, np.ndarray]:
    """(rendered, exact) E/π on the corner's wall."""
    scene = scene or scenes.corner()
    image = _gray(suite.indirect(scene, size=size, use_ao=False, **values))
    exact = wall_reference(scene.camera, size or suite.size, _FLOOR, 0.8 * 5.0, turn=turn)
    return np.where(np.isnan(exact), np.nan, image), exact


def _rel_mse(image: np.ndarray, exact: np.ndarray) -> float:
    good = ~np.isnan(exact)
    return rel_mse(image[good], exact[good])


def _moved(scene: Scene, *, aim=(0.0, 0.3, 0.35), eye=(0.0, 3.0, 1.7), shift=(0.0, 0.0), size=(64, 36)) -> Scene:
    """The scene seen from elsewhere; ``shift`` in pixels moves the picture as a lens shift does."""
    camera = scenes.perspective(eye, aim, 0.85)
    camera.clip_from_view[0, 2] = 2.0 * shift[0] / size[0]
    camera.clip_from_view[1, 2] = 2.0 * shift[1] / size[1]
    scene.camera = camera
    return scene


# --- 1 … 4: energy --------------------------------------------------------------------------------------------------


def _beyond(suite: Suite) -> tuple[float, float]:
    """What screen space draws beyond the picture's sides, as shares of its width and height."""
    pixels = round(float(suite.settings().ssdo.margin) * max(suite.size))
    return pixels / suite.size[0], pixels / suite.size[1]


@test("1", "Integrating sphere", "g = mean E / (ρΦ/(4πR²)); CV of E")
def sphere(suite: Suite) -> Finding:
    """One bounce in a diffuse sphere lights every point alike, wherever the lamp is; screen space gets the visible share."""
    limit = 0.02 if suite.technique == "RSM" else 0.05
    out = Finding()
    for lamp in ((0.0, 0.0, 0.0), (0.5, 0.0, 0.2), (0.0, 0.8, 0.0)):
        scene = scenes.integrating_sphere(albedo=0.5, power=100.0, light=lamp)
        image = _gray(suite.indirect(scene, samples=16, use_ao=False)) * np.pi
        g = image / (0.5 * 100.0 / (4 * np.pi))
        label = f"lamp at {lamp}"
        if suite.traits.screen_space:
            share = visible_share(scene.camera, 1.0, 100.0, np.array(lamp), beyond=_beyond(suite))
            out.quantities.append(within(f"g, {label} (visible share {share:.3f})", g.mean(), share - 0.03, share + 0.03))
        else:
            out.quantities.append(within(f"g, {label}", g.mean(), 1 - limit, 1 + limit))
            out.quantities.append(at_most(f"CV, {label}", g.std() / max(g.mean(), 1e-9), 0.15))
        out.pictures[f"g, {label}"] = _picture(g, 0.5)
    return out


@test("2", "Multi-bounce in the sphere", "L_D = ρ(1 − ρ^D)/(1 − ρ) · E₀/π with ρ = .5", fast=False)
def bounces(suite: Suite) -> Finding:
    """Relative radiance after D bounces, .5 (1 − .5^D)·2 of the direct one at ρ = .5, for every D that can be set."""
    high = int(next(m.high for p, _, m in walk() if p == "bounces"))
    depths = [d for d in ((1, 2, 3, 4, 8) if suite.full else (1, 2, 4)) if d <= high] or [1]
    scene = scenes.integrating_sphere(albedo=0.5, power=100.0)
    measured, out = [], Finding()
    for depth in depths:
        image = _gray(suite.indirect(scene, samples=16, bounces=depth, use_ao=False)) * np.pi
        # In units of the direct irradiance; reflected once more by ρ it is the protocol's L_D.
        measured.append(0.5 * float(image.mean()) / (100.0 / (4 * np.pi)))
        expected = 0.5 * (1.0 - 0.5**depth)
        if suite.traits.screen_space:
            share = visible_share(scene.camera, 1.0, 100.0, np.zeros(3), beyond=_beyond(suite))
            expected = 0.5 * sum(0.5**k * share**k for k in range(1, depth + 1))
        out.quantities.append(within(f"L, {depth} bounce{'s' * (depth > 1)}", measured[-1], expected - 0.025, expected + 0.025))
    if high == 1:
        out.note = "this version gathers one bounce only"
    out.curves = [
        Curve(
            "Radiance by bounces",
            "bounces",
            "L / L direct",
            [float(d) for d in depths],
            {"measured": measured, "exact": [0.5 * (1 - 0.5**d) for d in depths]},
        )
    ]
    return out


@test("3", "White furnace", "a convex body, ρ = 1, in L = 1 has radiance 1: mean; max", fast=False)
def white_furnace(suite: Suite) -> Finding:
    """All light is the sky's: any other value is energy made or lost. Swept over the technique's own sizes."""
    out = Finding()
    sweeps: list[dict] = [{}]
    if suite.traits.grid:
        sweeps = [{suite.traits.grid.replace(".", "__"): n} for n in ((32, 64, 128) if suite.full else (16, 32))]
    scene = scenes.furnace()
    for values in sweeps:
        p = suite.render(scene, "Combined", "Depth", samples=16, world__samples=16, world__resolution=128, **values).passes
        body = p["Depth"][..., 0] < 3.9  # whole pixels of the sphere only
        body[1:-1] &= body[2:] & body[:-2]
        body[:, 1:-1] &= body[:, 2:] & body[:, :-2]
        radiance = _gray(p["Combined"])[body]
        label = ", ".join(f"{k.replace('__', '.')} {v}" for k, v in values.items()) or "defaults"
        out.quantities += [within(f"mean, {label}", radiance.mean(), 0.98, 1.01), at_most(f"max, {label}", radiance.max(), 1.01)]
        out.pictures[label] = _picture(np.where(body, _gray(p["Combined"]), 0.0), 0.7)
    return out


def _volumes(suite: Suite) -> dict[str, np.ndarray]:
    return {n: a for n, a in suite.studio.textures().items() if n.startswith(f"{suite.technique.lower()}.")}


@test("4", "Flux of the propagation", "Φ_N/Φ_0 over N iterations; Φ_{n+1}/Φ_n ≤ ρ_max with bounces", fast=False)
def flux(suite: Suite) -> Finding:
    """Light that spreads inside a closed white sphere: what a receiver in its middle region gets must not grow or fade
    with the number of iterations once it has arrived; a further bounce adds at most ρ times the one before."""
    path = f"{suite.technique.lower()}.iterations"
    if not suite.traits.volume:
        return not_applicable("nothing is propagated")
    out = Finding()
    # From corner to corner are as many cells as the grid has along three sides, with one of padding at each end: light of
    # fewer iterations has not arrived everywhere. Without a number of iterations light crosses the whole grid: then its
    # cells are the steps.
    if has_setting(path):
        cells = 32 if suite.full else 12  # iterations one by one are the slow way
        grid = {suite.traits.grid.replace(".", "__"): cells}
        across = 3 * (cells + 2)
        counts = (8, 16, 32, 64, across, 2 * across) if suite.full else (16, across, 2 * across)
    else:
        path, across, grid = suite.traits.grid, 16, {}
        counts = (8, 16, 32, 64) if suite.full else (16, 32)
    scene = scenes.integrating_sphere(albedo=0.5, power=100.0)
    exact = 0.5 * 100.0 / (4 * np.pi) / np.pi
    name = path.replace(".", "__")
    gains = [float(_gray(suite.indirect(scene, samples=1, use_ao=False, **{**grid, name: n})).mean()) / exact for n in counts]
    settled = [g for n, g in zip(counts, gains, strict=True) if n >= across]
    out.quantities = [within(f"Φ(N)/Φ({across}), N = {path} > {across}", v / settled[0], 0.99, 1.01) for v in settled[1:]]
    out.quantities.append(at_most(f"largest Φ_N/Φ({across})", max(gains) / settled[0], 1.01))
    out.quantities.append(reported("Φ over the exact one", settled[0]))  # test 1 judges it
    high = int(next(m.high for p, _, m in walk() if p == "bounces"))
    if high >= 2:
        means = [
            float(_gray(suite.indirect(scene, samples=1, use_ao=False, bounces=b)).mean()) for b in range(1, min(high, 4) + 1)
        ]
        steps = np.diff([0.0, *means])
        ratios = steps[1:] / steps[:-1]
        out.quantities.append(at_most("largest Φ_{n+1}/Φ_n over bounces (ρ = .5)", float(ratios.max()), 0.5))
    out.curves = [Curve("Flux by steps", path, "E / E exact", [float(n) for n in counts], {"Φ": gains}, log_x=True)]
    return out


@test("4b", "Propagation symmetry", "axis flips and permutations of a lit patch: max relative difference", fast=False)
def symmetry(suite: Suite) -> Finding:
    """A lit plate facing a receiver along each of the axes, turned through the cube's rotations: the same irradiance."""
    if not suite.traits.volume:
        return not_applicable("nothing is propagated")
    turns = []
    for axes in ((0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)):
        for signs in np.array(np.meshgrid([1, -1], [1, -1], [1, -1])).T.reshape(-1, 3):
            m = np.zeros((3, 3))
            m[np.arange(3), axes] = signs
            turns.append(m)
    means = []
    for m in turns if suite.full else turns[::9]:
        b = scenes.SceneBuilder()
        quad = np.array([[-1.0, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1]])
        b.quads(np.stack([quad, quad[::-1] * [1, 1, -1]]), scenes.diffuse((0.8,) * 3))
        # Unlit, black and far out: they keep the box a cube.
        b.quads(np.array([[[-1, -1, -1], [-1, -1, -0.99], [-1, -0.99, -0.99], [-1, -0.99, -1]]]), scenes.diffuse((0, 0, 0)))
        b.light(scenes.spot_light((0, 0, 0.9), (0, 0, -1), 100.0, size=0.9, blend=0.0))
        scene = b.build(scenes.orthographic((0, 0, -0.5), (0, 0, 1), 1.0, aspect=16 / 9))
        turn = np.eye(4)
        turn[:3, :3] = m
        scenes.transformed(scene, turn)
        means.append(float(_gray(suite.indirect(scene, samples=1, use_ao=False)).mean()))
    spread = (max(means) - min(means)) / max(max(means), 1e-12)
    return Finding(
        [at_most(f"(max − min)/max over {len(means)} flips and permutations", spread, 1e-3)],
        [Curve("Irradiance turned", "flip or permutation", "mean E/π", [float(i) for i in range(len(means))], {"E": means})],
    )


# --- 5: leaks -------------------------------------------------------------------------------------------------------


def leak(suite: Suite, width: float, offset: float, degrees: float, cell: float) -> float:
    """E_dark/E_lit across a wall ``width`` cells thick, moved by ``offset`` cells; NaN where no bounced light is in the lit
    room either."""
    scene = scenes.thin_wall(width * cell, offset=offset * cell, degrees=degrees)
    image = _gray(suite.indirect(scene, samples=1, use_ao=False))
    origin, _ = camera_rays(scene.camera, suite.size)
    a = np.radians(-degrees)
    x = origin[..., 0] * np.cos(a) - origin[..., 1] * np.sin(a)
    y = origin[..., 0] * np.sin(a) + origin[..., 1] * np.cos(a)
    half = width * cell / 2.0
    floor = (np.abs(y) < 0.9) & (np.abs(x) < 1.9)
    lit, dark = floor & (x < offset * cell - half - 0.1), floor & (x > offset * cell + half + 0.1)
    return float(image[dark].mean() / image[lit].mean()) if image[lit].mean() > 1e-6 else float("nan")


@test("5", "Thin wall", "leak = E_dark/E_lit against w = thickness/cell; w* at 1 %", fast=False)
def thin_wall(suite: Suite) -> Finding:
    """Light in a room that has none. The worst of the wall's offsets and angles counts."""
    widths = (0.1, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0) if suite.full else (0.1, 0.5, 1.0, 2.0, 4.0)
    offsets = np.arange(16) / 16.0 if suite.full else np.array([0.0, 0.25, 0.5, 0.75])
    angles = (0.0, 15.0, 45.0)
    cell = suite.cell(scenes.thin_wall(0.1))
    worst = {angle: [float(np.max([leak(suite, w, o, angle, cell) for o in offsets])) for w in widths] for angle in angles}
    if np.isnan(list(worst.values())).any():
        if suite.traits.screen_space:
            return not_applicable("what lights the floor is not in the picture: nothing reaches the lit room either")
        return Finding([Quantity("bounced light in the lit room", 0.0, 1e-6)])
    overall = np.max([worst[a] for a in angles], axis=0)
    good = [w for i, w in enumerate(widths) if (overall[i:] <= 0.01).all()]
    out = Finding([at_most(f"leak at w = {w:g}", v, 0.01) for w, v in zip(widths, overall, strict=True) if w >= 2.0])
    out.quantities.append(reported("w* (inf: never below 1 %)", good[0] if good else float("inf")))
    out.quantities += [reported(f"leak at w = {w:g}", v) for w, v in zip(widths, overall, strict=True) if w < 2.0]
    out.curves = [
        Curve(
            "Leak through a wall, and w*",
            "wall thickness, cells",
            "E dark / E lit",
            list(widths),
            # A logarithm has no room for no leak at all.
            {f"{a:g}°": [max(v, 1e-5) for v in worst[a]] for a in angles},
            log_x=True,
            log_y=True,
            limits={"1 %": 0.01},
            marks={f"w* = {good[0]:g}": good[0]} if good else {},
        )
    ]
    if not suite.traits.blockers:
        out.nature = _BLIND
    elif suite.traits.screen_space:
        out.nature = "what a wall hides from the camera does not block"
    scene = scenes.thin_wall(0.5 * cell)
    out.pictures["w = 0.5"] = suite.indirect(scene, samples=4, use_ao=False) * 0.1
    return out


# --- 6 … 9: motion --------------------------------------------------------------------------------------------------


def _log_ratio(image: np.ndarray, exact: np.ndarray) -> np.ndarray:
    epsilon = 0.01 * np.nanmean(exact)
    return np.log(np.maximum(image, 0.0) + epsilon) - np.log(exact + epsilon)


@test("6", "Flicker", "mean and P99 over pixels of std_t log(E+ε) − log(R+ε), ± ½ px jitter, then 1/64 px a frame", fast=False)
def flicker(suite: Suite) -> Finding:
    """The exact irradiance is evaluated for each frame's own pixels: that is the reprojection, and it takes the
    reference's own change away."""
    frames = 64 if suite.full else 16
    rng = np.random.default_rng(6)
    paths = {
        "± ½ px jitter": rng.uniform(-0.5, 0.5, (frames, 2)),
        "1/64 px a frame": np.stack([np.arange(frames) / 64.0, np.zeros(frames)], -1),
    }
    out = Finding()
    for name, shifts in paths.items():
        logs = []
        for shift in shifts:
            image, exact = _corner(suite, _moved(scenes.corner(), shift=shift, size=suite.size), samples=1)
            logs.append(_log_ratio(image, exact))
        series = np.array(logs)
        series = series[:, ~np.isnan(series).any(axis=0)]
        deviation = series.std(axis=0)
        out.quantities += [
            at_most(f"mean, {name}", deviation.mean(), 0.01),
            at_most(f"P99, {name}", np.percentile(deviation, 99), 0.05),
        ]
        out.curves.append(
            Curve(
                f"mean log error, {name}",
                "frame",
                "mean_p log(E/R)",
                [float(i) for i in range(frames)],
                {"mean": series.mean(axis=1).tolist()},
            )
        )
    return out


def _slide(suite: Suite, steps: int, size: tuple[int, int]) -> tuple[list[float], list[float], np.ndarray]:
    """‖ΔI‖₁ on the wall from step to step while the plate slides by a cell: measured, and exact; and the last frame."""
    cell = suite.cell(scenes.sliding_plate())
    changes, exact_changes = [], []
    before = None
    for i in range(steps + 1):
        offset = cell * i / steps
        scene = scenes.sliding_plate(offset=offset)
        r = 0.2
        plate = np.array([[-r, -r, 0], [r, -r, 0], [r, r, 0], [-r, r, 0]]) + [offset, 0.35, 0.1]
        exact = wall_reference(scene.camera, size, plate, 0.8 * 5.0, floor=0.14)
        image = _gray(suite.indirect(scene, samples=1, size=size, use_ao=False))
        if before is not None:
            good = ~np.isnan(exact) & ~np.isnan(before[1])
            changes.append(float(np.abs(image - before[0])[good].sum()))
            exact_changes.append(float(np.abs(exact - before[1])[good].sum()))
        before = image, exact
    return changes, exact_changes, before[0]


def _still(changes: list[float], exact_changes: list[float]) -> int:
    """Steps in which nothing changes but for rounding."""
    return sum(c < 1e-3 * np.mean(exact_changes) for c in changes)


@test("7", "Popping", "an object moves one cell in 64 steps: max_t‖ΔI‖₁/median_t‖ΔI‖₁ over the exact ratio", fast=False)
def popping(suite: Suite) -> Finding:
    """A lit plate slides before a wall; the wall's exact irradiance changes evenly. What knows the screen alone knows by
    pixels: its frame is four times as large, so that a step is an eighth of a pixel. In a frame of the suite's size the plate
    is six pixels wide and a step a thirtieth: in most of them not one pixel of it changes, which is reported."""
    steps = 64 if suite.full else 24
    size = tuple(4 * n for n in suite.size) if suite.traits.screen_space else suite.size
    changes, exact_changes, last = _slide(suite, steps, size)
    exact_ratio = max(exact_changes) / np.median(exact_changes)
    still = _still(changes, exact_changes)
    ratio = max(changes) / np.median(changes) if 2 * still < steps else float("inf")
    out = Finding([at_most("max/median ‖ΔI‖₁, relative to the exact one", ratio / exact_ratio, 3.0)])
    out.quantities += [
        reported(f"steps of {steps} in which nothing changes", still),
        reported("max/mean ‖ΔI‖₁", max(changes) / max(np.mean(changes), 1e-12)),
    ]
    if size != suite.size:
        small, small_exact, _ = _slide(suite, steps, suite.size)
        label = f"steps of {steps} in which nothing changes, {suite.size[0]} × {suite.size[1]} pixels"
        out.quantities.append(reported(label, _still(small, small_exact)))
    out.curves = [
        Curve(
            "Change from frame to frame",
            "step",
            "‖ΔI‖₁",
            [float(i) for i in range(steps)],
            {"measured": changes, "exact": exact_changes},
        )
    ]
    out.pictures["last frame"] = _picture(last, 1.0)
    return out


@test("8", "Grid snapping", "the camera moves by two cells: largest jump of mean E, relative")
def snapping(suite: Suite) -> Finding:
    """Against the exact mean of the wall that each frame shows."""
    steps = 32 if suite.full else 12
    cell = suite.cell(scenes.corner())
    gains = []
    for i in range(steps + 1):
        x = 2.0 * cell * i / steps
        scene = _moved(scenes.corner(), eye=(x, 3.0, 1.7), aim=(x, 0.3, 0.35))
        image, exact = _corner(suite, scene, samples=1)
        gains.append(float(np.nansum(image) / np.nansum(exact)))
    jump = float(np.abs(np.diff(gains)).max() / max(np.mean(gains), 1e-12))
    return Finding(
        [at_most("largest jump of mean E", jump, 0.005)],
        [Curve("Gain while the camera moves", "step", "g", [float(i) for i in range(steps + 1)], {"g": gains})],
    )


@test("9", "Off-screen light", "the lit floor pans out of view: max |E − E_ref|/E_ref of the wall's mean")
def off_screen(suite: Suite) -> Finding:
    """The wall stays in the picture while what lights it leaves."""
    angles = np.linspace(0.35, 2.6, 16 if suite.full else 8)
    gains = []
    for z in angles:
        scene = _moved(scenes.corner(), eye=(0.0, 3.0, 1.7), aim=(0.0, 0.0, float(z)))
        image, exact = _corner(suite, scene, samples=4)
        if (~np.isnan(exact)).sum() < 20:
            break
        gains.append(float(np.nansum(image) / np.nansum(exact)))
    worst = float(np.abs(np.array(gains) - 1.0).max())
    limited = suite.technique == "HYBRID" or not suite.traits.screen_space
    quantity = at_most("max |E − E_ref|/E_ref", worst, 0.10) if limited else reported("max |E − E_ref|/E_ref", worst)
    return Finding(
        [quantity],
        [Curve("Gain while the floor leaves", "aim height, m", "g", angles[: len(gains)].tolist(), {"g": gains})],
        nature=_SCREEN if suite.traits.screen_space else "",
    )


# --- 10, 11: sampling -----------------------------------------------------------------------------------------------


def _blur(image: np.ndarray, n: int = 7) -> np.ndarray:
    kernel = np.ones(n) / n
    image = np.apply_along_axis(lambda r: np.convolve(r, kernel, "valid"), 1, image)
    return np.apply_along_axis(lambda c: np.convolve(c, kernel, "valid"), 0, image)


@test("10", "Banding", "flat receiver, 16 sets, T less R: std(T − blur T)/mean T; CV of the mean over sets", fast=False)
def banding(suite: Suite) -> Finding:
    """A floor lit by one wall; the sets are other draws of the technique's samples."""
    b = scenes.SceneBuilder()
    b.quads(np.array([[[-2, -2, 0], [2, -2, 0], [2, 2, 0], [-2, 2, 0]]]), scenes.diffuse((0.8,) * 3))
    b.quads(np.array([[[-2, 2, 0], [2, 2, 0], [2, 2, 3], [-2, 2, 3]]])[:, ::-1], scenes.diffuse((0.8,) * 3))
    b.light(scenes.sun_light((0.0, 1.0, -0.35), 5.0))
    if suite.traits.screen_space:  # the wall must be in the picture; only the floor is looked at
        scene = b.build(scenes.perspective((0, -2.0, 4.5), (0, 0.9, 0.4), 0.9))
    else:
        scene = b.build(scenes.perspective((0, 0.0, 3.0), (0, -0.4, 0), 0.45))
    origin, direction = camera_rays(scene.camera, suite.size)
    ground, _, _ = hits(origin, direction, np.array([-1.8, -1.8, 0.0]), 3.6 * _X, 3.0 * _Y)
    image = _gray(suite.indirect(scene, samples=16, gather_scale=1, use_ao=False))
    # The exact light has a curve of its own, 1.3 % of the mean where the wall is near: what is left beside that is a band.
    top = 3.0
    if suite.traits.screen_space:  # of the wall as much as the picture shows
        up = direction[-1, 0] + 0.5 * (direction[-1, 0] - direction[-2, 0])
        top = origin[-1, 0, 2] + (2.0 - origin[-1, 0, 1]) * up[2] / up[1]
    radiosity = 0.8 * 5.0 / np.hypot(1.0, 0.35)
    wall = np.array([[-2.0, 2, 0], [2, 2, 0], [2, 2, top], [-2, 2, top]])
    floor = np.isfinite(ground)
    points = (origin + ground[..., None] * direction)[floor]
    exact = np.zeros(ground.shape)
    exact[floor] = radiosity / np.pi * polygon_form_factor(points, np.broadcast_to(_Z, points.shape), wall)
    inner = _blur(floor.astype("f8")) > 0.999
    error = image - exact
    left = (error[3:-3, 3:-3] - _blur(error))[inner]
    mean = image[3:-3, 3:-3][inner].mean()
    out = Finding([at_most("std(T − blur T)/mean T", float(np.std(left) / max(mean, 1e-12)), 0.01)])
    out.pictures["receiver"] = _picture(image, 0.8 / max(mean, 1e-12))
    path = suite.traits.set
    if path and has_setting(path):
        base, name = int(suite.settings().get(path)), path.replace(".", "__")
        sets = [
            float(np.mean(_gray(suite.indirect(scene, samples=1, use_ao=False, **{name: base + k * suite.traits.stride}))[floor]))
            for k in range(16)
        ]
        out.quantities.append(at_most("CV over 16 sets", float(np.std(sets) / max(np.mean(sets), 1e-12)), 0.02))
    else:
        out.note = "it draws no set of samples: only the first number applies"
    return out


@test("11", "Singularity in a corner", "90° corner: max T/P99 R; 1 − g")
def singularity(suite: Suite) -> Finding:
    """Near virtual lights sparkle (max) or are clamped (lost gain)."""
    image, exact = _corner(suite, samples=32, size=(96, 54))
    g = float(np.nansum(image) / np.nansum(exact))
    out = Finding(
        [at_most("max T / P99 R", float(np.nanmax(image) / np.nanpercentile(exact, 99)), 2.0), at_most("1 − g", 1.0 - g, 0.05)]
    )
    out.quantities += [reported("g", g), reported("relMSE on the wall", _rel_mse(image, exact))]
    scale = 0.8 / float(np.nanmax(exact))
    out.pictures = {"technique": _picture(image, scale), "exact": _picture(exact, scale)}
    return out


# --- 12 … 14: invariance --------------------------------------------------------------------------------------------


@test("12", "Scale", "10⁻³ … 10³ × lengths, power × s²: relMSE(T_s, T_1); NaN")
def scale(suite: Suite) -> Finding:
    """Millimetres and kilometres look alike."""

    def box(s: float) -> np.ndarray:
        scene = scenes.transformed(scenes.cornell(), np.diag([s, s, s, 1.0]))
        return suite.render(scene, "Combined", samples=4, length=s).passes["Combined"][..., :3]

    one = box(1.0)
    out = Finding()
    bad = 0
    for s in (1e-3, 1e-2, 1e2, 1e3) if suite.full else (1e-3, 1e3):
        other = box(s)
        bad += int((~np.isfinite(other)).sum())
        out.quantities.append(at_most(f"relMSE at {s:g}", rel_mse(other, one), 1e-4))
        out.pictures[f"lengths × {s:g}"] = 0.5 * other
    out.pictures["lengths × 1"] = 0.5 * one
    out.quantities.append(at_most("values that are not finite", bad, 0))
    return out


@test("13", "Resolution", "screen ½–2×, map or grid 32–256: drift of g; error must not grow by more than 5 %", fast=False)
def resolution(suite: Suite) -> Finding:
    """More resolution is never worse."""
    out = Finding()
    screens = [(48 * k, 27 * k) for k in (1, 2, 4)]
    pairs = [_corner(suite, size=s, samples=16) for s in screens]
    gains = [float(np.nansum(i) / np.nansum(e)) for i, e in pairs]
    out.quantities.append(at_most("drift of g, screen ½–2×", (max(gains) - min(gains)) / max(np.mean(gains), 1e-12), 0.03))
    out.curves = [Curve("Gain by width of the picture", "pixels", "g", [float(w) for w, _ in screens], {"g": gains}, log_x=True)]
    path = suite.traits.grid or suite.traits.map
    if not path or not has_setting(path):
        out.note = "it has no grid or map of its own"
        return out
    most = next(m.high for p, _, m in walk() if p == path)
    sizes = [n for n in ((32, 64, 128, 256) if suite.full else (32, 64, 128)) if n <= most]
    name = path.replace(".", "__")
    pairs = [_corner(suite, samples=64, **{name: n}) for n in sizes]
    gains = [float(np.nansum(i) / np.nansum(e)) for i, e in pairs]
    errors = [_rel_mse(i, e) for i, e in pairs]
    out.quantities.append(
        at_most(f"drift of g, {path} {sizes[0]}–{sizes[-1]}", (max(gains) - min(gains)) / max(np.mean(gains), 1e-12), 0.03)
    )
    growth = max(b / max(a, 1e-12) for a, b in itertools.pairwise(errors))
    out.quantities.append(at_most("largest growth of relMSE from one size to the next", growth, 1.05))
    out.curves += [
        Curve(f"Error by {path}", path, "relMSE", [float(n) for n in sizes], {"relMSE": errors}, log_x=True, log_y=True),
        Curve(f"Gain by {path}", path, "g", [float(n) for n in sizes], {"g": gains}, log_x=True),
    ]
    return out


@test("14", "Grid rotation", "the scene turned by 0–45°: (max − min)/mean E")
def rotation(suite: Suite) -> Finding:
    """A grid has axes; light does not."""
    angles = np.arange(0, 46, 5) if suite.full else np.array([0, 15, 30, 45])
    means = []
    for angle in angles:
        a = np.radians(angle)
        turn = np.eye(4)
        turn[:2, :2] = [[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]
        image, _ = _corner(suite, scenes.transformed(scenes.corner(), turn), samples=4, turn=turn)
        means.append(float(np.nanmean(image)))
    spread = (max(means) - min(means)) / max(np.mean(means), 1e-12)
    return Finding(
        [at_most("(max − min)/mean E", spread, 0.10)],
        [Curve("Mean irradiance by angle", "degrees", "mean E/π", angles.tolist(), {"E": means})],
    )


# --- 15 … 18: behaviour ---------------------------------------------------------------------------------------------


@test("15", "Light switched on", "frames to 90 %; overshoot")
def switch_on(suite: Suite) -> Finding:
    """One renderer, frame after frame, as the viewport: whatever is kept must follow."""
    dark, lit = scenes.cornell(power=0.0), scenes.cornell(power=60.0)
    dark.meshes, dark.materials, dark.instances, dark.world = lit.meshes, lit.materials, lit.instances, lit.world
    for _ in range(2):
        suite.indirect(dark, samples=1)
    means = [float(suite.indirect(lit, samples=1).mean()) for _ in range(24)]
    final = float(np.mean(means[-4:]))
    frames = next((i + 1 for i, m in enumerate(means) if m >= 0.9 * final), 99)
    return Finding(
        [
            at_most("frames to 90 %", frames, 8),
            at_most("overshoot", max(means) / max(final, 1e-12) - 1.0, 0.05),
            Quantity("final mean E/π (must not be dark)", final, 1e-6),
        ],
        [Curve("After the light goes on", "frame", "mean E/π", [float(i + 1) for i in range(24)], {"E": means})],
    )


@test("16", "Determinism", "the same input twice, new renderers: max |a − b|")
def determinism(suite: Suite) -> Finding:
    """Bit for bit."""
    outputs = ("Combined", "Diffuse Indirect", "Ambient Occlusion")
    settings = suite.settings(samples=3)
    runs = []
    for _ in range(2):
        with Studio(suite.studio.thread) as studio:
            runs.append(studio.render(scenes.cornell(light="area"), settings, outputs, suite.size).passes)
    differences = {n: np.abs(runs[0][n].astype("f8") - runs[1][n]) for n in outputs}
    out = Finding([at_most(f"{n}: max |a − b|", d.max(), 0.0) for n, d in differences.items()])
    out.pictures = {"first": 0.5 * runs[0]["Combined"][..., :3], "second": 0.5 * runs[1]["Combined"][..., :3]}
    out.pictures["difference × 1000"] = 1e3 * differences["Combined"][..., :3]
    return out


@test("17", "Linearity", "power × k; two lights against the sum of each: relative difference", fast=False)
def linearity(suite: Suite) -> Finding:
    """Every light pass scales; two lights add up, the direct pass pixel by pixel, the indirect one in the mean."""
    names = ("Combined", "Diffuse Direct", "Diffuse Indirect")
    a = suite.render(scenes.cornell(power=60.0), *names, samples=2).passes
    b = suite.render(scenes.cornell(power=60e3), *names, samples=2).passes
    out = Finding()
    for name in names:
        difference = np.abs(a[name][..., :3] * 1e3 - b[name][..., :3]).max() / max(b[name][..., :3].max(), 1e-12)
        out.quantities.append(at_most(f"{name}, power × 1000", difference, 1e-3))

    def box(*lights, **values):
        scene = scenes.cornell(blocks=False)
        scene.lights = list(lights)
        samples = 64 if suite.full else 8
        return suite.render(scene, "Diffuse Direct", "Diffuse Indirect", samples=samples, use_ao=False, **values).passes

    one, two = scenes.point_light((-0.4, 0, 1.5), 40.0), scenes.spot_light((0.3, 0, 1.9), (0, 0, 0), 90.0, 1.4, 0.3)
    own = {suite.traits.own.replace(".", "__"): True} if suite.traits.own else {}
    both, first, second = box(one, two, **own), box(one, **own), box(two, **own)
    total = first["Diffuse Direct"] + second["Diffuse Direct"]
    out.quantities.append(at_most("two lights, direct, max", np.abs(both["Diffuse Direct"] - total).max() / total.max(), 1e-3))
    indirect = first["Diffuse Indirect"].mean() + second["Diffuse Indirect"].mean()
    out.quantities.append(
        at_most("two lights, indirect, mean", abs(both["Diffuse Indirect"].mean() / max(indirect, 1e-12) - 1.0), 1e-3)
    )
    for title, passes in (("one light", first), ("the other", second), ("both", both)):
        out.pictures[f"{title}, indirect"] = passes["Diffuse Indirect"][..., :3] / max(both["Diffuse Indirect"].max(), 1e-12)
    if own:
        shared = box(one, two)["Diffuse Indirect"].mean()
        out.quantities.append(reported(f"the same without {suite.traits.own}", abs(shared / max(indirect, 1e-12) - 1.0)))
    return out


def awkward_scenes() -> dict[str, Scene]:
    """Background only, nothing at all, degenerate triangles, zero normals, zero scale, vertices that are nowhere."""
    camera = scenes.perspective((0, -4, 1), (0, 0, 1), 0.8)
    mesh = scenes.mesh_from_quads(scenes.box_quads((-0.5, -0.5, 0), (0.5, 0.5, 1)))
    mesh.normals = np.zeros_like(mesh.normals)
    flat = scenes.mesh_from_quads(np.zeros((1, 4, 3)))
    broken = scenes.mesh_from_quads(scenes.box_quads((-0.2, -0.2, 1.2), (0.2, 0.2, 1.5)))
    broken.positions[3] = np.nan
    broken.__post_init__()
    b = scenes.SceneBuilder()
    for part in (mesh, flat, broken):
        b.add(part, scenes.principled(Metallic=0.5, Roughness=0.0))
    b.add(mesh, scenes.diffuse((1, 1, 1)), np.zeros((4, 4)))
    for light in (
        scenes.point_light((0.5, -0.5, 0.5), 10.0),
        scenes.sun_light((0, 0, -1), 1.0),
        scenes.area_light((0, 0, 2), (0, 0, 0), 10.0, (0.0, 0.0)),
    ):
        b.light(light)
    return {
        "nothing": scenes.SceneBuilder().build(camera),
        "background only": scenes.SceneBuilder().build(camera, scenes.world((1, 1, 1))),
        "degenerate": b.build(camera, scenes.world((0.2, 0.2, 0.2))),
        "box": scenes.cornell(),
    }


@test("18", "Non-finite values", "NaN and Inf in every texture of the graph and in every pass", fast=False)
def non_finite(suite: Suite) -> Finding:
    """The film drops what is not a number, so its inputs are scanned too."""
    out = Finding()
    for name, scene in awkward_scenes().items():
        passes = suite.render(scene, *OUTPUTS, samples=2, size=(32, 18)).passes
        bad = sum(int((~np.isfinite(p)).sum()) for p in passes.values())
        found = {n: int((~np.isfinite(t)).sum()) for n, t in suite.studio.textures().items()}
        wrong = {n: c for n, c in found.items() if c}
        out.quantities.append(at_most(f"{name}: passes", bad, 0))
        out.pictures[name] = np.nan_to_num(passes["Combined"][..., :3])
        out.quantities.append(at_most(f"{name}: {len(found)} textures", sum(wrong.values()), 0))
        if wrong:
            out.note += f"{name}: {', '.join(f'{n} {c}' for n, c in wrong.items())}. "
    return out
