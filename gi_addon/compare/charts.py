# SPDX-License-Identifier: GPL-3.0-or-later
"""Speed against accuracy: Pareto fronts, hypervolumes, and the charts of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .page import COLORS, INK, esc, number

_SYMBOLS = {
    "RSM": "circle",
    "LPV": "square",
    "VCT": "diamond",
    "SSDO": "triangle-up",
    "HYBRID": "star",
    "AUTO": "hexagram",
    "Cycles": "x",
    "Cycles + OIDN": "cross",
    "EEVEE": "pentagon",
}


def pareto(points: Sequence[tuple[float, float]]) -> list[int]:
    """Indices of the points that none beats in both time and error, by rising time. Points with a value that is not
    positive and finite can't be on it: an error of 0 or less is noise."""
    usable = [i for i, p in enumerate(points) if all(math.isfinite(v) and v > 0 for v in p)]
    front, best = [], math.inf
    for i in sorted(usable, key=lambda i: points[i]):
        if points[i][1] < best:
            best = points[i][1]
            front.append(i)
    return front


def hypervolume(points: Sequence[tuple[float, float]], corner: tuple[float, float]) -> float:
    """Area in decades² that a method dominates, from its front to ``corner`` (slowest time, error of the best constant):
    larger is better, 0 is a method never better than the constant."""
    front = [points[i] for i in pareto(points)]
    inside = [(math.log10(x), math.log10(y)) for x, y in front if x < corner[0] and y < corner[1]]
    right, top = math.log10(corner[0]), math.log10(corner[1])
    area = 0.0
    for i, (x, y) in enumerate(inside):
        end = inside[i + 1][0] if i + 1 < len(inside) else right
        area += (end - x) * (top - y)
    return area


def points_of(record: dict, component: str, reference: str, metric: str) -> list[dict]:
    """The candidates of a scene record that have a figure for this component, with ``x`` (ms) and ``y``. Peers bounce on,
    and so do candidates with more bounces: one bounce is no reference for them."""
    out = []
    for c in record["candidates"]:
        if reference == "R1" and (not c["technique"] or c["bounces"] > 1):
            continue
        s = c["scores"].get(component, {}).get(reference)
        if s is not None and s.get(metric) is not None and math.isfinite(s[metric]):
            out.append({**c, "score": s, "x": c["ms"], "y": s[metric]})
    return out


def summary(record: dict, component: str, reference: str) -> dict[str, Any]:
    """Front, nulls and hypervolume by method of one chart."""
    points = points_of(record, component, reference, "rel_mse")
    xy = [(p["x"], p["y"]) for p in points]
    if not points:
        return {"front": [], "hypervolume": {}, "constant": None, "black": None, "noise_floor": None}
    null = points[0]["score"]
    corner = (max(x for x, _ in xy) * 1.0001, max(null["constant"], 1e-9))
    methods = list(dict.fromkeys(p["method"] for p in points))
    return {
        "front": [points[i] for i in pareto(xy)],
        "hypervolume": {
            m: hypervolume([q for p, q in zip(points, xy, strict=True) if p["method"] == m], corner) for m in methods
        },
        "constant": null["constant"],
        "black": null["black"],
        "noise_floor": null["noise_floor"],
    }


def pareto_figure(record: dict, component: str, reference: str, metric: str = "rel_mse"):
    """Milliseconds against error, all candidates, the front, and the nulls as horizontal lines."""
    import plotly.graph_objects as go

    points = points_of(record, component, reference, metric)
    figure = go.Figure()
    positive = [p["y"] for p in points if p["y"] > 0]
    floor = 0.5 * min(positive) if positive else 1e-6
    for method in dict.fromkeys(p["method"] for p in points):
        own = [p for p in points if p["method"] == method]
        bars = None
        if metric == "rel_mse":
            bars = {
                "type": "data",
                "symmetric": False,
                "thickness": 1,
                "width": 2,
                "array": [max(0.0, p["score"]["high"] - p["y"]) for p in own],
                "arrayminus": [max(0.0, p["y"] - max(p["score"]["low"], floor)) for p in own],
            }
        figure.add_trace(
            go.Scatter(
                x=[p["x"] for p in own],
                y=[max(p["y"], floor) for p in own],
                name=method,
                mode="markers",
                error_y=bars,
                marker={
                    "color": COLORS.get(method),
                    "symbol": _SYMBOLS.get(method, "circle"),
                    "size": 10,
                    "line": {"width": 1, "color": INK},
                },
                hovertext=[
                    f"<b>{esc(p['method'])}</b><br>{esc(p['label'])}"
                    f"<br>{p['x']:.4g} ms ± {p['mad']:.2g}, P95 {number(p['p95'])} ({p['frames']} frames)"
                    f"<br>relMSE {number(p['score']['rel_mse'])} [{number(p['score']['low'])} … {number(p['score']['high'])}]"
                    f"<br>gain {number(p['score']['gain'])}, FLIP {number(p['score']['flip'])}"
                    + (f"<br>{p['mib']:.1f} MiB" if p.get("mib") else "")
                    for p in own
                ],
                hoverinfo="text",
            )
        )
    front = pareto([(p["x"], p["y"]) for p in points])
    if front:
        figure.add_trace(
            go.Scatter(
                x=[points[i]["x"] for i in front],
                y=[points[i]["y"] for i in front],
                mode="lines",
                name="Pareto front",
                line={"color": INK, "width": 1.5, "shape": "hv"},
                hoverinfo="skip",
            )
        )
    for rank, i in enumerate(front if metric == "rel_mse" else (), 1):
        place = {"x": math.log10(points[i]["x"]), "y": math.log10(points[i]["y"])}
        figure.add_annotation(**place, text=str(rank), showarrow=False, xshift=-12, yshift=-12, font={"size": 11})
    if points and metric == "rel_mse":
        null = points[0]["score"]
        ends = [min(p["x"] for p in points) / 1.3, max(p["x"] for p in points) * 1.3]
        lines = (
            ("black", "black", "dot"),
            ("constant", "best constant", "dash"),
            ("noise_floor", "reference's noise", "dashdot"),
        )
        for key, text, dash in lines:
            if null[key] > 0 and (key != "noise_floor" or null[key] > 0.1 * floor):
                figure.add_trace(
                    go.Scatter(
                        x=ends,
                        y=[null[key]] * 2,
                        mode="lines",
                        name=text,
                        line={"color": "#888", "dash": dash, "width": 1},
                        hovertext=f"{text}: relMSE {number(null[key])}",
                        hoverinfo="text",
                    )
                )
    names = {"rel_mse": "relMSE (debiased)", "flip": "HDR-FLIP, mean"}
    sign = {"Rinf": "R∞"}.get(reference, reference)
    figure.update_layout(
        template="simple_white",
        height=420,
        margin={"l": 64, "r": 16, "t": 44, "b": 50},
        title={"text": f"{record['scene']}: {component} against {sign}", "font": {"size": 14}},
        xaxis={"type": "log", "title": "ms for the picture", "showgrid": True},
        yaxis={"type": "log", "title": names[metric], "showgrid": True},
        legend={"orientation": "h", "y": -0.2},
    )
    return figure


def split_figure(record: dict):
    """Where each technique's time goes: ms by pass of its picture at the middle of its candidates, stacked."""
    import plotly.graph_objects as go

    chosen = {}
    for c in record["candidates"]:
        if c["passes_ms"]:
            chosen.setdefault(c["method"], []).append(c)
    middle = {m: sorted(cs, key=lambda c: c["ms"])[len(cs) // 2] for m, cs in chosen.items()}
    titles = list(dict.fromkeys(t for c in middle.values() for t in c["passes_ms"]))
    bars = [f"{m}<br><sub>{esc(c['label'])}</sub>" for m, c in middle.items()]
    figure = go.Figure(
        [go.Bar(y=bars, x=[c["passes_ms"].get(t, 0.0) for c in middle.values()], name=t, orientation="h") for t in titles]
    )
    figure.update_layout(
        template="simple_white",
        barmode="stack",
        height=140 + 70 * len(bars),
        margin={"l": 190, "r": 16, "t": 40, "b": 44},
        title={"text": f"{record['scene']}: time by pass", "font": {"size": 14}},
        xaxis={"title": "ms, each pass waited for"},
    )
    return figure


def write_images(figures: dict[str, Any], folder: Path) -> tuple[list[Path], str]:
    """Each figure as PNG and SVG; with what is missing, if they can't be made: (files, '' or the reason)."""
    try:
        import kaleido
    except ImportError:
        return [], "PNG and SVG of the charts need the kaleido package: pip install 'quartet-gi[report]'"
    folder.mkdir(parents=True, exist_ok=True)
    specs = [
        {"fig": figure, "path": str(folder / f"{name}.{kind}"), "opts": {"format": kind, "width": 900, "height": 480, "scale": 1}}
        for name, figure in figures.items()
        for kind in ("png", "svg")
    ]
    try:
        kaleido.write_fig_from_object_sync(specs)
    except Exception as error:
        reason = next(iter(str(error).strip().splitlines()), type(error).__name__)
        return [], f"no PNG and SVG of the charts: {reason} (a Chromium or Chrome browser draws them)"
    return [Path(s["path"]) for s in specs], ""
