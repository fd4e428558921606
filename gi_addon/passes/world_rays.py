# SPDX-License-Identifier: GPL-3.0-or-later
"""Smooths the world's diffuse direct light between its few directions with shadow maps, by many rays through the cells.

A control variate (J. Hammersley and D. Handscomb, "Monte Carlo Methods", 1964, §5.5). With D the light of the directions
that have shadow maps, B the same directions' light if the cells were the scene, and A that of many more directions through
the cells, D + A − B has D's expectation, because A and B have the same, and where maps and cells agree it has A's noise.
The weight of A − B is 1: cells hide more than maps do (every cell that a surface touches is solid), so what they see is a
part of what maps see. For a share b of directions that are open in the cells, out of d open in the maps, the best weight
is then Cov(D, B)/Var(B) = (1 − d)/(1 − b), near 1 for openings that are a small part of the sky.
"""

from __future__ import annotations

import numpy as np

from ..facts import Facts
from ..frame import Frame
from ..gl.structs import struct
from ..gpu_types import LIGHT_WORLD
from ..graph import Buffer, Optional, Pass, Planned, Texture
from ..sequence import sobol_2d
from .gbuffer import _screen, gather_size
from .occupancy import CELL_UNIFORMS, set_cells
from .volumetric import MEDIUM_UNIFORMS, medium_defines, set_medium

# `direction_ws` towards the sky; `emission` is the irradiance that the direction stands for, W/m², negative for those of
# shadow maps.
WORLD_RAY = struct(("direction_ws", "f4", 3), ("_pad0", "f4"), ("emission", "f4", 3), ("_pad1", "f4"))
_SEED = 13


def ray_count(facts: Facts) -> int:
    """Directions through the cells, those with shadow maps included."""
    return facts.settings.world.rays + sum(s.kind == LIGHT_WORLD for s in facts.rig.sources)


def _defines(facts: Facts) -> dict[str, int]:
    return {"WORLD_RAYS": ray_count(facts), "GATHER_SCALE": facts.settings.gather_scale, **medium_defines(facts)}


class WorldRays(Pass):
    """The rays' light less that of the shadow maps' directions, at one pixel per block."""

    title = "World Rays"
    reads = ("occupancy", Optional("world.guide"), "gbuffer.low_depth", "gbuffer.low_normal", "gbuffer.low_pixel")
    writes = (
        Texture("world.low", "low_rays", "radiance that a white Lambert surface would reflect, W/(m²·sr); expectation 0",
                "rgba32f", gather_size),
        Buffer("world.rays", "world_rays", "directions of this sub-frame", "WorldRay", WORLD_RAY, ray_count),
    )  # fmt: skip
    uniforms = (*CELL_UNIFORMS, *MEDIUM_UNIFORMS)
    shaders = {"main": {"vertex": "passes/fullscreen_vert.glsl", "fragment": "passes/world_rays_low_frag.glsl"}}

    def defines(self, facts: Facts) -> dict[str, int]:
        return _defines(facts)

    def absent(self, facts: Facts) -> str | None:
        if not any(s.kind == LIGHT_WORLD for s in facts.rig.sources):
            return "the world gives no light"
        if not facts.settings.use_shadows:
            return "shadows are switched off"
        if not facts.diffuse:
            return "no visible material is diffuse"
        return None if facts.settings.world.rays else "world.rays is 0"

    def run(self, frame: Frame, planned: Planned) -> None:
        frame.upload("world.rays", self.directions(frame, planned.facts))
        program = frame.program(planned)
        set_cells(frame, program, planned.facts)
        set_medium(frame, program, planned.facts)
        frame.screen(planned, program)

    @staticmethod
    def directions(frame: Frame, facts: Facts) -> np.ndarray:
        """WORLD_RAY (N,): the sub-frame's share of one sequence, and the lights to take away."""
        rig, count = facts.rig, facts.settings.world.rays
        mapped = frame.light_sample(bounce=False).lights
        mapped = mapped[mapped["kind"] == LIGHT_WORLD]
        rays = np.zeros(count + len(mapped), WORLD_RAY)
        world = rig.direct_world or rig.world
        direction, weight, _ = world.sample(sobol_2d(frame.subframe * count + np.arange(count), _SEED))
        rays["direction_ws"][:count], rays["emission"][:count] = direction, weight / count
        rays["direction_ws"][count:], rays["emission"][count:] = -mapped["axis_ws"], -mapped["emission"]
        return rays


class WorldRaysInterpolation(Pass):
    """The same at every pixel."""

    title = "World Rays Interpolation"
    reads = (
        "world.low", "world.rays", "occupancy", "gbuffer.depth", "gbuffer.normal", "gbuffer.low_depth",
        "gbuffer.low_normal", "gbuffer.low_pixel",
    )  # fmt: skip
    writes = (
        Texture("world.difference", "world_difference", "radiance that a white Lambert surface would reflect, W/(m²·sr); "
                "expectation 0", "rgba32f", _screen),
    )  # fmt: skip
    uniforms = (*CELL_UNIFORMS, *MEDIUM_UNIFORMS)
    shaders = {"main": {"vertex": "passes/fullscreen_vert.glsl", "fragment": "passes/world_rays_frag.glsl"}}

    def defines(self, facts: Facts) -> dict[str, int]:
        return _defines(facts)

    def run(self, frame: Frame, planned: Planned) -> None:
        program = frame.program(planned)
        set_cells(frame, program, planned.facts)
        set_medium(frame, program, planned.facts)
        frame.screen(planned, program)
