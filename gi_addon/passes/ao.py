# SPDX-License-Identifier: GPL-3.0-or-later
"""Ambient occlusion from the depth buffer and the grid of cells, and its blur."""

from __future__ import annotations

from ..facts import Facts
from ..frame import Frame
from ..graph import Optional, Planned, Texture, Uniform
from .occupancy import CELL_UNIFORMS, cell_grid, set_cells
from .screen import ScreenPass, _screen


class AOGeneration(ScreenPass):
    """Occluders near by, from the screen; farther ones too, from the grid of cells if ``cells``."""

    title = "AO Generation"
    figure = "RSM AO Generation / SSAO Generation"
    reads = ("gbuffer.depth", "gbuffer.normal")
    writes = (
        Texture("ao.raw", "ao_raw", "cosine-weighted share of directions free of occluders: within the AO distance; "
                "and near by, fading with distance", "rg16f", _screen, scratch=True),
    )  # fmt: skip
    uniforms = (
        Uniform("ao_directions", "int", "directions per pixel"),
        Uniform("ao_steps", "int", "depth tests along each"),
        Uniform("ao_distance", "float", "how far an occluder counts, m"),
        Uniform("ao_contact", "float", "how far one dims untested indirect light, m"),
        *CELL_UNIFORMS,
    )
    fragment = "passes/ao_frag.glsl"

    def __init__(self, *, cells: bool = False) -> None:
        if cells:
            self.reads = (*type(self).reads, Optional("occupancy"))

    def defines(self, facts: Facts) -> dict[str, int]:
        return {} if Optional("occupancy") in self.reads else {"HAS_OCCUPANCY": 0}

    def absent(self, facts: Facts) -> str | None:
        return None if facts.settings.use_ao else "ambient occlusion is switched off"

    def prepare(self, frame: Frame, planned: Planned, program) -> None:
        facts = planned.facts
        frame.set(
            program,
            ao_directions=facts.settings.ao.samples,
            ao_steps=facts.settings.ao.steps,
            # Nothing of the scene is farther than its own diameter; and only the pass itself asks for that far.
            ao_distance=min(facts.ao_distance, 2.0 * facts.radius) if "ao" in facts.layers else 0.0,
            ao_contact=_contact(facts),
        )
        if planned.has("occupancy"):
            set_cells(frame, program, facts)


def _contact(facts: Facts) -> float:
    """How far an occluder dims untested indirect light, m. Where a grid of cells tests it, only what the cells around the
    surface itself can't tell is left to do: two of them."""
    contact = facts.settings.ao.contact * facts.radius
    if facts.settings.technique == "RSM" and facts.settings.rsm.visibility == "CELLS":
        return min(contact, 2.0 * cell_grid(facts).cell)
    return contact


class AOBlur(ScreenPass):
    title = "Gaussian Blur"
    figure = "Gaussian Blur"
    reads = ("ao.raw", "gbuffer.depth", "gbuffer.normal")
    writes = (
        Texture("ao", "ao", "ambient occlusion within the AO distance; and of near contacts; 1 = open", "rg16f",
                _screen, scratch=True),
    )  # fmt: skip
    fragment = "passes/ao_blur_frag.glsl"
