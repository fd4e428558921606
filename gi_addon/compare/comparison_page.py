# SPDX-License-Identifier: GPL-3.0-or-later
"""One frame of Quartet beside Cycles as a page: what *Compare with Cycles* leaves for the browser.

It needs nothing that Blender does not ship, so its charts are plain SVG; the report of ``quartet bench`` has more.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from . import svg
from .metrics import Score
from .page import COLORS, bytes_uri, data_uri, document, esc, magma, number, table, wall, wall_script
from .sheet import exposure

_COLUMNS = (
    "pass", "gain", "relMSE", "trimmed", "shape error", "best scale", "FLIP", "FLIP P95", "black", "constant", "noise floor",
)  # fmt: skip
_QUARTET, _CONSTANT, _NOISE = "Quartet", "best constant", "Cycles' own noise"


@dataclass
class Side:
    """What the page says besides scores and pictures. ``seconds`` by engine; ``passes`` (title, milliseconds per run or None,
    MiB) of Quartet's frame; ``skipped`` (pass, why); ``settings`` (path, value, default) that are not the default;
    ``notes`` to the user, ``approximated`` (material, what of it)."""

    made: str = ""
    seconds: Mapping[str, float] = field(default_factory=dict)
    passes: Sequence[tuple[str, float | None, float]] = ()
    skipped: Sequence[tuple[str, str]] = ()
    settings: Sequence[tuple[str, str, str]] = ()
    notes: Sequence[str] = ()
    approximated: Sequence[tuple[str, str]] = ()


def page(
    title: str, technique: str, scores: Mapping[str, Score], pictures: Mapping[tuple[str, str], np.ndarray], side: Side
) -> str:
    """The whole HTML text. ``pictures`` (H, W, 3) linear, row 0 at the bottom, by (pass, ``test`` or ``reference``), and (H, W)
    by (pass, ``flip``)."""
    walls, size = _pictures(scores, pictures)
    parts = [
        f"<h1>Beside Cycles</h1><p class=lead>{esc(title)}. {esc(side.made)}</p>",
        "<h2>Errors</h2>", _scores(scores),
        "<p class=quiet>Gain is the ratio of all light. relMSE is the mean of squared error over squared reference, beyond "
        "Cycles' own noise; red where no better than the best constant picture. Trimmed leaves out the 0.1 % worst pixels; "
        "the shape error is what the best scale factor would leave. FLIP is what an eye sees, from 0 to 1.</p>",
        svg.dots(
            [(name, {_QUARTET: s.rel_mse, _CONSTANT: s.constant, _NOISE: s.noise_floor}) for name, s in scores.items()],
            {_QUARTET: COLORS.get(technique, COLORS["RSM"]), _CONSTANT: "#999999", _NOISE: "#F0E442"},
        ),
        "<h2>Pictures</h2>", wall(0, size, _flip_scale()),
        "<h2>Time</h2>", _times(technique, side),
    ]  # fmt: skip
    lists = (
        ("Passes left out", ("pass", "why"), side.skipped),
        ("Settings that are not the default", ("setting", "value", "default"), side.settings),
        ("Approximated materials", ("material", "what"), side.approximated),
        ("Notes", ("note",), [(note,) for note in side.notes]),
    )
    for heading, head, rows in lists:
        if rows:
            parts += [f"<h2>{heading}</h2>", table(head, [[f"<td class=text>{esc(v)}</td>" for v in row] for row in rows])]
    return document("Quartet beside Cycles", "".join(parts), charts=False, scripts=wall_script([walls]))


def _scores(scores: Mapping[str, Score]) -> str:
    rows = []
    for name, s in scores.items():
        worse = "fail" if s.rel_mse > s.constant else "ok"
        rows.append([name, s.gain, f"<span class={worse}>{number(s.rel_mse)}</span>", s.trimmed, s.shape, s.best_scale, s.flip,
                     s.flip_p95, s.black, s.constant, s.noise_floor])  # fmt: skip
    return table(_COLUMNS, rows)


def _pictures(scores, pictures) -> tuple[dict[str, dict[str, dict[str, str]]], tuple[int, int]]:
    walls: dict[str, dict[str, dict[str, str]]] = {}
    size = (1, 1)
    for name in scores:
        test, reference, flip = (pictures[name, kind] for kind in ("test", "reference", "flip"))
        size = (test.shape[1], test.shape[0])
        scale = exposure(reference)
        walls[name] = {
            "Cycles": {"image": data_uri(reference, scale=scale)},
            "difference × 4": {"image": data_uri(4.0 * np.abs(test - reference), scale=scale)},
            "Quartet": {"image": data_uri(test, scale=scale), "heat": bytes_uri(magma(flip[::-1]))},
        }
    return walls, size


def _flip_scale() -> str:
    bar = bytes_uri(np.repeat(magma(np.linspace(0.0, 1.0, 256)[None]), 8, axis=0))
    return f'FLIP, 0 <img src="{bar}" width=200 height=10 alt="colour scale"> 1'


def _times(technique: str, side: Side) -> str:
    total = ", ".join(f"{name} {number(seconds)} s" for name, seconds in side.seconds.items())
    measured = [(title, ms) for title, ms, _ in side.passes if ms is not None]
    mib = sum(mib for _, _, mib in side.passes)
    out = f"<p>{esc(total)}: one picture each, on this machine, Quartet's with the compilation of its shaders.</p>"
    if measured:
        out += (
            f"<p class=quiet>Quartet's passes, mean per run; they write {number(mib)} MiB.</p>"
            + svg.bars(measured, "ms", COLORS.get(technique, COLORS["RSM"]))
        )  # fmt: skip
    return out
