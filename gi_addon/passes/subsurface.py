# SPDX-License-Identifier: GPL-3.0-or-later
"""Light below surfaces: a random walk between the sides of an object that the camera and the lights see."""

from __future__ import annotations

from ..facts import Facts
from ..frame import Frame
from ..graph import Optional, Pass, Planned, Texture, Uniform
from .gbuffer import draw_for_camera
from .screen import SCATTERED, SUBSURFACE, ScreenPass, _screen, no_translucency
from .volumetric import MEDIUM_UNIFORMS, medium_defines, set_medium


class SubsurfaceBack(Pass):
    """The far side of what the G-buffer shows the near side of."""

    title = "Subsurface Back Generation"
    reads = (Optional("brdf.albedo"), Optional("brdf.average"), Optional("brdf.energy"))
    writes = (
        Texture("subsurface.back", "subsurface_back", "view depth of the farthest surface that light scatters below, world "
                "units; 0 where there is none", "r32f", _screen,
                when=lambda f: None if f.subsurface else "no visible material scatters below its surface"),
        Texture("subsurface.back_normal", "subsurface_back_normal", "its triangle's normal, towards the eye, world space, "
                "octahedral", "rg16", _screen),
        Texture("subsurface.back_z", "subsurface_back_z", "depth buffer", "depth24", _screen, scratch=True),
    )  # fmt: skip

    def absent(self, facts: Facts) -> str | None:
        return no_translucency(facts)

    def run(self, frame: Frame, planned: Planned) -> None:
        draw_for_camera(frame, planned, "passes/subsurface_back_frag.glsl", "subsurface", far=0.0)


class Subsurface(ScreenPass):
    """Light that entered elsewhere and leaves here."""

    title = "Subsurface Scattering"
    reads = (
        "subsurface.back", "subsurface.back_normal", "gbuffer.depth", "gbuffer.normal", "gbuffer.diffuse",
        "gbuffer.subsurface", "gbuffer.entry",
        *SCATTERED,
        *(Optional(f"rsm.{name}") for name in ("depth", "normal", "albedo", "lights", "views")),
    )  # fmt: skip
    writes = SUBSURFACE
    uniforms = (*MEDIUM_UNIFORMS, Uniform("rsm_light_count", "int", "lights with reflective shadow maps"))
    fragment = "passes/subsurface_frag.glsl"

    def defines(self, facts: Facts) -> dict[str, int]:
        return medium_defines(facts)

    def absent(self, facts: Facts) -> str | None:
        return no_translucency(facts)

    def prepare(self, frame: Frame, planned: Planned, program) -> None:
        set_medium(frame, program, planned.facts)
        frame.set(program, rsm_light_count=len(planned.facts.rig.sources))
