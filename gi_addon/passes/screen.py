# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes that run one fragment shader over the picture, and what several techniques' ones write and read alike."""

from __future__ import annotations

from typing import ClassVar

from ..facts import Facts
from ..frame import FULLSCREEN, Frame
from ..graph import Optional, Pass, Planned, Texture

LIGHT = "radiance a white Lambert surface would reflect, W/(m²·sr)"
DIRECTION = "Σ luminance × direction, and Σ luminance, of what arrives"


class ScreenPass(Pass):
    """Runs ``fragment`` over every texel of its targets, with the uniforms that ``prepare`` sets."""

    fragment: ClassVar[str] = ""

    def __init_subclass__(cls) -> None:
        if "fragment" in cls.__dict__:
            cls.shaders = {"main": {"vertex": FULLSCREEN, "fragment": cls.fragment}}

    def prepare(self, frame: Frame, planned: Planned, program) -> None:
        """Set the uniforms of ``program``, and whatever else is due before it runs."""

    def run(self, frame: Frame, planned: Planned) -> None:
        program = frame.program(planned)
        self.prepare(frame, planned, program)
        frame.screen(planned, program)


def _screen(facts: Facts) -> tuple[int, int]:
    return facts.resolution


INDIRECT_DIFFUSE = Texture("indirect.diffuse", "indirect_diffuse", LIGHT, "rgba32f", _screen,
                           when=lambda f: None if f.diffuse else "no visible material is diffuse")  # fmt: skip
INDIRECT_GLOSSY = Texture("indirect.glossy", "indirect_glossy", "radiance that the glossy lobe reflects, with its colour, "
                          "W/(m²·sr)", "rgba32f", _screen)  # fmt: skip
TRANSMISSION_INDIRECT = Texture("transmission.indirect", "transmission_indirect", "radiance through refracting surfaces, "
                                "tinted; alpha 1 where the ray met something", "rgba32f", _screen)  # fmt: skip
SUBSURFACE = (
    Texture("subsurface.direct", "subsurface_direct", "direct.diffuse after scattering below the surface; its share of "
            "the surface's colour", "rgba32f", _screen),
    Texture("subsurface.indirect", "subsurface_indirect", "the same of indirect.diffuse", "rgba32f", _screen),
)  # fmt: skip

# Of a surface that reflects, besides where it is: its lobe (lib/bsdf_lib.glsl).
LOBE = ("gbuffer.specular", "gbuffer.lobe", "brdf.albedo", "brdf.energy", "brdf.average")
# What scatters below a surface: its own light.
SCATTERED = (
    Optional("direct.diffuse", ("subsurface.direct",)), Optional("indirect.diffuse", ("subsurface.indirect",)),
)  # fmt: skip
# Of a surface that refracts (lib/refraction_lib.glsl).
REFRACTING = (
    "gbuffer.transmission", "translucent.depth", "translucent.normal", "translucent.color", "translucent.medium",
    "translucent.back_depth", "translucent.back_normal",
)  # fmt: skip


def no_translucency(facts: Facts) -> str | None:
    """Why no light gets through surfaces, or None."""
    return None if facts.settings.use_translucency else "translucency is switched off"


def no_bounce(facts: Facts) -> str | None:
    """Why no surface lights another, or None."""
    return "bounces is 0" if facts.settings.bounces == 0 else None


def no_indirect(facts: Facts) -> str | None:
    """Why diffuse surfaces show no light of others, or None."""
    return no_bounce(facts) if facts.settings.use_indirect_diffuse else "indirect diffuse is switched off"


def no_gloss(facts: Facts) -> str | None:
    """Why nothing is to be mirrored, or None."""
    if not facts.settings.use_glossy:
        return "glossy reflections are switched off"
    return None if facts.glossy else "no visible material is glossy"
