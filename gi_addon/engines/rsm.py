# SPDX-License-Identifier: GPL-3.0-or-later
"""Reflective shadow maps, Figure 4a of the paper.

C. Dachsbacher and M. Stamminger, "Reflective Shadow Maps", I3D 2005. What the lights see becomes a set of virtual point
lights, drawn in proportion to the flux they reflect, the same for all pixels and another in each sub-frame. Indirect
light is gathered at low resolution and interpolated where surfaces agree.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ..facts import Facts
from ..frame import Frame
from ..gpu_types import LIGHT_MESH, VPL
from ..graph import Buffer, Optional, Pass, Planned, Texture, Uniform
from ..passes.ao import AOBlur, AOGeneration
from ..passes.brdf_tables import BRDFTables
from ..passes.direct_lighting import DirectLighting, TranslucentLighting
from ..passes.gbuffer import CameraTint, GBuffer, GBufferMips, TranslucentBack, TranslucentLayer, TranslucentTint, gather_size
from ..passes.lights import LightList, RSMGeneration, ShadowMaps, ShadowTint
from ..passes.occupancy import CELL_UNIFORMS, Occupancy, set_cells
from ..passes.reflections import GLOSSY_RAY, GLOSSY_TRACED, reflection_sharing
from ..passes.resolve import Resolve
from ..passes.screen import (
    DIRECTION,
    INDIRECT_DIFFUSE,
    LOBE,
    REFRACTING,
    TRANSMISSION_INDIRECT,
    ScreenPass,
    no_indirect,
)
from ..passes.subsurface import Subsurface, SubsurfaceBack
from ..passes.surface_points import SETS, SurfacePoints, points_per_subframe
from ..passes.volumetric import MEDIUM_UNIFORMS, Volumetric, air, medium_defines, set_medium
from ..passes.world_guide import WorldGuide
from ..passes.world_rays import WorldRays
from ..settings import Settings


def passes(settings: Settings, layers: tuple[str, ...]) -> list[Pass]:
    """Figure 4a, in order."""
    return [
        BRDFTables(),
        Occupancy(),
        WorldGuide(),
        LightList(),
        ShadowMaps(),
        ShadowTint(),
        RSMGeneration(),
        RSMFlux(),
        SurfacePoints(),
        GBuffer(),
        CameraTint(),
        RSMImportance(settings),
        RSMSamplingPattern(settings),
        TranslucentLayer(),
        TranslucentBack(),
        TranslucentTint(),
        GBufferMips(),
        AOGeneration(cells="ao" in layers),  # only the pass itself asks farther than contacts
        AOBlur(),
        InterpolatedIndirect(settings),
        IndirectLighting(settings),
        WorldRays(),
        DirectLighting(),
        SubsurfaceBack(),
        Subsurface(),
        TranslucentLighting(),
        GlossyReflections(),
        *reflection_sharing(settings),
        Refraction(),
        Volumetric(),
        Resolve(layers),
    ]


def _gather_defines(facts: Facts, *, always: bool = False) -> dict[str, int]:
    lamps = any(s.kind == LIGHT_MESH for s in facts.rig.sources)
    untested = {"HAS_OCCUPANCY": 0} if facts.settings.rsm.visibility == "NONE" and not always else {}
    return {
        "GATHER_SCALE": facts.settings.gather_scale, "MESH_LIGHTS": int(lamps), "VISIBILITY_RAYS": _rays(facts),
        **medium_defines(facts), **untested,
    }  # fmt: skip


# Of fewer rays, drawing which virtual lights to test takes longer than the rays.
_FEWEST_RAYS = 16


def _rays(facts: Facts) -> int:
    """Virtual lights that a pixel tests in a sub-frame; 0: all, as where lights are to add up exactly: which ones are drawn
    hangs on what the others send."""
    rsm = facts.settings.rsm
    rays = max(-(-rsm.visibility_rays // facts.subframes), _FEWEST_RAYS)
    return rays if rsm.visibility_rays > 0 and not rsm.own_samples and rays < vpl_count(facts) else 0


def first_count(facts: Facts) -> int:
    """Virtual point lights of the first bounce."""
    rsm = facts.settings.rsm
    # As the shader tells lights apart (engines/rsm/vpls_comp.glsl).
    salts = [s.salt for s, first in zip(facts.rig.sources, facts.rig.bounce.first, strict=True) if first >= 0]
    lights = sum(a != b for a, b in pairwise((None, *salts)))
    return rsm.samples * (max(lights, 1) if rsm.own_samples else 1)


def vpl_count(facts: Facts) -> int:
    """Virtual point lights of all bounces, and those in the air."""
    return first_count(facts) + max(facts.settings.bounces - 1, 0) * points_per_subframe(facts) + air_count(facts)


def air_count(facts: Facts) -> int:
    """Points of the air that scatter light onto surfaces: half as many as first-bounce lights, being smoother."""
    found = air(facts)
    return max(1, facts.settings.rsm.samples // 2) if any(any(d.medium.scattering) for d in found) else 0


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
    repeats = True

    def rate(self, facts: Facts) -> str:
        return RSMGeneration().rate(facts)

    def defines(self, facts: Facts) -> dict[str, int]:
        return medium_defines(facts)

    def absent(self, facts: Facts) -> str | None:
        return no_indirect(facts)

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
        _sum_up(frame, frame.program(planned, "reduce"), flux)


def _sum_up(frame: Frame, reduce, texture) -> None:
    """Fill the levels of ``texture`` with sums over 2 × 2 texels of the level below, down to one texel."""
    width, height = texture.size
    level = 0
    while max(width, height) > 1:
        width, height = max(1, width // 2), max(1, height // 2)
        texture.bind_to_image(0, read=True, write=False, level=level)
        texture.bind_to_image(1, read=False, write=True, level=level + 1)
        reduce.run(-(-width // 8), -(-height // 8))
        frame.gl.ctx.memory_barrier()
        level += 1


# Points of the picture, and of surfaces where light bounces on, that virtual lights are drawn for.
_RECEIVERS = 256
_MOST_BLOCKS = 512


def _block_level(facts: Facts) -> int:
    """The level of the flux pyramid whose texels are drawn by importance: no more than ``_MOST_BLOCKS``, each of one map."""
    width, height = facts.rig.bounce.size
    level = 0
    while (width >> level) * (height >> level) > _MOST_BLOCKS:
        level += 1
    return min(level, *((s - 1).bit_length() for s in facts.rig.bounce.sizes))


def _block_count(facts: Facts) -> tuple[int, int]:
    width, height = facts.rig.bounce.size
    return max(1, width >> _block_level(facts)), max(1, height >> _block_level(facts))


class RSMImportance(Pass):
    """How much of what each block of RSM texels reflects arrives where it is seen: what to draw virtual lights by."""

    title = "RSM Importance"
    reads = (
        "rsm.flux", "rsm.depth", "rsm.albedo", "rsm.normal", "rsm.lights", "rsm.views", "gbuffer.depth", "gbuffer.normal",
        Optional("surface.points"),
    )  # fmt: skip
    writes = (
        Texture("rsm.importance", "rsm_importance", "chance of the block of RSM texels to hold a virtual light", "r32f",
                _block_count, mips=lambda f: max(_block_count(f)).bit_length() - 1),
        Buffer("rsm.importance.blocks", "importance", "share of a block in what receivers get, over its flux, 1/W", "float",
               np.dtype("f4"), lambda f: int(np.prod(_block_count(f))), scratch=True),
        Buffer("rsm.importance.sent", "importance_sent", "what each block sends to each receiver, W", "float", np.dtype("f4"),
               lambda f: int(np.prod(_block_count(f))) * _RECEIVERS, scratch=True),
        Buffer("rsm.importance.total", "importance_total", "what each light's blocks send to each receiver, W", "float",
               np.dtype("f4"), lambda f: len(f.rig.sources) * _RECEIVERS, scratch=True),
    )  # fmt: skip
    uniforms = (
        Uniform("view_count", "int", "views in the list"),
        Uniform("light_count", "int", "lights with reflective shadow maps"),
        Uniform("point_first", "int", "the sub-frame's first surface point"),
        Uniform("point_count", "int", "surface points of a bounce"),
        *MEDIUM_UNIFORMS,
        *CELL_UNIFORMS,
    )
    shaders = {
        "main": {"compute": "engines/rsm/importance_comp.glsl"},
        "total": {"compute": "engines/rsm/importance_total_comp.glsl"},
        "mean": {"compute": "engines/rsm/importance_mean_comp.glsl"},
        "share": {"compute": "engines/rsm/importance_share_comp.glsl"},
        "reduce": {"compute": "engines/rsm/flux_reduce_comp.glsl"},
    }

    def __init__(self, settings: Settings) -> None:
        self.reads = _tested(type(self).reads, settings)

    def absent(self, facts: Facts) -> str | None:
        return _adds_up(facts)

    def defines(self, facts: Facts) -> dict[str, int]:
        return {**_gather_defines(facts), "BLOCK_LEVEL": _block_level(facts), "RECEIVERS": _RECEIVERS}

    def run(self, frame: Frame, planned: Planned) -> bool:
        facts, blocks = planned.facts, _block_count(planned.facts)
        views, lights = len(facts.rig.bounce.sizes), len(facts.rig.sources)
        # The first sub-frame's serves the others, whose samples are one even set only if all are drawn alike; and other pictures
        # of the same, whatever it hangs on.
        seen = (facts.stamps, facts.resolution, facts.subframes, facts.settings.as_dict())
        if planned.stale or (frame.subframe == 0 and planned.memory.get("seen") != seen):
            planned.memory["seen"] = seen
            program = frame.program(planned)
            set_medium(frame, program, facts)
            set_cells(frame, program, facts)
            frame.set(program, view_count=views, point_first=0, point_count=points_per_subframe(facts))
            frame.compute(planned, program, (blocks[0] * blocks[1] * _RECEIVERS,), (64,))
            for key, count in (("total", lights * _RECEIVERS), ("mean", blocks[0] * blocks[1])):
                program = frame.program(planned, key)
                frame.set(program, view_count=views, light_count=lights)
                frame.compute(planned, program, (count,), (64,))
        elif not facts.rig.any_moves(facts.rig.bounce, bounce=True):
            return False
        program = frame.program(planned, "share")
        frame.set(program, view_count=views)
        frame.compute(planned, program, blocks)
        _sum_up(frame, frame.program(planned, "reduce"), frame.resources["rsm.importance"])
        return True


class RSMSamplingPattern(Pass):
    """Virtual point lights: points of one low-discrepancy set warped by the flux."""

    title = "RSM Sampling Pattern"
    figure = "RSM Sampling Pattern"
    reads = (
        "rsm.flux", Optional("rsm.importance"), "rsm.depth", "rsm.albedo", "rsm.normal", "rsm.lights", "rsm.views",
    )  # fmt: skip
    writes = (
        Buffer("vpls.drawn", "drawn_vpls", "those of the first bounce, as they were drawn", "Vpl", VPL, first_count,
               scratch=True),
        Buffer("vpls", "vpls", "virtual point lights of this sub-frame", "Vpl", VPL,
               vpl_count),
    )  # fmt: skip
    uniforms = (
        Uniform("vpl_count", "int", "how many to draw; for the next bounce and the air: where the last ones end"),
        Uniform("view_count", "int", "views in the list"),
        Uniform("own_samples", "int", "virtual lights that each light has for itself; 0: they share all by flux"),
        Uniform("bounce_first", "int", "the first light of the bounce before"),
        Uniform("point_first", "int", "the sub-frame's first surface point"),
        Uniform("point_count", "int", "surface points of a bounce"),
        *MEDIUM_UNIFORMS,
        *CELL_UNIFORMS,
    )
    shaders = {
        "main": {"compute": "engines/rsm/vpls_comp.glsl"},
        "order": {"compute": "engines/rsm/order_comp.glsl"},
        "air": {"compute": "engines/rsm/air_comp.glsl"},
        "bounce": {"compute": "engines/rsm/bounce_comp.glsl"},
    }

    def __init__(self, settings: Settings) -> None:
        points = ("surface.points",) if settings.bounces > 1 else ()
        self.reads = _tested((*type(self).reads, *points), settings)

    def defines(self, facts: Facts) -> dict[str, int]:
        return {**_gather_defines(facts), "BLOCK_LEVEL": _block_level(facts)}

    def run(self, frame: Frame, planned: Planned) -> None:
        program = frame.program(planned)
        facts = planned.facts
        rsm, count = facts.settings.rsm, first_count(facts)
        set_medium(frame, program, facts)
        set_cells(frame, program, facts)
        frame.set(
            program,
            vpl_count=count,
            view_count=len(facts.rig.bounce.sizes),
            own_samples=rsm.samples if rsm.own_samples else 0,
        )
        frame.compute(planned, program, (count,), (64,))
        order = frame.program(planned, "order")
        frame.set(order, vpl_count=count)
        frame.compute(planned, order, (count,), (64,))
        if facts.settings.bounces > 1:
            self._more_bounces(frame, planned, count)
        if air_count(facts):
            self._air(frame, planned)

    @staticmethod
    def _air(frame: Frame, planned: Planned) -> None:
        program, facts = frame.program(planned, "air"), planned.facts
        count = air_count(facts)
        set_medium(frame, program, facts)
        frame.set(
            program,
            point_count=count,
            vpl_count=vpl_count(facts) - count,
            view_count=len(facts.rig.bounce.sizes),
        )
        frame.compute(planned, program, (count,), (64,))

    @staticmethod
    def _more_bounces(frame: Frame, planned: Planned, count: int) -> None:
        program = frame.program(planned, "bounce")
        facts = planned.facts
        points = points_per_subframe(facts)
        sets = min(facts.subframes, SETS)
        set_medium(frame, program, facts)
        set_cells(frame, program, facts)
        first = 0
        for _ in range(facts.settings.bounces - 1):
            frame.set(program, vpl_count=count, bounce_first=first, point_count=points,
                      point_first=frame.subframe % sets * points)
            frame.compute(planned, program, (points,), (64,))
            first, count = count, count + points


def _tested(reads: tuple, settings: Settings) -> tuple:
    """``reads`` with the cells, where visibility is tested."""
    return reads if settings.rsm.visibility == "NONE" else (Optional("occupancy"), *reads)


def _adds_up(facts: Facts) -> str | None:
    """Why a light's virtual lights must not hang on what other lights send, or None."""
    return "lights are to add up exactly, each with what is its own" if facts.settings.rsm.own_samples else None


class InterpolatedIndirect(ScreenPass):
    """Indirect irradiance at one pixel per block."""

    title = "RSM Interpolated Indirect Lighting Computation"
    figure = "RSM Interpolated Indirect Lighting Computation"
    reads = ("vpls", "rsm.lights", "gbuffer.low_depth", "gbuffer.low_normal", "gbuffer.low_pixel")
    writes = (
        Texture("indirect.low", "low_indirect", "radiance a white Lambert surface would reflect, W/(m²·sr)", "rgba32f",
                gather_size, scratch=True),
        Texture("indirect.low_direction", "low_direction", DIRECTION, "rgba32f", gather_size, scratch=True),
        Texture("indirect.low_slope", "low_slope", "gradient of that radiance over the position, over the radiance, 1/m",
                "rgba32f", gather_size, scratch=True, when=_adds_up),
    )  # fmt: skip
    uniforms = (Uniform("vpl_count", "int", "virtual point lights in the list"), *CELL_UNIFORMS, *MEDIUM_UNIFORMS)
    fragment = "engines/rsm/gather_low_frag.glsl"

    def __init__(self, settings: Settings) -> None:
        self.reads = _tested(type(self).reads, settings)

    def defines(self, facts: Facts) -> dict[str, int]:
        return _gather_defines(facts)

    def absent(self, facts: Facts) -> str | None:
        return None if facts.settings.gather_scale > 1 else "every pixel gathers for itself"

    def prepare(self, frame: Frame, planned: Planned, program) -> None:
        frame.set(program, vpl_count=vpl_count(planned.facts))
        set_cells(frame, program, planned.facts)
        set_medium(frame, program, planned.facts)


class IndirectLighting(ScreenPass):
    """Indirect light of every pixel: interpolated where the low resolution has its surface, gathered where not."""

    title = "RSM Lighting Computation"
    figure = "RSM Lighting Computation"
    reads = (
        "vpls", "rsm.lights", "gbuffer.depth", "gbuffer.normal", Optional("gbuffer.low_depth"),
        Optional("gbuffer.low_normal"), Optional("gbuffer.low_pixel"), Optional("indirect.low"),
        Optional("indirect.low_direction"), Optional("indirect.low_slope"), Optional("ao"),
    )  # fmt: skip
    writes = (INDIRECT_DIFFUSE,)
    uniforms = (Uniform("vpl_count", "int", "virtual point lights in the list"), *CELL_UNIFORMS, *MEDIUM_UNIFORMS)
    fragment = "engines/rsm/lighting_frag.glsl"

    def __init__(self, settings: Settings) -> None:
        self.reads = _tested(type(self).reads, settings)

    def defines(self, facts: Facts) -> dict[str, int]:
        return _gather_defines(facts)

    def prepare(self, frame: Frame, planned: Planned, program) -> None:
        frame.set(program, vpl_count=vpl_count(planned.facts))
        set_cells(frame, program, planned.facts)
        set_medium(frame, program, planned.facts)


_RAY_READS = (
    "occupancy", "rsm.depth", "rsm.normal", "rsm.albedo", "rsm.lights", "rsm.views", "gbuffer.depth", "gbuffer.normal",
    Optional("vpls"), Optional("gbuffer.emission", ("transmission.indirect",)), Optional("gbuffer.diffuse"),
    Optional("direct.diffuse"), Optional("indirect.diffuse"),
)  # fmt: skip
_RAY_UNIFORMS = (
    *CELL_UNIFORMS,
    *MEDIUM_UNIFORMS,
    Uniform("rsm_light_count", "int", "lights with reflective shadow maps"),
    Uniform("vpl_count", "int", "virtual point lights in the list"),
)


def _set_ray(frame: Frame, program, facts: Facts) -> None:
    set_cells(frame, program, facts)
    set_medium(frame, program, facts)
    frame.set(program, rsm_light_count=len(facts.rig.sources), vpl_count=vpl_count(facts))


class GlossyReflections(ScreenPass):
    """What glossy surfaces mirror of lit surfaces: a ray per pixel, cast in the RSMs."""

    title = "RSM Glossy Reflections"
    figure = "Ray Casting in RSM"
    reads = (*_RAY_READS, *LOBE)
    writes = (GLOSSY_TRACED, GLOSSY_RAY)
    uniforms = _RAY_UNIFORMS
    fragment = "engines/rsm/glossy_frag.glsl"

    def defines(self, facts: Facts) -> dict[str, int]:
        return _gather_defines(facts, always=True)

    def absent(self, facts: Facts) -> str | None:
        return None if facts.settings.use_glossy else "glossy reflections are switched off"

    def prepare(self, frame: Frame, planned: Planned, program) -> None:
        _set_ray(frame, program, planned.facts)


class Refraction(ScreenPass):
    """What is seen through refracting surfaces: a refracted ray per pixel, cast in the RSMs, which hold no such surface."""

    title = "RSM Translucency"
    figure = "Ray Casting in RSM"
    reads = (*_RAY_READS, *REFRACTING)
    writes = (TRANSMISSION_INDIRECT,)
    uniforms = _RAY_UNIFORMS
    fragment = "engines/rsm/refraction_frag.glsl"

    def defines(self, facts: Facts) -> dict[str, int]:
        return _gather_defines(facts, always=True)

    def prepare(self, frame: Frame, planned: Planned, program) -> None:
        _set_ray(frame, program, planned.facts)
