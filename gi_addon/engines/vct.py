# SPDX-License-Identifier: GPL-3.0-or-later
"""Voxel cone tracing, Figure 4c of the paper.

C. Crassin, F. Neyret, M. Sainz, S. Green and E. Eisemann, "Interactive Indirect Illumination Using Voxel Cone Tracing",
Pacific Graphics 2011. The scene becomes a grid of cells that know what they block and what light leaves them, by
direction; whatever a surface needs to know of the rest of the scene is gathered by cones through that grid.
"""

from __future__ import annotations

import numpy as np

from ..facts import Facts
from ..frame import Frame
from ..graph import Optional, Pass, Planned, Texture, Uniform
from ..lights import Source, spread_profile
from ..passes.brdf_tables import BRDFTables
from ..passes.direct_lighting import DirectLighting, TranslucentLighting
from ..passes.gbuffer import (
    CameraTint,
    GBuffer,
    GBufferMips,
    TranslucentBack,
    TranslucentLayer,
    TranslucentTint,
    gather_scale,
    gather_size,
)
from ..passes.lights import LightList, RSMGeneration, ShadowMaps, ShadowTint
from ..passes.occupancy import Occupancy
from ..passes.reflections import GLOSSY_RAY, GLOSSY_TRACED, reflection_sharing
from ..passes.resolve import Resolve
from ..passes.screen import (
    INDIRECT_DIFFUSE,
    LOBE,
    REFRACTING,
    TRANSMISSION_INDIRECT,
    ScreenPass,
    _screen,
    no_bounce,
    no_gloss,
    no_indirect,
)
from ..passes.smoothing import BlockSmoothing, raw_gather
from ..passes.subsurface import Subsurface, SubsurfaceBack
from ..passes.volumetric import MEDIUM_UNIFORMS, Volumetric, medium_defines, set_medium
from ..passes.voxels import (
    GRID_UNIFORMS,
    STORE_GROUP,
    Voxelisation,
    all_sheets,
    cell_sheets,
    no_bodies,
    sheet_counts,
    store_groups,
    voxel_grid,
)
from ..passes.world_guide import WorldGuide
from ..passes.world_rays import WorldRays
from ..settings import Settings

# Blocks that the light of one is smoothed over, each way, where nothing that lights them is near (smooth_blocks_frag.glsl). 5 × 5
# blocks have one set of directions, whose error they share: less than twice as wide is of little use.
_SMOOTH = 4


def passes(settings: Settings, layers: tuple[str, ...]) -> list[Pass]:
    """Figure 4c, in order."""
    return [
        BRDFTables(),
        Occupancy(),
        WorldGuide(),
        LightList(),
        *([] if settings.vct.shadow_cones else [ShadowMaps(), ShadowTint()]),
        RSMGeneration(),
        Voxelisation(),
        RadianceInjection(),
        GBuffer(),
        CameraTint(),
        TranslucentLayer(),
        TranslucentBack(),
        TranslucentTint(),
        GBufferMips(),
        VoxelAO(),
        ConeHits(),
        SharedHits(),
        BlockSmoothing(
            "indirect.low", "Voxel Interpolated Indirect Lighting (smoothing)", in_pairs=True, radius=_SMOOTH, seen="vct.seen"
        ),
        IndirectLighting(),
        GlossyCones(),
        *reflection_sharing(settings),
        *([ShadowCones()] if settings.vct.shadow_cones else []),
        WorldRays(),
        DirectLighting(),
        SubsurfaceBack(),
        Subsurface(),
        TranslucentLighting(),
        RefractionCones(),
        VoxelVolumetric(),
        Resolve(layers),
    ]


# Walks from each sheet of a body in all sub-frames; how many go side by side; how many groups of those share the sheets.
WALKS, LANES, _WALKERS = 96, 32, 1024


def _unlit(facts: Facts) -> str | None:
    return no_bounce(facts) or (None if facts.lit or facts.glowing_voxels else "no light shines")


# The largest number that half floats hold.
_HALF_END = 65504.0


def _irradiance_near(source: Source, distance: float) -> float:
    """The most of a lamp's irradiance, W/m², at ``distance`` m from its point."""
    light = source.light
    emission = float(np.abs(light.emission).max())
    if light.kind == "SUN":
        return emission
    if light.kind != "AREA":
        return emission / (4.0 * np.pi * distance**2)
    tan, scale = spread_profile(0.5 * light.spread)
    return emission / (np.pi * distance**2) * (tan * scale if tan > 0.0 else 1.0)


def radiance_unit(facts: Facts) -> float:
    """What 1 in the volumes of light stands for, W/(m²·sr). They hold half floats, and a lamp of any power may stand before a
    wall: with all lights a square of a sheet's width, ¼ cell, away from white, at every bounce, none is past the end. A power of
    two, so that light scales by it exactly."""
    near = 0.25 * voxel_grid(facts).cell
    irradiance = sum(_irradiance_near(s, near) for s in facts.rig.sources if s.light is not None)
    if facts.rig.world is not None:
        irradiance += float((facts.rig.world.radiance.max(axis=-1) * facts.rig.world.solid_angle).sum())
    emitters = facts.emitters
    most = 0.0
    if len(emitters):
        brightest = emitters.radiance.max(axis=-1)
        if facts.glowing_voxels:
            most = float(brightest.max())
        else:
            irradiance += float(brightest @ emitters.areas()) / near**2
    most = max((irradiance / np.pi + most) * max(facts.settings.bounces, 1), np.finfo("f4").tiny)
    return float(2.0 ** np.ceil(np.log2(most / _HALF_END)))


def _one_bounce(facts: Facts) -> str | None:
    return None if facts.settings.bounces > 1 else "one bounce needs no other"


# What the volumes of light are read by.
_LIGHT_UNIFORMS = (
    *GRID_UNIFORMS,
    Uniform("grid_levels", "float", "mips above the cells"),
    Uniform("radiance_unit", "float", "what 1 in the volumes of light stands for, W/(m²·sr)"),
)


def _light_uniforms(facts: Facts) -> dict:
    """Values of _LIGHT_UNIFORMS."""
    grid = voxel_grid(facts)
    return {**grid.uniforms(), "grid_levels": float(grid.levels), "radiance_unit": radiance_unit(facts)}


class RadianceInjection(Pass):
    """Light that leaves the cells, and the directional mips of it."""

    title = "Voxel Radiance Injection"
    figure = "Voxel Radiance Injection, Voxel Anisotropic Mipmap Generation"
    reads = (
        "voxels.sheets", "voxels.rows", "voxels.kinds", "voxels.places",
        Optional("voxels.emission"), Optional("voxels.lamps"), Optional("voxels.bodies"),
        Optional("rsm.depth"), Optional("rsm.albedo"), Optional("rsm.normal"), Optional("rsm.lights"), Optional("rsm.views"),
    )  # fmt: skip
    writes = (
        Texture("vct.radiance", "voxel_radiance", "by sheet: radiance × alpha, in units, that leaves its front; alpha, the share "
                "of the cell's face that it covers", "rgba16f", all_sheets, access="readwrite", scratch=True),
        Texture("vct.back", "voxel_back", "the same that leaves its back", "rgba16f", all_sheets, access="readwrite",
                scratch=True),
        Texture("vct.bounce", "voxel_bounce", "by sheet of the cells: radiance of the later bounces, in units", "rgba16f",
                cell_sheets, when=_one_bounce, scratch=True),
        Texture("vct.bounce_back", "voxel_bounce_back", "the same by its back", "rgba16f", cell_sheets, when=_one_bounce,
                scratch=True),
        Texture("vct.walked", "voxel_walked", "by sheet of the cells: vct.radiance after light has walked through bodies",
                "rgba16f", cell_sheets, when=no_bodies, scratch=True),
    )  # fmt: skip
    uniforms = (
        *_LIGHT_UNIFORMS,
        Uniform("cone_count", "int", "cones that each cell gathers by"),
        Uniform("view_count", "int", "reflective shadow maps in the list"),
        Uniform("add_bounce", "int", "1 when later bounces are known"),
        Uniform("walk_count", "int", "walks from each sheet of a body; 0 to take over what the last ones found"),
        Uniform("walk_first", "uint", "number of the first"),
        Uniform("emission_scale", "float", "radiance of the brightest emitter, in units of the volumes"),
        *MEDIUM_UNIFORMS,
    )
    shaders = {
        "main": {"compute": "engines/vct/inject_comp.glsl"},
        "bodies": {"compute": "engines/vct/bodies_comp.glsl"},
        "bounce": {"compute": "engines/vct/bounce_comp.glsl"},
        "mips": {"compute": "engines/vct/mips_comp.glsl"},
    }
    depends = ("lights", "world", "transforms", "meshes", "materials")
    settings = ("vct.resolution", "vct.emissive_voxels", "vct.cones", "bounces", "use_area_lights", "use_translucency")
    repeats = True

    def rate(self, facts: Facts) -> str:
        return RSMGeneration().rate(facts) if facts.rig.bounce.sizes else "static"

    def defines(self, facts: Facts) -> dict[str, int]:
        return {**medium_defines(facts), "WALK_LANES": LANES}

    def run(self, frame: Frame, planned: Planned) -> None:
        program = frame.program(planned)
        values = {
            "view_count": len(planned.facts.rig.bounce.sizes), "cone_count": planned.facts.settings.vct.cones,
            **_light_uniforms(planned.facts),
        }  # fmt: skip
        emitters = planned.facts.emitters
        brightest = float(emitters.radiance.max()) if len(emitters) else 0.0
        if planned.stale:
            # Not all that there is memory for is in use.
            for texture in planned.texture_writes():
                frame.pool.framebuffer([frame.resources[texture.name]]).clear()
        again = planned.facts.settings.bounces - 1 if planned.has("vct.bounce") else 0
        for k in range(again + 1):
            if k:
                self._bounce(frame, planned, values)
                frame.resources["vct.bounce"].use(12)
                frame.resources["vct.bounce_back"].use(13)
            frame.set(program, add_bounce=int(k > 0), emission_scale=brightest / values["radiance_unit"], **values)
            set_medium(frame, program, planned.facts)
            _each_sheet(frame, planned, program, 0)
            if planned.has("voxels.bodies"):
                self._walk(frame, planned, {**values, "emission_scale": brightest / values["radiance_unit"]})
            build_mips(frame, planned)

    def _walk(self, frame: Frame, planned: Planned, values: dict) -> None:
        """Replace what sheets of bodies reflect by what leaves them after it has walked below the surface."""
        program = frame.program(planned, "bodies")
        moves = self.rate(planned.facts) == "subframe"
        # A still light's walks are all taken at once; one that moves takes others in each sub-frame.
        count = max(-(-WALKS // planned.facts.subframes), LANES) if moves else WALKS
        for walks, light in ((count, "vct.radiance"), (0, "vct.walked")):
            frame.resources[light].use(12)
            frame.set(program, walk_count=walks, walk_first=count * frame.subframe if moves else 0, **values)
            frame.compute(planned, program, (_WALKERS,), (1,))

    @staticmethod
    def _bounce(frame: Frame, planned: Planned, values: dict) -> None:
        """Gather what the voxels hold into vct.bounce."""
        program = frame.program(planned, "bounce")
        frame.resources["vct.radiance"].use(12)
        frame.resources["vct.back"].use(13)
        frame.set(program, **values)
        _each_sheet(frame, planned, program, 0)


def _each_sheet(frame: Frame, planned: Planned, program, level: int) -> None:
    """Run a compute program for each sheet of a level."""
    columns, rows = store_groups(sheet_counts(planned.facts)[level])
    frame.compute(planned, program, (columns * STORE_GROUP, rows), (STORE_GROUP, 1))


def build_mips(frame: Frame, planned: Planned) -> None:
    """The levels of light above the cells."""
    program = frame.program(planned, "mips")
    grid = voxel_grid(planned.facts)
    frame.set(program, **grid.uniforms())
    for level in range(1, grid.levels + 1):
        frame.set(program, coarse_level=level)
        _each_sheet(frame, planned, program, level)


# What cones read.
_VOLUMES = ("vct.radiance", "vct.back", "voxels.sheets", "voxels.rows", "voxels.kinds")
_CONE_UNIFORMS = (
    *_LIGHT_UNIFORMS,
    Uniform("cone_count", "int", "cones per point and sub-frame"),
    Uniform("cone_sets", "float", "sub-frames, whose sets of cones share the hemisphere"),
)


def _set_cones(frame: Frame, program, facts: Facts) -> None:
    frame.set(program, **_light_uniforms(facts), cone_count=facts.settings.vct.cones, cone_sets=float(facts.subframes))


_BLOCKS = ("gbuffer.low_depth", "gbuffer.low_normal", "gbuffer.low_pixel")


def _hits_defines(facts: Facts) -> dict[str, int]:
    return {"GATHER_SCALE": gather_scale(facts), "CONES": facts.settings.vct.cones}


class ConeHits(Pass):
    """Where the cones of one pixel per block end."""

    title = "Voxel Interpolated Indirect Lighting Computation"
    figure = "Voxel Interpolated Indirect Lighting Computation"
    reads = (*_VOLUMES, *_BLOCKS)
    writes = (
        Texture("vct.hits", "cone_hits", "packed (hits_lib.glsl): offset to what a cone of the block met first, cells; its "
                "normal; radiance that it brings, W/(m²·sr)", "rgba32ui", lambda f: (*gather_size(f), f.settings.vct.cones),
                layers=True, scratch=True),
        Texture("vct.joined", "joined_to", "a bit for each of four neighbours (PAIR in receiver.glsl) that is of the block's "
                "surface, with nothing between", "r8", gather_size, scratch=True),
    )  # fmt: skip
    uniforms = _CONE_UNIFORMS
    shaders = {"main": {"compute": "engines/vct/gather_low_comp.glsl"}}

    def defines(self, facts: Facts) -> dict[str, int]:
        return _hits_defines(facts)

    def absent(self, facts: Facts) -> str | None:
        return no_indirect(facts) or _unlit(facts)

    def run(self, frame: Frame, planned: Planned) -> None:
        program = frame.program(planned)
        _set_cones(frame, program, planned.facts)
        frame.compute(planned, program, gather_size(planned.facts))


class SharedHits(ScreenPass):
    """Indirect light at one pixel per block, by the hits of all blocks around."""

    title = "Voxel Interpolated Indirect Lighting (shared cones)"
    figure = "Voxel Interpolated Indirect Lighting Computation"
    reads = (*_VOLUMES, *_BLOCKS, "vct.hits", "vct.joined")
    writes = (
        *raw_gather("indirect.low"),
        Texture("vct.seen", "seen_blocks", "a bit for each of 5 × 5 blocks around that shares its cones", "r32ui", gather_size,
                scratch=True),
    )  # fmt: skip
    uniforms = _CONE_UNIFORMS
    fragment = "engines/vct/share_frag.glsl"

    def defines(self, facts: Facts) -> dict[str, int]:
        return _hits_defines(facts)

    def prepare(self, frame: Frame, planned: Planned, program) -> None:
        _set_cones(frame, program, planned.facts)


class IndirectLighting(ScreenPass):
    """Indirect light of every pixel: interpolated where the low resolution has its surface, by cones where not."""

    title = "Voxel Lighting Computation"
    figure = "Voxel Lighting Computation"
    reads = (
        *_VOLUMES, "gbuffer.depth", "gbuffer.normal", *_BLOCKS, "vct.hits", "vct.seen", "indirect.low", "indirect.low.direction",
    )  # fmt: skip
    writes = (INDIRECT_DIFFUSE,)
    uniforms = _CONE_UNIFORMS
    fragment = "engines/vct/lighting_frag.glsl"

    def defines(self, facts: Facts) -> dict[str, int]:
        return _hits_defines(facts)

    def absent(self, facts: Facts) -> str | None:
        return no_indirect(facts) or _unlit(facts)

    def prepare(self, frame: Frame, planned: Planned, program) -> None:
        _set_cones(frame, program, planned.facts)


class VoxelAO(ScreenPass):
    """Ambient occlusion by short cones."""

    title = "Voxel Ambient Occlusion"
    figure = "Voxel Lighting Computation"
    reads = (*_VOLUMES, "gbuffer.depth", "gbuffer.normal")
    writes = (
        Texture("ao", "ao", "ambient occlusion within the AO distance; 1; 1 = open", "rg16f", _screen),
    )  # fmt: skip
    uniforms = (*_CONE_UNIFORMS, Uniform("ao_distance", "float", "how far an occluder counts, m"))
    fragment = "engines/vct/ao_frag.glsl"

    def absent(self, facts: Facts) -> str | None:
        return None if facts.settings.use_ao else "ambient occlusion is switched off"

    def prepare(self, frame: Frame, planned: Planned, program) -> None:
        _set_cones(frame, program, planned.facts)
        frame.set(program, ao_distance=min(planned.facts.ao_distance, 2.0 * planned.facts.radius))


class GlossyCones(ScreenPass):
    """What glossy surfaces mirror: one cone a sub-frame, as wide as the lobe's share."""

    title = "Voxel Glossy Reflections"
    figure = "Voxel Lighting Computation"
    reads = (*_VOLUMES, "gbuffer.depth", "gbuffer.normal", *LOBE)
    writes = (GLOSSY_TRACED, GLOSSY_RAY)
    uniforms = _CONE_UNIFORMS
    fragment = "engines/vct/glossy_frag.glsl"

    def absent(self, facts: Facts) -> str | None:
        return no_gloss(facts) or _unlit(facts)

    def prepare(self, frame: Frame, planned: Planned, program) -> None:
        _set_cones(frame, program, planned.facts)


class ShadowCones(Pass):
    """Shadows by one cone a light, as wide as the light looks."""

    title = "Voxel Shadow Cones"
    figure = "Voxel Lighting Computation"
    reads = (*_VOLUMES, "lights", "gbuffer.depth", "gbuffer.normal")
    writes = (
        Texture("shadow.cones", "shadow_cones", "share of each light that reaches the surface", "r16f",
                lambda f: (*f.resolution, max(1, len(f.rig.sources))), layers=True),
    )  # fmt: skip
    uniforms = (*_CONE_UNIFORMS, Uniform("light_count", "int", "lights in the list"))
    shaders = {"main": {"compute": "engines/vct/shadow_comp.glsl"}}

    def absent(self, facts: Facts) -> str | None:
        if not facts.settings.use_shadows:
            return "shadows are switched off"
        return None if facts.lit else "no light shines"

    def run(self, frame: Frame, planned: Planned) -> None:
        program = frame.program(planned)
        _set_cones(frame, program, planned.facts)
        frame.set(program, light_count=len(planned.facts.rig.sources))
        frame.compute(planned, program, planned.facts.resolution)


class RefractionCones(ScreenPass):
    """What is seen through refracting and translucent surfaces, by cones."""

    title = "Voxel Translucency"
    figure = "Voxel Lighting Computation"
    reads = (*_VOLUMES, *REFRACTING)
    writes = (TRANSMISSION_INDIRECT,)
    uniforms = _CONE_UNIFORMS
    fragment = "engines/vct/refraction_frag.glsl"

    def absent(self, facts: Facts) -> str | None:
        return _unlit(facts)

    def prepare(self, frame: Frame, planned: Planned, program) -> None:
        _set_cones(frame, program, planned.facts)


class VoxelVolumetric(Volumetric):
    """Light in the air, blocked by voxels."""

    title = "Voxel Volumetric Light"
    reads = (
        Optional("lights", ("volume.light",)), Optional("gbuffer.depth"), *(Optional(v, ("volume.light",)) for v in _VOLUMES),
    )  # fmt: skip
    uniforms = (*Volumetric.uniforms, *_CONE_UNIFORMS)

    def defines(self, facts: Facts) -> dict[str, int]:
        # Without shadows nothing blocks.
        return {
            **super().defines(facts), "VOXEL_VISIBILITY": int(facts.settings.use_shadows and facts.triangles > 0),
            "HAS_LIGHT_VIEWS": 0, "HAS_SHADOW_DEPTH": 0, "HAS_RSM_DEPTH": 0,
        }  # fmt: skip

    def prepare(self, frame: Frame, planned: Planned, program) -> None:
        _set_cones(frame, program, planned.facts)
        super().prepare(frame, planned, program)
