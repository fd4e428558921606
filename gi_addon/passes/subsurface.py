# SPDX-License-Identifier: GPL-3.0-or-later
"""Light below surfaces: a random walk between the sides of an object that the camera and the lights see."""

from __future__ import annotations

import moderngl
import numpy as np

from ..facts import Facts
from ..frame import Frame
from ..graph import Optional, Pass, Planned, Texture, Uniform
from ..scene import CAMERA
from .screen import ScreenPass, _screen
from .volumetric import MEDIUM_UNIFORMS, medium_defines, set_medium


def _off(facts: Facts) -> str | None:
    return None if facts.settings.use_translucency else "translucency is switched off"


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
        return _off(facts)

    def run(self, frame: Frame, planned: Planned) -> None:
        fbo = frame.targets(planned)
        fbo.use()
        fbo.scissor = None
        fbo.viewport = (0, 0, *fbo.size)
        fbo.clear(0.0, 0.0, 0.0, 0.0, depth=0.0)
        frame.gl.ctx.enable_only(moderngl.DEPTH_TEST)
        frame.gl.ctx.depth_func = ">"
        frame.bind(planned)
        frame.gpu.draw(
            planned,
            {"vertex": "surface/surface_vert.glsl", "fragment": "passes/subsurface_back_frag.glsl"},
            CAMERA,
            np.ascontiguousarray(frame.view["clip_from_world"]),
            full=True,
            only="subsurface",
            units=len(planned.texture_reads()),
            defines={
                "SURFACE_TABLES": int(planned.has("brdf.albedo")), "SURFACE_SEE_THROUGH_GLASS": 1, "SURFACE_SEEN_BY_CAMERA": 1,
                "SURFACE_SEEN_BY_SHADOW": 0,
            },
        )  # fmt: skip
        frame.gl.ctx.depth_func = "<"


class Subsurface(ScreenPass):
    """Light that entered elsewhere and leaves here."""

    title = "Subsurface Scattering"
    reads = (
        "subsurface.back", "subsurface.back_normal", "gbuffer.depth", "gbuffer.normal", "gbuffer.diffuse",
        "gbuffer.subsurface", "gbuffer.entry",
        Optional("direct.diffuse", ("subsurface.direct",)), Optional("indirect.diffuse", ("subsurface.indirect",)),
        *(Optional(f"rsm.{name}") for name in ("depth", "normal", "albedo", "lights", "views")),
    )  # fmt: skip
    writes = (
        Texture("subsurface.direct", "subsurface_direct", "direct.diffuse after scattering below the surface; its share of "
                "the surface's colour", "rgba32f", _screen),
        Texture("subsurface.indirect", "subsurface_indirect", "the same of indirect.diffuse", "rgba32f", _screen),
    )  # fmt: skip
    uniforms = (*MEDIUM_UNIFORMS, Uniform("rsm_light_count", "int", "lights with reflective shadow maps"))
    fragment = "passes/subsurface_frag.glsl"

    def defines(self, facts: Facts) -> dict[str, int]:
        return medium_defines(facts)

    def absent(self, facts: Facts) -> str | None:
        return _off(facts)

    def prepare(self, frame: Frame, planned: Planned, program) -> None:
        set_medium(frame, program, planned.facts)
        frame.set(program, rsm_light_count=len(planned.facts.rig.sources))
