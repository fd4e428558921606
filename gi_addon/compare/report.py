# SPDX-License-Identifier: GPL-3.0-or-later
"""The report: one HTML file that works offline, from scene records, pictures and references."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .. import presets
from . import charts
from .metrics import error_map
from .page import bytes_uri, chart, data_uri, document, esc, heat, number, table, wall, wall_script
from .references import Halves
from .sheet import exposure
from .study import COMPARED, Run

# Charts per scene: component and the reference it is fair to.
COMPONENTS = (
    ("Combined", "Rinf"),
    ("Combined", "R1"),
    ("Diffuse Indirect", "R1"),
    ("Diffuse Indirect", "Rinf"),
    ("Glossy Indirect", "R1"),
)
_SIGN = {"R1": "R1", "Rinf": "R∞"}
_HEAT = (1e-4, 10.0)
_WALL = ("Combined", "Diffuse Indirect", "Glossy Indirect")


@dataclass
class Measured:
    """One scene's record with the arrays behind it."""

    record: dict
    runs: list[Run]
    references: dict[str, Halves]


def _wall(index: int, scene: Measured) -> tuple[str, dict]:
    """The image wall's HTML and its pictures: pass -> name -> {image, heat}."""
    pictures: dict[str, dict[str, dict[str, str]]] = {}
    reference = scene.references["Rinf"]
    for name in _WALL:
        target = reference.mean(name) if name in reference.a else None
        if target is None or target.max() <= 0:
            continue
        scale = exposure(target)
        shown = pictures.setdefault(name, {})
        shown["Cycles R∞ (reference)"] = {"image": data_uri(target, scale=scale)}
        if "R1" in scene.references:
            shown["Cycles R1, one bounce (reference)"] = {"image": data_uri(scene.references["R1"].mean(name), scale=scale)}
        for run in _shown(scene):
            test = run.passes.get(name)
            if test is None:
                continue
            errors = error_map(test, reference.a[name], reference.b[name]).mean(axis=-1)
            label = f"{run.candidate.method}: {run.candidate.label} ({number(run.ms)} ms)"
            shown[label] = {"image": data_uri(test, scale=scale), "heat": bytes_uri(heat(errors[::-1], *_HEAT))}
    bar = bytes_uri(np.repeat(heat(np.geomspace(*_HEAT, 256)[None], *_HEAT), 8, axis=0))
    body = wall(
        index, scene.record["size"],
        f'squared relative error against R∞, {_HEAT[0]:g} <img src="{bar}" width=200 height=10 alt="colour scale"> '
        f"{_HEAT[1]:g}, logarithmic",
    )  # fmt: skip
    return body, pictures


def _shown(scene: Measured) -> list[Run]:
    """The runs whose pictures are worth showing: of each method the first, the cheapest and the most accurate."""
    out: list[Run] = []
    scores = {
        id(r): c["scores"].get("Combined", {}).get("Rinf", {}).get("rel_mse", math.inf)
        for r, c in zip(scene.runs, scene.record["candidates"], strict=True)
    }
    for method in dict.fromkeys(r.candidate.method for r in scene.runs):
        own = [r for r in scene.runs if r.candidate.method == method]
        picks = (min(own, key=lambda r: r.ms), min(own, key=lambda r: scores[id(r)]), own[0])
        out += list({id(r): r for r in picks}.values())
    return out


def verdict_lines(record: dict) -> list[str]:
    """In words: who is on the front, what beats or misses the nulls, where the peers are."""
    lines = []
    for component, reference in COMPONENTS:
        s = charts.summary(record, component, reference)
        if not s["front"]:
            continue
        front = "; ".join(
            f"{i} {p['method']} ({p['label']}) {number(p['x'])} ms, relMSE {number(p['y'])}" for i, p in enumerate(s["front"], 1)
        )
        lines.append(f"{component} against {_SIGN[reference]}: on the Pareto front are {front}.")
        points = charts.points_of(record, component, reference, "rel_mse")
        worse = sorted({p["method"] for p in points} - {p["method"] for p in points if p["y"] < s["constant"]})
        if worse:
            lines.append(
                f"{component} against {_SIGN[reference]}: no setting of {', '.join(worse)} beats the best constant "
                f"(relMSE {number(s['constant'])}): worse than nothing."
            )
        best = min((p["y"] for p in points if p["y"] > 0), default=0.0)
        if s["noise_floor"] > 0.05 * best:
            lines.append(
                f"{component} against {_SIGN[reference]}: the reference's noise ({number(s['noise_floor'])}) is over 5 % of the "
                f"best error ({number(best)}): small errors need more reference samples."
            )
    return lines


def yardstick(record: dict) -> list[list]:
    """Per technique the least error within ¼, 1 and 4 times the time of Cycles at 1 sample with OpenImageDenoise."""
    points = charts.points_of(record, "Combined", "Rinf", "rel_mse")
    unit = next((p for p in points if p["method"] == "Cycles + OIDN" and p["options"].get("samples") == 1), None)
    if unit is None:
        return []
    rows: list[list] = [["Cycles 1 spp + OIDN", f"{number(unit['x'])} ms", number(unit["y"]), "", ""]]
    for method in dict.fromkeys(p["method"] for p in points):
        own = [p for p in points if p["method"] == method]
        cells = []
        for times in (0.25, 1.0, 4.0):
            fit = [p for p in own if p["x"] <= times * unit["x"]]
            best = min(fit, key=lambda p: p["y"]) if fit else None
            cells.append(f"{number(best['y'])} ({best['label']}, {best['x'] / unit['x']:.2g}×)" if best else "none that fast")
        rows.append([method, "", *cells])
    return rows


def preset_rows(record: dict) -> list[list]:
    """Per technique and preset: its time in units of Cycles at 1 sample with OpenImageDenoise, its error, and what both are
    meant to be: PREVIEW below the best constant, BALANCED and FINAL no worse than Cycles at 1 and 4 samples, denoised."""
    points = charts.points_of(record, "Combined", "Rinf", "rel_mse")
    denoised = {p["options"].get("samples"): p for p in points if p["method"] == "Cycles + OIDN"}
    own = [p for p in points if p["options"].get("preset") in presets.SHARES]
    if not own or 1 not in denoised:
        return []
    limits = {
        "PREVIEW": (own[0]["score"]["constant"], "best constant"),
        "BALANCED": (denoised[1]["y"], "Cycles 1 spp + OIDN"),
        "FINAL": (denoised[4]["y"] if 4 in denoised else None, "Cycles 4 spp + OIDN"),
    }

    def judged(value: float, limit: float | None) -> str:
        return f"<span class={'ok' if limit is None or value <= limit else 'fail'}>{number(value)}</span>"

    rows: list[list] = []
    for p in own:
        preset = p["options"]["preset"]
        times = p["x"] / denoised[1]["x"]
        limit, whose = limits[preset]
        rows.append([
            p["method"], presets.PRESETS[preset].label, f"{number(p['x'])} ms", judged(times, presets.SHARES[preset]) + " ×",
            f"≤ {presets.SHARES[preset]:g} ×", judged(p["y"], limit),
            f"≤ {number(limit)} ({whose})" if limit is not None else f"{whose} was not measured", number(p["score"]["gain"]),
        ])  # fmt: skip
    return rows


def figures(scenes: list[Measured]) -> dict[str, object]:
    """Every chart by a file name."""
    out: dict[str, object] = {}
    for scene in scenes:
        stem = Path(scene.record["scene"]).stem.replace("builtin:", "")
        for component, reference in COMPONENTS:
            if charts.points_of(scene.record, component, reference, "rel_mse"):
                tag = f"{stem}-{component.lower().replace(' ', '-')}-{reference}"
                for metric in ("rel_mse", "flip"):
                    if charts.points_of(scene.record, component, reference, metric):
                        out[f"{tag}-{metric.replace('_', '')}"] = charts.pareto_figure(scene.record, component, reference, metric)
        if any(c["passes_ms"] for c in scene.record["candidates"]):
            out[f"{stem}-time"] = charts.split_figure(scene.record)
    return out


def _scene_html(index: int, scene: Measured, drawn: dict[str, object]) -> tuple[str, dict]:
    record = scene.record
    stem = Path(record["scene"]).stem.replace("builtin:", "")
    shown, pictures = _wall(index, scene)
    samples = record["reference_samples"]
    made = f"with {samples} samples each" if samples else "rendered elsewhere"
    made += "".join(f"; {method}: {version}" for method, version in record.get("peers", {}).items())
    parts = [
        f'<h2 id="s{index}">{esc(record["scene"])}</h2>',
        f"<p class=quiet>{record['size'][0]} × {record['size'][1]} pixels, {record['triangles']} triangles; Cycles references of "
        f"two halves {made}.</p>",
        "<ul>" + "".join(f"<li>{esc(line)}</li>" for line in verdict_lines(record)) + "</ul>",
        shown,
        "<h3>Speed against accuracy</h3><p class=quiet>Bars are 95 % intervals, the step line is the Pareto front, its numbers "
        "those of the list above. Candidates with several bounces are left out where one bounce is the reference.</p>",
    ]
    for component, reference in COMPONENTS:
        tag = f"{stem}-{component.lower().replace(' ', '-')}-{reference}"
        both = [n for n in (f"{tag}-relmse", f"{tag}-flip") if n in drawn]
        if both:
            parts.append("<div class=cols>" + "".join(f"<div>{chart(drawn[n], f'f{index}-{n}')}</div>" for n in both) + "</div>")
    rows = yardstick(record)
    if rows:
        parts += [
            "<h3>Within the time of Cycles at 1 sample with OpenImageDenoise</h3><p class=quiet>The least relMSE of Combined "
            "against R∞ that each method reaches in that share of the time.</p>",
            table(["method", "time", "≤ ¼ ×", "≤ 1 ×", "≤ 4 ×"], rows),
        ]
    rows = preset_rows(record)
    if rows:
        parts += [
            "<h3>Presets</h3><p class=quiet>Time as a multiple of Cycles at 1 sample with OpenImageDenoise and relMSE of "
            "Combined against R∞, each beside what the preset is meant for.</p>",
            table(["technique", "preset", "time", "×", "meant", "relMSE", "meant", "gain"], rows),
        ]
    methods = list(dict.fromkeys(c["method"] for c in record["candidates"]))
    volumes = []
    for component, reference in COMPONENTS:
        s = charts.summary(record, component, reference)
        if s["front"]:
            volumes.append([f"{component} vs {_SIGN[reference]}", *(number(s["hypervolume"].get(m, math.nan)) for m in methods)])
    parts += [
        "<h3>Hypervolume</h3><p class=quiet>Decades of time × decades of error between a method's front and the corner of "
        "(slowest point, best constant). Larger is better; 0: never better than the constant.</p>",
        table(["component", *methods], volumes),
    ]
    if f"{stem}-time" in drawn:
        parts += ["<h3>Where the time goes</h3>", chart(drawn[f"{stem}-time"], f"t{index}")]
    parts.append("<h3>Per pass</h3>")
    for name in COMPARED:
        lines = []
        for c in record["candidates"]:
            for kind, s in c["scores"].get(name, {}).items():
                worse = s["rel_mse"] > s["constant"]
                lines.append(
                    [
                        f"{c['method']}: {c['label']}",
                        _SIGN[kind],
                        float(c["ms"]),
                        number(s["gain"]),
                        f"<span class={'fail' if worse else 'ok'}>{number(s['rel_mse'])}</span>",
                        f"{number(s['low'])} … {number(s['high'])}",
                        number(s["trimmed"]),
                        number(s["shape"]),
                        number(s["best_scale"]),
                        number(s["flip"]),
                        number(s["flip_p95"]),
                        number(s["black"]),
                        number(s["constant"]),
                        number(s["noise_floor"]),
                    ]
                )
        if lines:
            parts += [
                f"<details{' open' if name == 'Combined' else ''}><summary>{name}</summary>",
                table(
                    [
                        "method and settings",
                        "against",
                        "ms",
                        "gain",
                        "relMSE",
                        "95 % interval",
                        "trimmed",
                        "shape error",
                        "best scale",
                        "FLIP",
                        "FLIP P95",
                        "black",
                        "constant",
                        "noise floor",
                    ],
                    lines,
                ),
                "</details>",
            ]
    return "".join(parts), pictures


def write(
    folder: Path, head: dict, scenes: list[Measured], extra: str = "", *, images: bool = True
) -> tuple[list[Path], list[str]]:
    """report.html and, with ``images``, the charts as pictures in ``folder``; returns files and notes. ``extra`` is HTML
    put at the end."""
    folder.mkdir(parents=True, exist_ok=True)
    drawn = figures(scenes)
    bodies, walls = [], []
    for i, scene in enumerate(scenes):
        body, pictures = _scene_html(i, scene, drawn)
        bodies.append(body)
        walls.append(pictures)
    links = "".join(f'<a href="#s{i}">{esc(s.record["scene"])}</a>' for i, s in enumerate(scenes))
    top = (
        f"<h1>Quartet GI: speed against accuracy</h1><p class=lead>Quartet {esc(head['version'])} on {esc(head['driver'])}, "
        f"{esc(head['date'])}. Errors are against unbiased Cycles; R1 has one diffuse and one glossy bounce, R∞ has 32. Peers "
        f"bounce as often as by default and are compared with R∞ only; so is light that no bounce changes. Nothing is scaled to "
        f"fit: the gain column says so.</p><p class=quiet>{esc(head.get('calibration', ''))}</p>"
        f"<nav>{links}</nav>"
    )
    path = folder / "report.html"
    path.write_text(document("Quartet report", top + "".join(bodies) + extra, charts=True, scripts=wall_script(walls)))
    files, note = charts.write_images(drawn, folder / "charts") if images and drawn else ([], "")
    return [path, *files], [note] if note else []
