# SPDX-License-Identifier: GPL-3.0-or-later
"""Reflective shadow maps, Figure 4a of the paper.

C. Dachsbacher and M. Stamminger, "Reflective Shadow Maps", I3D 2005. What the lights see becomes a set of virtual point
lights, drawn in proportion to the flux they reflect, the same for all pixels and another in each sub-frame. Indirect
light is gathered at low resolution and interpolated where surfaces agree.
"""

from __future__ import annotations

from ..facts import Facts
from ..frame import Frame
from ..gpu_types import LIGHT_MESH, VPL
from ..graph import Buffer, Optional, Pass, Planned, Texture, Uniform
from ..passes.ao import AOBlur, AOGeneration
from ..passes.brdf_tables import BRDFTables
from ..passes.direct_lighting import DirectLighting
from ..passes.gbuffer import GBuffer, GBufferMips, TranslucentTint, _screen, gather_size
from ..passes.lights import LightList, RSMGeneration, ShadowMaps
from ..passes.occupancy import CELL_UNIFORMS, Occupancy, set_cells
from ..passes.resolve import Resolve
from ..passes.volumetric import MEDIUM_UNIFORMS, Volumetric, medium_defines, set_medium
from ..settings import Settings


def passes(settings: Settings, layers: tuple[str, ...]) -> list[Pass]:
    """Figure 4a, in order."""
    return [
        BRDFTables(),
        LightList(),
        ShadowMaps(),
        RSMGeneration(),
        RSMFlux(),
        RSMSamplingPattern(),
        Occupancy(),
        GBuffer(),
        TranslucentTint(),
        GBufferMips(),
        AOGeneration(),
        AOBlur(),
        InterpolatedIndirect(),
        IndirectLighting(),
        DirectLighting(),
        Volumetric(),
        Resolve(layers),
    ]


def _bounce_off(facts: Facts) -> str | None:
    if not facts.settings.use_indirect_diffuse:
        return "indirect diffuse is switched off"
    return "bounces is 0" if facts.settings.bounces == 0 else None


def _gather_defines(facts: Facts) -> dict[str, int]:
    lamps = any(s.kind == LIGHT_MESH for s in facts.rig.sources)
    return {"GATHER_SCALE": facts.settings.gather_scale, "MESH_LIGHTS": int(lamps), **medium_defines(facts)}


class RSMFlux(Pass):
    """Luminous flux of every RSM texel, and its sums over 2 × 2, 4 × 4 … texels to draw samples by."""

    title = "RSM Flux"
    reads = ("rsm.depth", "rsm.albedo", "rsm.normal", "rsm.lights", "rsm.views")
    writes = (
        Texture("rsm.flux", "rsm_flux", "luminance of the flux reflected by the texels below, W", "r32f",
                lambda f: f.rig.bounce.size, mips=lambda f: max(f.rig.bounce.size).bit_length() - 1,
                access="readwrite"),
    )  # fmt: skip
    uniforms = (Uniform("tile", "int", "index of the view whose tile is filled"), *MEDIUM_UNIFORMS)
    shaders = {
        "main": {"compute": "engines/rsm/flux_comp.glsl"},
        "reduce": {"compute": "engines/rsm/flux_reduce_comp.glsl"},
    }
    depends = ("lights", "world", "transforms", "meshes", "materials")
    settings = ("use_volumetric", "volume.density")

    def rate(self, facts: Facts) -> str:
        return RSMGeneration().rate(facts)

    def defines(self, facts: Facts) -> dict[str, int]:
        return medium_defines(facts)

    def absent(self, facts: Facts) -> str | None:
        return _bounce_off(facts)

    def run(self, frame: Frame, planned: Planned) -> None:
        facts = planned.facts
        maps = facts.rig.bounce
        flux = frame.resources["rsm.flux"]
        program = frame.program(planned)
        set_medium(frame, program, facts)
        if planned.stale:
            # Texels outside every tile hold nothing.
            frame.pool.framebuffer([flux]).clear(0.0, 0.0, 0.0, 0.0)
        views = frame.light_sample(bounce=True).views
        for tile, size in enumerate(maps.sizes):
            if planned.stale or facts.rig.moves(int(views[tile]["light"]), bounce=True):
                frame.set(program, tile=tile)
                frame.compute(planned, program, (size, size))
        reduce = frame.program(planned, "reduce")
        width, height = maps.size
        level = 0
        while max(width, height) > 1:
            width, height = max(1, width // 2), max(1, height // 2)
            flux.bind_to_image(0, read=True, write=False, level=level)
            flux.bind_to_image(1, read=False, write=True, level=level + 1)
            reduce.run(-(-width // 8), -(-height // 8))
            frame.gl.ctx.memory_barrier()
            level += 1


class RSMSamplingPattern(Pass):
    """Virtual point lights: points of one low-discrepancy set warped by the flux."""

    title = "RSM Sampling Pattern"
    figure = "RSM Sampling Pattern"
    reads = ("rsm.flux", "rsm.depth", "rsm.albedo", "rsm.normal", "rsm.lights", "rsm.views")
    writes = (
        Buffer("vpls", "vpls", "virtual point lights of this sub-frame", "Vpl", VPL,
               lambda f: f.settings.rsm.samples),
    )  # fmt: skip
    uniforms = (
        Uniform("vpl_count", "int", "how many to draw"),
        Uniform("view_count", "int", "views in the list"),
        Uniform("levels", "int", "levels of the flux pyramid above the texels"),
        *MEDIUM_UNIFORMS,
    )
    shaders = {"main": {"compute": "engines/rsm/vpls_comp.glsl"}}

    def defines(self, facts: Facts) -> dict[str, int]:
        return medium_defines(facts)

    def run(self, frame: Frame, planned: Planned) -> None:
        program = frame.program(planned)
        facts = planned.facts
        count = facts.settings.rsm.samples
        set_medium(frame, program, facts)
        frame.set(
            program,
            vpl_count=count,
            view_count=len(facts.rig.bounce.sizes),
            levels=max(facts.rig.bounce.size).bit_length() - 1,
        )
        frame.compute(planned, program, (count,), (64,))


class InterpolatedIndirect(Pass):
    """Indirect irradiance at one pixel per block."""

    title = "RSM Interpolated Indirect Lighting Computation"
    figure = "RSM Interpolated Indirect Lighting Computation"
    reads = ("vpls", "rsm.lights", Optional("occupancy"), "gbuffer.low_depth", "gbuffer.low_normal", "gbuffer.low_pixel")
    writes = (
        Texture("indirect.low", "low_indirect", "radiance a white Lambert surface would reflect, W/(m²·sr)", "rgba32f",
                gather_size, scratch=True),
        Texture("indirect.low_direction", "low_direction", "Σ luminance × direction, and Σ luminance, of what arrives",
                "rgba32f", gather_size, scratch=True),
    )  # fmt: skip
    uniforms = (Uniform("vpl_count", "int", "virtual point lights in the list"), *CELL_UNIFORMS, *MEDIUM_UNIFORMS)
    shaders = {"main": {"vertex": "passes/fullscreen_vert.glsl", "fragment": "engines/rsm/gather_low_frag.glsl"}}

    def defines(self, facts: Facts) -> dict[str, int]:
        return _gather_defines(facts)

    def absent(self, facts: Facts) -> str | None:
        return None if facts.settings.gather_scale > 1 else "every pixel gathers for itself"

    def run(self, frame: Frame, planned: Planned) -> None:
        program = frame.program(planned)
        frame.set(program, vpl_count=planned.facts.settings.rsm.samples)
        set_cells(frame, program, planned.facts)
        set_medium(frame, program, planned.facts)
        frame.screen(planned, program)


class IndirectLighting(Pass):
    """Indirect light of every pixel: interpolated where the low resolution has its surface, gathered where not."""

    title = "RSM Lighting Computation"
    figure = "RSM Lighting Computation"
    reads = (
        "vpls", "rsm.lights", Optional("occupancy"), "gbuffer.depth", "gbuffer.normal", Optional("gbuffer.low_depth"),
        Optional("gbuffer.low_normal"), Optional("gbuffer.low_pixel"), Optional("indirect.low"),
        Optional("indirect.low_direction"), Optional("ao"),
    )  # fmt: skip
    writes = (
        Texture("indirect.diffuse", "indirect_diffuse", "radiance a white Lambert surface would reflect, W/(m²·sr)",
                "rgba32f", _screen, when=lambda f: None if f.diffuse else "no visible material is diffuse"),
    )  # fmt: skip
    uniforms = (Uniform("vpl_count", "int", "virtual point lights in the list"), *CELL_UNIFORMS, *MEDIUM_UNIFORMS)
    shaders = {"main": {"vertex": "passes/fullscreen_vert.glsl", "fragment": "engines/rsm/lighting_frag.glsl"}}

    def defines(self, facts: Facts) -> dict[str, int]:
        return _gather_defines(facts)

    def run(self, frame: Frame, planned: Planned) -> None:
        program = frame.program(planned)
        frame.set(program, vpl_count=planned.facts.settings.rsm.samples)
        set_cells(frame, program, planned.facts)
        set_medium(frame, program, planned.facts)
        frame.screen(planned, program)
