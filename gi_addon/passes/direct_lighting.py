# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that reaches a surface straight from its source."""

from __future__ import annotations

from ..facts import Facts
from ..frame import Frame
from ..graph import Optional, Planned, Texture, Uniform
from ..sequence import sobol_2d
from .gbuffer import _nothing_refracts
from .screen import LIGHT, ScreenPass, _screen
from .volumetric import MEDIUM_UNIFORMS, medium_defines, set_medium


def set_lamps(frame: Frame, planned: Planned, program) -> None:
    """Set ``DirectLighting.uniforms``: what lib/lamps_lib.glsl asks for."""
    set_medium(frame, program, planned.facts)
    frame.set(
        program,
        light_count=len(planned.facts.rig.sources),
        softness=planned.facts.settings.shadows.softness,
        filter_turn=float(sobol_2d(frame.subframe, 3)[0]) * 6.2831853,
    )


class DirectLighting(ScreenPass):
    title = "Direct Lighting Computation"
    figure = "Direct Lighting Computation"
    reads = (
        "lights", Optional("lights.views"), Optional("shadow.depth"), Optional("shadow.tint"), Optional("rsm.depth"),
        Optional("shadow.cones"), "gbuffer.depth", "gbuffer.normal", Optional("gbuffer.set"),
        Optional("gbuffer.specular", ("direct.glossy",)), Optional("gbuffer.lobe", ("direct.glossy",)),
        Optional("brdf.energy", ("direct.glossy",)), Optional("brdf.average", ("direct.glossy",)),
        Optional("screen.light", ("direct.diffuse",)), Optional("world.difference", ("direct.diffuse",)),
    )  # fmt: skip
    writes = (
        Texture("direct.diffuse", "direct_diffuse", LIGHT,
                "rgba32f", _screen, when=lambda f: None if f.diffuse else "no visible material is diffuse"),
        Texture("direct.glossy", "direct_glossy", "radiance reflected by the glossy lobe, W/(m²·sr)", "rgba32f",
                _screen, when=lambda f: None if f.glossy else "no visible material is glossy"),
        Texture("direct.shadow", "direct_shadow", "share of the direct irradiance that is not blocked", "rgba16f", _screen,
                when=lambda f: None if f.catchers or "shadow" in f.layers else "nothing shows it: no pass, no shadow catcher"),
    )  # fmt: skip
    uniforms = (
        Uniform("light_count", "int", "lights in the list"),
        Uniform("softness", "float", "radius of the shadow filter, texels"),
        Uniform("filter_turn", "float", "rotation of the shadow filter in this sub-frame, rad"),
        *MEDIUM_UNIFORMS,
    )
    fragment = "passes/direct_lighting_frag.glsl"

    def defines(self, facts: Facts) -> dict[str, int]:
        return {**medium_defines(facts), "HAS_SSDO_PLANES": 0}

    def absent(self, facts: Facts) -> str | None:
        return None if facts.lit else "no light shines"

    def prepare(self, frame: Frame, planned: Planned, program) -> None:
        set_lamps(frame, planned, program)


class TranslucentLighting(ScreenPass):
    """Direct light through surfaces that scatter it to their other side."""

    title = "Translucent Direct Lighting"
    figure = "Direct Lighting Computation"
    reads = (
        "lights", Optional("lights.views"), Optional("shadow.depth"), Optional("shadow.tint"), Optional("rsm.depth"),
        "translucent.depth",
        "translucent.normal", "translucent.color", "translucent.medium", Optional("translucent.set"),
    )  # fmt: skip
    writes = (
        Texture("transmission.direct", "transmission_direct", "radiance that light from behind leaves with, tinted, W/(m²·sr); "
                "alpha 1 where the surface scatters, 0 where it refracts", "rgba32f", _screen),
    )  # fmt: skip
    uniforms = DirectLighting.uniforms
    fragment = "passes/translucent_light_frag.glsl"

    def defines(self, facts: Facts) -> dict[str, int]:
        return medium_defines(facts)

    def absent(self, facts: Facts) -> str | None:
        return _nothing_refracts(facts) or (None if facts.lit else "no light shines")

    prepare = DirectLighting.prepare
