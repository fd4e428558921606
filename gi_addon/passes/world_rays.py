# SPDX-License-Identifier: GPL-3.0-or-later
"""Smooths the world's diffuse direct light between its few directions with shadow maps, by many rays through the cells.

A control variate (J. Hammersley and D. Handscomb, "Monte Carlo Methods", 1964, §5.5). With D the light of the directions
that have shadow maps, B the same directions' light if the cells were the scene, and A that of many more directions through
the cells, D + β (A − B) has D's expectation for every fixed β, because A and B have the same. The error is least at
β = Cov(D, B)/Var(B): 1 if cells showed what maps do, less as they err at edges.
"""

from __future__ import annotations

import numpy as np

from ..facts import Facts
from ..frame import Frame
from ..gl.structs import struct
from ..gpu_types import LIGHT_WORLD
from ..graph import Buffer, Optional, Planned, Texture, Uniform
from ..sequence import sobol_2d
from .occupancy import CELL_UNIFORMS, set_cells
from .screen import ScreenPass, _screen
from .volumetric import MEDIUM_UNIFORMS, medium_defines, set_medium

# `direction_ws` towards the sky; `emission` is the irradiance that the direction stands for, W/m², negative for those of
# shadow maps; the ray starts `shift` cells beside the point, within a square of one cell in the surface's plane.
WORLD_RAY = struct(("direction_ws", "f4", 3), ("shift_x", "f4"), ("emission", "f4", 3), ("shift_y", "f4"))
# Rays for each direction with a shadow map: their mean knows an edge within a cell, one ray would know it by whole cells.
_SHIFTS = 8
# β. The best one is .71 in living_room with 128 cells and .90 with 256 (docs/techniques/world.md): one value for both, on
# the side that leaves less of A's own noise.
_WEIGHT = 0.75
_DIRECTION_SEED, _SHIFT_SEED, _MAPPED_SHIFT_SEED = 13, 14, 15


def ray_count(facts: Facts) -> int:
    """Rays per pixel and sub-frame."""
    return facts.settings.world.rays + _SHIFTS * sum(s.kind == LIGHT_WORLD for s in facts.rig.sources)


class WorldRays(ScreenPass):
    """The rays' light less that of the shadow maps' directions, weighted."""

    title = "World Rays"
    reads = ("occupancy", Optional("world.guide"), "gbuffer.depth", "gbuffer.normal")
    writes = (
        Texture("world.difference", "world_difference", "radiance that a white Lambert surface would reflect, W/(m²·sr); "
                "expectation 0", "rgba32f", _screen),
        Buffer("world.rays", "world_rays", "directions of this sub-frame", "WorldRay", WORLD_RAY, ray_count, scratch=True),
    )  # fmt: skip
    uniforms = (Uniform("ray_count", "int", "rays in the list"), *CELL_UNIFORMS, *MEDIUM_UNIFORMS)
    fragment = "passes/world_rays_frag.glsl"

    def defines(self, facts: Facts) -> dict[str, int]:
        return medium_defines(facts)

    def absent(self, facts: Facts) -> str | None:
        if not any(s.kind == LIGHT_WORLD for s in facts.rig.sources):
            return "the world gives no light"
        if not facts.settings.use_shadows:
            return "shadows are switched off"
        if not facts.diffuse:
            return "no visible material is diffuse"
        return None if facts.settings.world.rays else "world.rays is 0"

    def prepare(self, frame: Frame, planned: Planned, program) -> None:
        facts = planned.facts
        frame.upload("world.rays", self.directions(frame, facts))
        frame.set(program, ray_count=ray_count(facts))
        set_cells(frame, program, facts)
        set_medium(frame, program, facts)

    @staticmethod
    def directions(frame: Frame, facts: Facts) -> np.ndarray:
        """WORLD_RAY (N,): the sub-frame's share of one sequence, and the lights to take away."""
        rig, count = facts.rig, facts.settings.world.rays
        mapped = frame.light_sample(bounce=False).lights
        mapped = mapped[mapped["kind"] == LIGHT_WORLD].repeat(_SHIFTS)
        rays = np.zeros(count + len(mapped), WORLD_RAY)
        index = frame.subframe * count + np.arange(count)
        world = rig.direct_world or rig.world
        direction, weight, _ = world.sample(sobol_2d(index, _DIRECTION_SEED))
        rays["direction_ws"][:count], rays["emission"][:count] = direction, weight / count
        rays["direction_ws"][count:], rays["emission"][count:] = -mapped["axis_ws"], -mapped["emission"] / _SHIFTS
        rays["emission"] *= _WEIGHT
        mapped_index = frame.subframe * len(mapped) + np.arange(len(mapped))
        shift = np.concatenate([sobol_2d(index, _SHIFT_SEED), sobol_2d(mapped_index, _MAPPED_SHIFT_SEED)]) - 0.5
        rays["shift_x"], rays["shift_y"] = shift[:, 0], shift[:, 1]
        return rays
