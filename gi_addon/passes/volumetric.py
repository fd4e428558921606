# SPDX-License-Identifier: GPL-3.0-or-later
"""Light scattered once in the air: view rays marched against the lights' maps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..facts import Facts
from ..frame import Frame
from ..graph import Optional, Planned, Texture, Uniform
from ..materials import Medium
from ..sequence import sobol_2d
from .screen import ScreenPass, _screen

_EVERYWHERE = 1e30


@dataclass(frozen=True)
class Air:
    """A homogeneous ``medium`` and the box (2, 3) in world space that it fills."""

    medium: Medium
    box: np.ndarray


def air(facts: Facts) -> Air | None:
    """What fills the scene: the world's own medium, everywhere; else a volume object's, in its box; else the setting's haze,
    in the scene's bounds."""
    volume = facts.settings.volume
    if not facts.settings.use_volumetric:
        return None
    if facts.medium is not None:
        everywhere = np.array([[-_EVERYWHERE] * 3, [_EVERYWHERE] * 3])
        return Air(facts.medium, everywhere if facts.medium_box is None else facts.medium_box)
    if volume.density > 0.0:
        return Air(Medium((volume.density,) * 3, (0.0,) * 3, anisotropy=volume.anisotropy), facts.rig.bounds)
    return None


MEDIUM_UNIFORMS = (
    Uniform("medium_low_ws", "vec3", "corner of the box that the medium fills, world space, m"),
    Uniform("medium_high_ws", "vec3", "the opposite corner"),
    Uniform("medium_extinction", "vec3", "share of light lost per metre of it"),
)


def medium_defines(facts: Facts) -> dict[str, int]:
    """``HAS_MEDIUM``: whether there is any."""
    return {"HAS_MEDIUM": int(air(facts) is not None)}


def set_medium(frame: Frame, program, facts: Facts) -> None:
    """Set MEDIUM_UNIFORMS where there is a medium."""
    found = air(facts)
    if found is not None:
        frame.set(
            program,
            medium_low_ws=tuple(float(v) for v in found.box[0]),
            medium_high_ws=tuple(float(v) for v in found.box[1]),
            medium_extinction=tuple(float(v) for v in found.medium.extinction),
        )


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
        Uniform("medium_scattering", "vec3", "share of light scattered per metre"),
        Uniform("medium_emission", "vec3", "radiance emitted per metre, W/(m³·sr)"),
        Uniform("medium_anisotropy", "float", "mean cosine of the scattering angle"),
        Uniform("light_count", "int", "lights in the list"),
        Uniform("step_count", "int", "points tested on each ray for each light"),
        Uniform("step_turn", "float", "where in its stratum each point lies in this sub-frame, [0, 1)"),
    )
    fragment = "passes/volumetric_frag.glsl"

    def defines(self, facts: Facts) -> dict[str, int]:
        return {"RADIAL_BLUR": 0, "VOXEL_VISIBILITY": 0}

    def absent(self, facts: Facts) -> str | None:
        if not facts.settings.use_volumetric:
            return "volumetric light is switched off"
        return None if air(facts) is not None else "neither the world nor an object is a volume, and volume.density is 0"

    def prepare(self, frame: Frame, planned: Planned, program) -> None:
        facts = planned.facts
        medium = air(facts).medium
        set_medium(frame, program, facts)
        frame.set(
            program,
            medium_scattering=tuple(float(v) for v in medium.scattering),
            medium_emission=tuple(float(v) for v in medium.emission),
            medium_anisotropy=float(medium.anisotropy),
            light_count=len(facts.rig.sources),
            step_count=facts.settings.volume.samples,
            step_turn=float(sobol_2d(frame.subframe, 8)[0]),
        )
