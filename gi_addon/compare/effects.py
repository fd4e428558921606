# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's Table 1 with numbers: four techniques × seven effects, each on a scene made for it.

A verdict is a threshold, the same for all: *Yes* if relMSE ≤ 0.1 and the gain is within 10 %; *Partially* if the error is
still below that of the best constant and below that of the same picture with the effect switched off; *No* otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..engines import TECHNIQUES
from ..settings import Settings
from .metrics import Score, score
from .page import data_uri, dump, esc, number
from .paper import EFFECTS, NO, PARTIALLY, TABLE_1, YES
from .references import reference
from .sheet import exposure
from .studio import Studio, settings_for

ERROR_LIMIT, GAIN_LIMIT = 0.1, 0.1
SAMPLES = 32


@dataclass(frozen=True)
class Effect:
    """How an effect is judged: the pass, the reference that is fair to it, the setting that switches it, and why."""

    output: str
    against: str
    switch: str
    why: str


JUDGED = {
    "indirect_diffuse": Effect("Diffuse Indirect", "R1", "use_indirect_diffuse", "one bounce, the pass alone"),
    "glossy": Effect("Glossy Indirect", "R1", "use_glossy", "one reflection, the pass alone"),
    "shadows": Effect("Diffuse Direct", "R1", "use_shadows", "one lamp; only its visibility differs"),
    "ao": Effect("Ambient Occlusion", "R1", "use_ao", "the pass alone, with the same distance"),
    "translucency": Effect("Combined", "Rinf", "use_translucency", "a backlit wax sphere and paper sheet, little else"),
    "volumetric": Effect("Volume Direct", "R1", "use_volumetric", "single scattering, the pass alone"),
    "area_lights": Effect("Combined", "R1", "use_area_lights", "an emissive panel is the only light"),
}


def verdict(s: Score, off: float) -> str:
    """Yes, Partially or No by the thresholds; ``off`` is the relMSE with the effect switched off."""
    if s.rel_mse <= ERROR_LIMIT and abs(s.gain - 1.0) <= GAIN_LIMIT:
        return YES
    return PARTIALLY if s.rel_mse < min(s.constant, off) else NO


@dataclass
class Cell:
    """One cell of the table, with the pictures of its thumbnail pair (H, W, 3)."""

    technique: str
    effect: str
    score: Score
    off: float
    ms: float
    verdict: str
    image: np.ndarray
    reference: np.ndarray

    @property
    def paper(self) -> str:
        return TABLE_1.get(self.technique, {}).get(self.effect, "–")


def judge(technique: str, effect: str, plain, size: tuple[int, int], halves, studio: Studio) -> Cell:
    """Render and judge one cell; ``plain`` is the effect's scene, ``halves`` its reference."""
    how = JUDGED[effect]

    def picture(**values) -> tuple[np.ndarray, float]:
        settings: Settings = settings_for(technique, samples=SAMPLES, **values)
        result = studio.render(plain, settings, (how.output,), size)
        return result.passes[how.output][..., :3], result.seconds * 1e3

    image, ms = picture()
    a, b = halves.a[how.output], halves.b[how.output]
    s = score(image, a, b, flip=True)
    off = score(picture(**{how.switch: False})[0], a, b).rel_mse
    return Cell(technique, effect, s, off, ms, verdict(s, off), image, halves.mean(how.output))


def as_json(cells: list[Cell]) -> dict:
    """Plain data with the thresholds and the paper's verdict beside ours."""
    return {
        "thresholds": {
            "yes": {"rel_mse": ERROR_LIMIT, "gain": GAIN_LIMIT},
            "partially": "below the best constant and the effect off",
        },
        "samples": SAMPLES,
        "cells": [
            {
                "technique": c.technique,
                "effect": c.effect,
                "pass": JUDGED[c.effect].output,
                "against": JUDGED[c.effect].against,
                "verdict": c.verdict,
                "paper": c.paper,
                "off_rel_mse": c.off,
                "ms": c.ms,
                **vars(c.score),
            }
            for c in cells
        ],
    }


_CLASS = {YES: "pass", PARTIALLY: "nature", NO: "fail"}


def html(cells: list[Cell]) -> str:
    """The table as a section of a page."""
    by = {(c.technique, c.effect): c for c in cells}
    techniques = list(dict.fromkeys(c.technique for c in cells))
    head = "".join(f"<th>{esc(EFFECTS[e])}</th>" for e in EFFECTS)
    rows = []
    for technique in techniques:
        line = [f"<tr><td>{technique}</td>"]
        for effect in EFFECTS:
            c = by.get((technique, effect))
            if c is None:
                line.append("<td>–</td>")
                continue
            scale = exposure(c.reference)
            line.append(
                f"<td class=text><span class={_CLASS[c.verdict]}>{c.verdict}</span> "
                f"<span class=quiet>paper: {esc(c.paper)}</span><br>"
                f"relMSE {number(c.score.rel_mse)}, gain {number(c.score.gain)}<br>off {number(c.off)}, constant "
                f"{number(c.score.constant)}<br>"
                f'<img src="{data_uri(c.image, scale=scale)}" width=110 alt="{technique} {effect}"><br>'
                f'<img src="{data_uri(c.reference, scale=scale)}" width=110 alt="Cycles {effect}"></td>'
            )
        rows.append("".join(line) + "</tr>")
    how = "".join(
        f"<li>{esc(EFFECTS[e])}: {j.output} against {'R∞' if j.against == 'Rinf' else j.against}, {esc(j.why)}</li>"
        for e, j in JUDGED.items()
    )
    return (
        "<h2 id=effects>Table 1 with numbers</h2>"
        f"<p>Above Quartet ({SAMPLES} sub-frames, defaults), below Cycles. Yes: relMSE ≤ {ERROR_LIMIT:g} and gain within "
        f"{100 * GAIN_LIMIT:g} %. Partially: below the best constant and below the effect switched off. No: otherwise.</p>"
        f"<div class=scroll><table><thead><tr><th></th>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table></div>"
        f"<ul>{how}</ul>"
    )


def command(techniques: list[str], size: tuple[int, int], samples: int, output: Path, console) -> str:
    """Fill the table: references through Blender, pictures with Quartet; effects.json in ``output``; returns the HTML."""
    from rich.console import Console
    from rich.table import Table

    from ..cli import _blender

    cells: list[Cell] = []
    with Studio() as studio:
        for effect, how in JUDGED.items():
            with _blender(Path(f"builtin:effect-{effect}"), None, None, size, None, ()) as bscene:
                from ..host import cycles, embedded

                plain, size = embedded.plain(bscene)

                def run_cycles(bounces: int, count: int, seed: int, bscene=bscene, how=how):
                    cycles.set_up(bscene, cycles.Reference(bounces, count, seed))
                    return {n: p[..., :3] for n, p in cycles.render_passes(bscene, (how.output,)).items()}

                console.print(f"{EFFECTS[effect]}: reference", style="dim")
                halves = reference(how.against, plain.digest(), size, samples, (how.output,), run_cycles)
            for technique in techniques or TECHNIQUES:
                cells.append(judge(technique, effect, plain, size, halves, studio))
    names = list(techniques or TECHNIQUES)
    by = {(c.technique, c.effect): c for c in cells}
    table = Table("effect", *names, title="Table 1: verdict, relMSE, gain; the paper's verdict")
    for effect in JUDGED:
        row = [by[(t, effect)] for t in names]
        cells_of = (f"{c.verdict}, {number(c.score.rel_mse)}, {number(c.score.gain)}; {c.paper}" for c in row)
        table.add_row(EFFECTS[effect], *cells_of)
    Console().print(table)
    output.mkdir(parents=True, exist_ok=True)
    (output / "effects.json").write_text(dump(as_json(cells)))
    console.print(f"wrote {output / 'effects.json'}")
    return html(cells)
