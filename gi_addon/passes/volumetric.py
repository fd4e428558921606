# SPDX-License-Identifier: GPL-3.0-or-later
"""Light scattered once in the air: view rays marched against the lights' maps."""

from __future__ import annotations

import numpy as np

from ..facts import Domain, Facts
from ..frame import Frame
from ..graph import Optional, Planned, Texture, Uniform
from ..materials import Medium
from ..sequence import sobol_2d
from .screen import ScreenPass, _screen


def air(facts: Facts) -> tuple[Domain, ...]:
    """What fills the scene: the world's own medium and those of volume objects; where there are none, the setting's haze, in
    the scene's bounds. The world's comes first, then the largest."""
    volume = facts.settings.volume
    if not facts.settings.use_volumetric:
        return ()
    if facts.media:
        return facts.media
    if volume.density > 0.0:
        low, high = facts.rig.bounds
        unit = np.diag([*(2.0 / np.maximum(high - low, 1e-30)), 1.0])
        unit[:3, 3] = -(low + high) / np.maximum(high - low, 1e-30)
        return (Domain(Medium((volume.density,) * 3, (0.0,) * 3, anisotropy=volume.anisotropy), unit),)
    return ()


MEDIUM_UNIFORMS = (
    Uniform("medium_unit_from_world[MEDIA]", "mat4", "the medium's space from the world's; all 0 where it fills the world"),
    Uniform("medium_extinction[MEDIA]", "vec4", "share of light lost per metre of it; 1 where it fills a ball, 0 a cube"),
    Uniform("medium_scattering[MEDIA]", "vec4", "share scattered per metre; mean cosine of the scattering angle"),
    Uniform("medium_emission[MEDIA]", "vec3", "radiance emitted per metre, W/(m³·sr)"),
)


def medium_defines(facts: Facts) -> dict[str, int]:
    """``HAS_MEDIUM``: whether there is any; ``MEDIA``: how many, at least 1."""
    return {"HAS_MEDIUM": int(bool(air(facts))), "MEDIA": max(1, len(air(facts)))}


def set_medium(frame: Frame, program, facts: Facts) -> None:
    """Set MEDIUM_UNIFORMS where there is a medium."""
    found = air(facts)
    if found:
        media, spaces = [d.medium for d in found], [d.unit_from_world for d in found]
        frame.set(
            program,
            medium_unit_from_world=np.stack([np.zeros((4, 4)) if s is None else s.T for s in spaces]),
            medium_extinction=np.array([(*d.medium.extinction, d.ball) for d in found]),
            medium_scattering=np.array([(*m.scattering, m.anisotropy) for m in media]),
            medium_emission=np.array([m.emission for m in media]),
        )


def no_air(facts: Facts) -> str | None:
    """Why no light is scattered or lost in the air, or None."""
    if not facts.settings.use_volumetric:
        return "volumetric light is switched off"
    return None if air(facts) else "neither the world nor an object is a volume, and volume.density is 0"


def step_turn(frame: Frame) -> float:
    """Where in its stratum each point on a view ray lies in this sub-frame, [0, 1)."""
    return float(sobol_2d(frame.subframe, 8)[0])


class Volumetric(ScreenPass):
    """In-scattered light and transmittance of every pixel's ray."""

    title = "Volumetric Lighting Computation"
    figure = "Volumetric Lighting Computation"
    reads = (
        Optional("lights", ("volume.light",)), Optional("lights.views", ("volume.light",)),
        Optional("shadow.depth", ("volume.light",)), Optional("rsm.depth", ("volume.light",)), Optional("gbuffer.depth"),
    )  # fmt: skip
    writes = (
        Texture("volume.light", "volume_light", "radiance scattered or emitted towards the eye, W/(m²·sr)", "rgba32f",
                _screen),
        Texture("volume.transmittance", "volume_transmittance", "share of the light behind that passes", "rgba32f", _screen),
    )  # fmt: skip
    uniforms = (
        *MEDIUM_UNIFORMS,
        Uniform("light_count", "int", "lights in the list"),
        Uniform("step_count", "int", "points tested on each ray for each light"),
        Uniform("step_turn", "float", "where in its stratum each point lies in this sub-frame, [0, 1)"),
    )
    fragment = "passes/volumetric_frag.glsl"

    def defines(self, facts: Facts) -> dict[str, int]:
        return {**medium_defines(facts), "RADIAL_BLUR": 0, "VOXEL_VISIBILITY": 0}

    def absent(self, facts: Facts) -> str | None:
        return no_air(facts)

    def prepare(self, frame: Frame, planned: Planned, program) -> None:
        facts = planned.facts
        set_medium(frame, program, facts)
        frame.set(
            program,
            light_count=len(facts.rig.sources),
            step_count=facts.settings.volume.samples,
            step_turn=step_turn(frame),
        )
