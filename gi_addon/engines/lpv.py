# SPDX-License-Identifier: GPL-3.0-or-later
"""Light propagation volumes, Figure 4b of the paper.

A. Kaplanyan and C. Dachsbacher, "Cascaded Light Propagation Volumes for Real-Time Indirect Illumination", I3D 2010. What the
lights see is injected into a grid over the scene, carried from cell to cell along discrete ordinates, stopped by a volume of
the scene's geometry, and looked up at each pixel.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations, product

import moderngl
import numpy as np

from ..facts import Facts
from ..frame import Frame
from ..gpu_types import LIGHT_AREA, LIGHT_SUN, LIGHT_WORLD
from ..graph import Buffer, Optional, Pass, Planned, Texture, Uniform
from ..nested_grids import MOST_GRIDS, Grid, grids_needed, nested_grids
from ..passes.ao import AOBlur
from ..passes.brdf_tables import BRDFTables
from ..passes.direct_lighting import DirectLighting, TranslucentLighting
from ..passes.gbuffer import CameraTint, GBuffer, TranslucentBack, TranslucentLayer, TranslucentTint
from ..passes.lights import LightList, RSMGeneration, ShadowMaps, ShadowTint
from ..passes.occupancy import CELL_UNIFORMS, Occupancy, set_cells
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
from ..passes.subsurface import Subsurface, SubsurfaceBack
from ..passes.volumetric import MEDIUM_UNIFORMS, Volumetric, air, medium_defines, no_air, set_medium, step_turn
from ..passes.voxels import BodyVoxels, voxel_grid
from ..passes.world_guide import WorldGuide
from ..passes.world_rays import WorldRays
from ..scene import SHADOW
from ..settings import Settings

SH_COUNT = 9
# Points of a cell's cross-section that the geometry is tested at, along each side: odd, so that one is in the middle, and
# their squares are bits of one word.
_POINTS = 5
# Bytes of ordinates carried at once; more go in turns, so that fine grids fit.
_BATCH_BYTES = 64 << 20
# Texels along a side of a 3D texture that every OpenGL 4.3 allows.
_LEAST_3D_SIZE = 2048
# Fixed point keeps two of 32 bits for what the bound of a cell's flux leaves out (shading normals at grazing light).
_FIXED_UNITS = float(1 << 29)
# Lights weaker than the group's brightest by more than this are summed in units of their own: a texel of a 256² cube map
# then still is 2²⁹ / (6 · 256² · 16 · 4) > 20 units.
_GROUP_RATIO = 16.0


def passes(settings: Settings, layers: tuple[str, ...]) -> list[Pass]:
    """Figure 4b, in order."""
    injection = RadianceInjection()
    return [
        BRDFTables(),
        Occupancy(),
        WorldGuide(),
        LightList(),
        ShadowMaps(),
        ShadowTint(),
        RSMGeneration(),
        GeometryInjection(),
        AirVolume(),
        BodyVoxels(),
        injection,
        GBuffer(),
        CameraTint(),
        TranslucentLayer(),
        TranslucentBack(),
        TranslucentTint(),
        Propagation(injection, settings.bounces, settings.lpv.iterations),
        AmbientOcclusion(),
        AOBlur(),
        IndirectLighting(),
        WorldRays(),
        DirectLighting(),
        SubsurfaceBack(),
        Subsurface(),
        TranslucentLighting(),
        GlossyLighting(),
        *reflection_sharing(settings),
        Refraction(),
        Volumetric(),
        InScattering(),
        Resolve(layers),
    ]


# --- the grid ---------------------------------------------------------------------------------------------------------


def grid_count(facts: Facts) -> int:
    """Grids within each other. Iterations are cells of one grid."""
    chosen = facts.settings.lpv
    if chosen.iterations:
        return 1
    if chosen.cascades != "AUTO":
        return int(chosen.cascades)
    return min(grids_needed(facts.focus, chosen.resolution) + int(_endless(facts)), MOST_GRIDS)


def _endless(facts: Facts) -> bool:
    """Whether air that scatters goes on outside of the scene."""
    return any(domain.unit_from_world is None and max(domain.medium.scattering) > 0.0 for domain in air(facts))


def grids(facts: Facts) -> list[Grid]:
    """The frame's grids, the outermost first."""
    focus = facts.focus
    if _endless(facts) and grid_count(facts) > 1:
        # One more around all, of cells twice as wide and as many of them: what the scene sends out lights the air before it.
        margin = 0.5 * float((focus.region[1] - focus.region[0]).max())
        focus = replace(focus, region=focus.region + margin * np.array([[-1.0], [1.0]]))
    return nested_grids(focus, facts.settings.lpv.resolution, grid_count(facts), facts.eye)


def grid(facts: Facts) -> Grid:
    """The frame's outermost grid, over all of the scene."""
    return grids(facts)[0]


def _size(facts: Facts, layers: int) -> tuple[int, int, int]:
    """Texels of a volume of all grids, side by side along x, with so many values a cell, one behind the other along z."""
    every = grids(facts)
    return sum(g.size[0] for g in every), max(g.size[1] for g in every), max(g.size[2] for g in every) * layers


def _sh_size(facts: Facts) -> tuple[int, int, int]:
    return _size(facts, SH_COUNT)


def _cells(facts: Facts) -> int:
    return sum(g.cells for g in grids(facts))


def _most_cells(facts: Facts) -> int:
    return max(g.cells for g in grids(facts))


_GRID = (
    Uniform("grid_origin", "vec3", "low corner of the grid, world space, m"),
    Uniform("grid_cell", "float", "edge of a cell, m"),
    Uniform("grid_size", "ivec3", "cells along each axis"),
    Uniform("grid_column", "int", "where the grid's cells begin along x in textures"),
    Uniform("grid_first", "int", "where they begin in buffers"),
    Uniform("grid_rim", "int", "bit 2·axis for the low, 2·axis + 1 for the high side that the grid around it goes on behind"),
)


def _set_grid(frame: Frame, program, g: Grid, **more) -> None:
    frame.set(
        program, grid_origin=g.origin, grid_cell=g.cell, grid_size=g.size, grid_column=g.column, grid_first=g.first,
        grid_rim=g.rim, **more,
    )  # fmt: skip


# What looks light up chooses among the grids at each point (lookup of lpv_lib.glsl).
_GRIDS = (
    Uniform("grid_places", "mat4", "a column per grid, the outermost first: low corner, world space, and edge of a cell, m"),
    Uniform("grid_sizes", "mat4", "cells along each axis; where the grid's cells begin along x in textures"),
    Uniform("grid_bounds", "mat4", "where its cells begin in buffers; its rim"),
)


def _set_grids(frame: Frame, program, facts: Facts, **more) -> None:
    places, sizes, bounds = (np.zeros((MOST_GRIDS, 4), "f4") for _ in range(3))
    for k, g in enumerate(grids(facts)):
        places[k], sizes[k], bounds[k, :2] = (*g.origin, g.cell), (*g.size, g.column), (g.first, g.rim)
    frame.set(program, grid_places=places, grid_sizes=sizes, grid_bounds=bounds, **more)


def _defines(facts: Facts, *, chooses: bool = False) -> dict[str, int]:
    """``LPV_GRIDS``, how many there are, and ``LPV_CHOOSES``: whether a shader chooses among them."""
    return {"LPV_GRIDS": grid_count(facts), "LPV_CHOOSES": int(chooses)}


def _place(facts: Facts) -> tuple:
    """Where the camera has put the grids."""
    return tuple(g.low for g in grids(facts))


_AIR_SETTINGS = ("use_volumetric", "volume.density", "volume.anisotropy")


# --- ordinates --------------------------------------------------------------------------------------------------------


# Quadratures of the sphere that are symmetric under the cube's 48 turns and mirrorings and have no direction within 5.6° of a
# plane of the grid: (coordinates of one point, share of 4π) per orbit. Exact to degrees 7 and 9, by Newton's method on the
# orbits' moments, the widest spaced of the solutions found. Directions along the grid, as in Lebedev's sets, carry the
# outline of a lit patch across the room unblurred: on the empty Cornell box, 50 of Lebedev's have relMSE .082 and 48 of these
# .04 at 32³.
_ORBITS = {
    48: (((0.25478280537, 0.25478280537, 0.932829804507), 0.49655563),
         ((0.266270511079, 0.68157905445, 0.68157905445), 0.50344437)),
    72: (((0.142759509604, 0.142759509604, 0.979407701029), 0.22828848),
         ((0.256275965365, 0.536578884934, 0.803993613046), 0.77171152)),
    144: (((0.181117460139, 0.391683486461, 0.90209783952), 0.2646660385),
          ((0.177707450155, 0.580907500805, 0.794334021472), 0.3823401109),
          ((0.147536494472, 0.147536494472, 0.977990779915), 0.1644058153),
          ((0.495855808427, 0.495855808427, 0.712919374472), 0.1885880353)),
    288: (((0.306391330917, 0.585920819733, 0.750214066345), 0.1139510715),
          ((0.101403914618, 0.300315166774, 0.948434524206), 0.1710499836),
          ((0.442644575653, 0.556614909494, 0.703026046583), 0.1589692862),
          ((0.123857795631, 0.607440714162, 0.78464961941), 0.2201318591),
          ((0.13286093855, 0.452236183597, 0.881946940158), 0.1327282293),
          ((0.346907513668, 0.346907513668, 0.871384159783), 0.1270949758),
          ((0.098917291449, 0.098917291449, 0.990167025761), 0.0760745945)),
}  # fmt: skip


def ordinates(count: int) -> np.ndarray:
    """Directions and solid angles (count, 4) f4 of one of the quadratures; the solid angles sum to 4π sr."""
    rows = []
    for point, share in _ORBITS[count]:
        places = sorted(set(permutations(point)))
        found = [np.array(place) * signs for place in places for signs in product((-1.0, 1.0), repeat=3)]
        rows += [(*w, 4.0 * np.pi * share / len(found)) for w in found]
    return np.array(rows, "f4")


# Cells along the longest side up to which so many ordinates do. A beam is spread by √(distance × cell) on its way from cell to
# cell, which must cover what lies between two ordinates, distance × √(4π/count): the count goes with the resolution. Measured on
# stability's corner, relMSE with 72, 144 and 288: .0018, .0016, - at 32 cells; .0027, .0012, .0008 at 64; .0049, .0017, - at 128.
_ENOUGH = ((32, 72), (64, 144), (128, 288))


def ordinate_count(facts: Facts) -> int:
    """Directions that light travels in."""
    chosen = facts.settings.lpv
    if chosen.directions != "AUTO":
        return int(chosen.directions)
    return next(count for most, count in _ENOUGH if chosen.resolution <= most)


def _batch(facts: Facts) -> int:
    """Ordinates carried at once."""
    size = _size(facts, 1)
    most = min(_BATCH_BYTES // (16 * int(np.prod(size))), _LEAST_3D_SIZE // size[2])
    return int(np.clip(most, 1, ordinate_count(facts)))


# --- passes -----------------------------------------------------------------------------------------------------------


class AirVolume(Pass):
    """What light meets in the air of each cell."""

    title = "LPV Air Volume"
    figure = "LPV Propagation"
    writes = (
        Texture("lpv.air", "lpv_air", "per cell the air's extinction, 1/m; its scattering, 1/m, and mean cosine", "rgba32f",
                lambda f: _size(f, 2), access="readwrite"),
    )  # fmt: skip
    uniforms = (*_GRID, *MEDIUM_UNIFORMS)
    shaders = {"main": {"compute": "engines/lpv/medium_comp.glsl"}}
    depends = ("world", "transforms", "materials")
    settings = ("lpv.resolution", "lpv.cascades", *_AIR_SETTINGS)

    def place(self, facts: Facts) -> tuple:
        return _place(facts)

    def rate(self, facts: Facts) -> str:
        return "static"

    def defines(self, facts: Facts) -> dict[str, int]:
        return {**_defines(facts), **medium_defines(facts)}

    def absent(self, facts: Facts) -> str | None:
        return no_air(facts)

    def run(self, frame: Frame, planned: Planned) -> None:
        program = frame.program(planned)
        set_medium(frame, program, planned.facts)
        for g in grids(planned.facts):
            _set_grid(frame, program, g)
            frame.compute(planned, program, g.size, (4, 4, 4))


class RadianceInjection(Pass):
    """Flux that the RSMs' texels reflect, into the cells in front of them, and what the air scatters of their rays.

    Lights that are another point in each sub-frame are summed over the sub-frames so far; ``count`` says how many.
    """

    title = "LPV Radiance Injection"
    figure = "LPV Radiance Injection"
    reads = (
        "rsm.depth", "rsm.normal", "rsm.albedo", "rsm.lights", "rsm.views", Optional("lpv.walls"),
        *(Optional(f"voxels.{name}") for name in ("bodies", "sheets", "rows", "kinds")),
    )  # fmt: skip
    writes = (
        Texture("lpv.source", "lpv_source", "harmonics of the intensity that surfaces send into each cell, over the face of a "
                "cell, W/(m²·sr)", "rgba32f", _sh_size, access="readwrite"),
        Buffer("lpv.flux", "lpv_flux", "its sums in fixed point: cell, harmonic, colour", "int", np.dtype("i4"),
               lambda f: _most_cells(f) * SH_COUNT * 3, scratch=True),
    )  # fmt: skip
    uniforms = (
        *_GRID,
        Uniform("tile", "int", "index of the view whose tile is injected"),
        Uniform("fixed_scale", "float", "units of fixed point per W"),
        Uniform("first_group", "int", "1 where the volume starts anew with these sums"),
        Uniform("body_low", "vec3", "corner of the bodies' voxels, world space, m"),
        Uniform("body_cell", "float", "width of their cells, m"),
        Uniform("body_size", "ivec3", "cells along x, y, z"),
        *MEDIUM_UNIFORMS,
    )
    shaders = {
        "main": {"compute": "engines/lpv/inject_comp.glsl"},
        "scatter": {"compute": "engines/lpv/scatter_comp.glsl"},
        "source": {"compute": "engines/lpv/source_comp.glsl"},
    }
    depends = ("lights", "world", "transforms", "meshes", "materials")
    settings = ("lpv.resolution", "lpv.cascades", "lpv.occlusion", "vct.resolution", "use_translucency", *_AIR_SETTINGS)

    def __init__(self) -> None:
        self.count = 0

    def place(self, facts: Facts) -> tuple:
        return _place(facts)

    def rate(self, facts: Facts) -> str:
        return RSMGeneration().rate(facts)

    def defines(self, facts: Facts) -> dict[str, int]:
        return {**_defines(facts), **medium_defines(facts)}

    def absent(self, facts: Facts) -> str | None:
        return no_bounce(facts)

    def run(self, frame: Frame, planned: Planned) -> None:
        facts = planned.facts
        inject, source = frame.program(planned), frame.program(planned, "source")
        sample = frame.light_sample(bounce=True)
        flux = frame.resources["lpv.flux"]
        programs = [inject]
        if scatters(facts):
            programs.append(frame.program(planned, "scatter"))
        for program in programs:
            set_medium(frame, program, facts)
        if planned.has("voxels.bodies"):
            bodies = voxel_grid(facts)
            frame.set(inject, body_low=bodies.low, body_cell=bodies.cell, body_size=bodies.size)
        self.count = 1 if planned.stale or frame.subframe == 0 else self.count + 1
        for g in grids(facts):
            for first, (scale, lights) in enumerate(fixed_point_groups(sample.lights, g.cell)):
                flux.clear()
                for tile, view in enumerate(sample.views):
                    if int(view["light"]) in lights:
                        for program in programs:
                            _set_grid(frame, program, g, tile=tile, fixed_scale=scale)
                            frame.compute(planned, program, (int(view["rect"][2]), int(view["rect"][3])))
                _set_grid(frame, source, g, fixed_scale=scale, first_group=int(first == 0 and self.count == 1))
                frame.compute(planned, source, (*g.size[:2], g.size[2] * SH_COUNT), (4, 4, 4))


def scatters(facts: Facts) -> bool:
    """Whether there is air that scatters."""
    return any(max(domain.medium.scattering) > 0.0 for domain in air(facts))


def fixed_point_groups(lights: np.ndarray, cell: float) -> list[tuple[float, set[int]]]:
    """(units per W, indices of LIGHT rows) of lights that may share integer sums: the sum of the fluxes that each can bring
    into one cell stays below the integers' end, and no light is lost below their unit."""
    emission = np.abs(lights["emission"]).max(axis=1).astype("f8")
    directional = np.isin(lights["kind"], (LIGHT_SUN, LIGHT_WORLD))
    # A lamp: all its power. Parallel light: surfaces that end in one cell lie within three cells of it, and that box shows
    # the light at most √3 · 9 h² < 16 h² of cross-section.
    solid_angle = np.where(lights["kind"] == LIGHT_AREA, 2.0 * np.pi, 4.0 * np.pi)
    bound = np.where(directional, emission * 16.0 * cell * cell, emission * solid_angle)
    groups: list[tuple[float, set[int]]] = []
    order = [int(i) for i in np.argsort(-bound, kind="stable") if bound[i] > 0.0]
    while order:
        brightest = bound[order[0]]
        group = [i for i in order if bound[i] * _GROUP_RATIO >= brightest]
        order = [i for i in order if i not in group]
        groups.append((_FIXED_UNITS / float(bound[group].sum()), set(group)))
    return groups


def _no_albedo(facts: Facts) -> str | None:
    """Why nobody asks for the walls' albedo."""
    chosen = facts.settings
    seen = (chosen.use_glossy and facts.glossy) or (chosen.use_translucency and facts.transmissive)
    if facts.settings.bounces > 1 or seen:
        return None
    return "light bounces once, off what the lights see, and nothing shows the rest"


class GeometryInjection(Pass):
    """Which share of the way between neighbouring cells is blocked, by drawing the scene along each axis."""

    title = "LPV Geometry Injection"
    figure = "Geometry Injection"
    reads = tuple(Optional(f"brdf.{name}", ("lpv.albedo",)) for name in ("albedo", "average", "energy"))
    writes = (
        Buffer("lpv.walls", "lpv_walls", "per cell and axis: blocked share of the way from the cell before, place, normal",
               "vec4", np.dtype(("f4", (4,))), lambda f: _cells(f) * 3),
        Buffer("lpv.faces", "lpv_faces", "per cell and axis: covered points, fragments, sums of their places and normals",
               "uint", np.dtype("u4"), lambda f: _most_cells(f) * 15, scratch=True),
        Buffer("lpv.albedo", "lpv_albedo", "per cell and axis: mean of albedo (a float's bits), red, green, blue",
               "uint", np.dtype("u4"), lambda f: _cells(f) * 9,
               when=_no_albedo),
        Texture("lpv.raster", "lpv_raster", "what the surfaces are drawn to; nobody reads it", "r8",
                lambda f: (_POINTS * max(max(g.size) for g in grids(f)),) * 2, scratch=True),
    )  # fmt: skip
    uniforms = (*_GRID, Uniform("axis", "int", "axis that the scene is drawn along"))
    shaders = {"main": {"compute": "engines/lpv/walls_comp.glsl"}}
    depends = ("transforms", "meshes", "materials")
    settings = ("lpv.resolution", "lpv.cascades", "lpv.occlusion", "bounces", "use_glossy", "use_translucency")

    def place(self, facts: Facts) -> tuple:
        return _place(facts)

    def rate(self, facts: Facts) -> str:
        return "static"

    def defines(self, facts: Facts) -> dict[str, int]:
        return {"LPV_POINTS": _POINTS, **_defines(facts)}

    def absent(self, facts: Facts) -> str | None:
        if not facts.settings.lpv.occlusion:
            return "occlusion is switched off"
        return None if facts.triangles else "the scene has no surfaces"

    def run(self, frame: Frame, planned: Planned) -> None:
        if planned.has("lpv.albedo"):
            frame.resources["lpv.albedo"].clear()
        for g in grids(planned.facts):
            self._draw(frame, planned, g)

    @staticmethod
    def _draw(frame: Frame, planned: Planned, g: Grid) -> None:
        """The walls of one grid."""
        ctx = frame.gl.ctx
        frame.resources["lpv.faces"].clear()
        fbo = frame.targets(planned)
        # Nothing is written to what the surfaces are drawn to. Were it, llvmpipe would take a tile of 64 pixels that one
        # triangle fills for hidden behind it and drop the triangles before, with their atomics: in 40 cells a box had holes.
        fbo.color_mask = (False, False, False, False)
        fbo.use()
        fbo.scissor = None
        ctx.enable_only(moderngl.NOTHING)
        frame.bind(planned)
        stages = {"vertex": "surface/surface_vert.glsl", "fragment": "engines/lpv/geometry_frag.glsl"}
        options = {
            "full": planned.has("lpv.albedo"), "units": len(planned.texture_reads()), "defines": {
                "SURFACE_TABLES": 2 if planned.has("brdf.average") else 0, "SURFACE_SEE_THROUGH_GLASS": 1,
                "SURFACE_SEEN_BY_CAMERA": 0, "SURFACE_SEEN_BY_SHADOW": 1,
            },
        }  # fmt: skip
        programs = frame.gpu.programs(planned, stages, SHADOW, **options)
        for axis in range(3):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            fbo.viewport = (0, 0, _POINTS * g.size[u], _POINTS * g.size[v])
            clip = np.zeros((4, 4))
            for row, k in enumerate((u, v, axis)):
                scale = 2.0 / (g.size[k] * g.cell)
                clip[row, k], clip[row, 3] = scale, -1.0 - scale * g.origin[k]
            clip[3, 3] = 1.0
            for program in programs:
                _set_grid(frame, program, g, axis=axis)
            frame.gpu.draw(planned, stages, SHADOW, np.ascontiguousarray(clip.T, "f4"), **options)
        ctx.memory_barrier(moderngl.ALL_BARRIER_BITS)
        program = frame.program(planned)
        _set_grid(frame, program, g)
        frame.compute(planned, program, g.size, (4, 4, 4))


class Propagation(Pass):
    """Light carried from cell to cell along each ordinate, and its harmonics in every cell.

    Where the sources are means over ever more sub-frames, it runs when there are twice as many as the last time.
    """

    title = "LPV Propagation"
    figure = "LPV Propagation"
    writes = (
        Texture("lpv.volume", "lpv_volume", "harmonics of the radiance in each cell by direction of travel, W/(m²·sr)",
                "rgba32f", _sh_size, access="readwrite"),
        Texture("lpv.radiance", "lpv_radiance", "radiance along each ordinate of a batch, W/(m²·sr)", "rgba32f",
                lambda f: _size(f, _batch(f)), access="readwrite", scratch=True),
        Buffer("lpv.ordinates", "ordinates", "unit vectors and solid angles", "vec4", np.dtype(("f4", (4,))),
               lambda f: ordinate_count(f), scratch=True),
    )  # fmt: skip
    uniforms = (
        *_GRID,
        Uniform("batch_first", "int", "index of the batch's first ordinate"),
        Uniform("batch_count", "int", "ordinates in the batch"),
        Uniform("fixed_scale", "float", "units of fixed point per W"),
        Uniform("source_scale", "float", "one over the sub-frames that the sources are summed over"),
        Uniform("bounced", "int", "1 to start from what the walls reflect too"),
        Uniform("inner_size", "ivec3", "cells along each axis of the grid within this one"),
        Uniform("inner_column", "int", "where they begin along x in textures"),
        Uniform("inner_low", "ivec3", "where it begins, in cells of this one"),
        Uniform("inner_rim", "int", "its grid_rim"),
        Uniform("wave", "int", "the diagonal plane whose cells take their light, or the iteration"),
    )
    shaders = {
        "expand": {"compute": "engines/lpv/expand_comp.glsl"},
        "rim": {"compute": "engines/lpv/rim_comp.glsl"},
        "main": {"compute": "engines/lpv/propagate_comp.glsl"},
        "gather": {"compute": "engines/lpv/gather_comp.glsl"},
        "reflect": {"compute": "engines/lpv/reflect_comp.glsl"},
        "bounced": {"compute": "engines/lpv/bounced_comp.glsl"},
    }
    depends = ("lights", "world", "transforms", "meshes", "materials")
    settings = (
        "lpv.resolution", "lpv.cascades", "lpv.directions", "lpv.iterations", "lpv.occlusion", "bounces", *_AIR_SETTINGS,
    )  # fmt: skip

    def __init__(self, injection: RadianceInjection, bounces: int = 1, iterations: int = 0) -> None:
        self.injection = injection
        self.reads = ("lpv.source", Optional("lpv.walls"), Optional("lpv.air"))
        if bounces > 1:
            self.reads += (Optional("lpv.albedo"),)
            self.writes += (
                Texture("lpv.bounced", "lpv_bounced", "lpv.source and what the walls reflect of the volume's light", "rgba32f",
                        _sh_size, access="readwrite", scratch=True),
                Texture("lpv.absorbed", "lpv_absorbed", "flux that ends at the walls of each cell, over h², W/m²", "rgba32f",
                        lambda f: _size(f, 1), access="readwrite", scratch=True),
                Buffer("lpv.reflected", "lpv_reflected", "what the walls reflect in fixed point: cell, harmonic, colour", "int",
                       np.dtype("i4"), lambda f: _most_cells(f) * SH_COUNT * 3, scratch=True),
            )  # fmt: skip
        if iterations:
            size = self.writes[1].size
            self.writes += (
                Texture("lpv.emitted", "lpv_emitted", "what the cells emit along each ordinate, W/(m²·sr)", "rgba32f", size,
                        access="readwrite", scratch=True),
                Texture("lpv.carried", "lpv_carried", "lpv.radiance after one iteration more", "rgba32f", size,
                        access="readwrite", scratch=True),
            )  # fmt: skip

    def rate(self, facts: Facts) -> str:
        return RSMGeneration().rate(facts)

    def defines(self, facts: Facts) -> dict[str, int]:
        return {
            "HAS_LPV_BOUNCED": int(facts.settings.bounces > 1), "HAS_LPV_ABSORBED": int(facts.settings.bounces > 1),
            "LPV_LIMITED": int(facts.settings.lpv.iterations > 0),
            **_defines(facts),
        }  # fmt: skip

    def place(self, facts: Facts) -> tuple:
        return _place(facts)

    def run(self, frame: Frame, planned: Planned) -> None:
        facts = planned.facts
        if not planned.stale and self.injection.count & (self.injection.count - 1):
            return
        table = ordinates(ordinate_count(facts))
        frame.upload("lpv.ordinates", table)
        self._carry(frame, planned, table, bounced=False)
        if planned.has("lpv.albedo"):
            reflect, bounced = frame.program(planned, "reflect"), frame.program(planned, "bounced")
            lights = frame.light_sample(bounce=True).lights
            for _ in range(facts.settings.bounces - 1):
                for g in grids(facts):
                    # Passive walls bring back less than came: the sum of all lights' bounds holds for every bounce.
                    scale = 1.0 / sum(1.0 / group_scale for group_scale, _ in fixed_point_groups(lights, g.cell))
                    frame.resources["lpv.reflected"].clear()
                    _set_grid(frame, reflect, g, fixed_scale=scale)
                    frame.compute(planned, reflect, g.size, (4, 4, 4))
                    _set_grid(frame, bounced, g, fixed_scale=scale, source_scale=1.0 / max(self.injection.count, 1))
                    frame.compute(planned, bounced, (*g.size[:2], g.size[2] * SH_COUNT), (4, 4, 4))
                self._carry(frame, planned, table, bounced=True)

    def _carry(self, frame: Frame, planned: Planned, table: np.ndarray, *, bounced: bool) -> None:
        """Fill the volume from the sources: the first ones, or those that a bounce was added to."""
        facts = planned.facts
        expand, carry, gather = (frame.program(planned, k) for k in ("expand", "main", "gather"))
        every, size = grids(facts), _batch(facts)
        for first in range(0, len(table), size):
            count = min(size, len(table) - first)
            for around, g in zip((None, *every), every, strict=False):
                layers = (*g.size[:2], g.size[2] * count)
                _set_grid(frame, expand, g, batch_first=first, batch_count=count, bounced=int(bounced),
                          source_scale=1.0 / max(self.injection.count, 1))
                frame.compute(planned, expand, layers, (4, 4, 4))
                if around is not None:
                    rim = frame.program(planned, "rim")
                    _set_grid(frame, rim, around, batch_count=count, inner_size=g.size, inner_column=g.column,
                              inner_low=g.low, inner_rim=g.rim)
                    frame.compute(planned, rim, layers, (4, 4, 4))
                _set_grid(frame, carry, g, batch_first=first, batch_count=count)
                if facts.settings.lpv.iterations:
                    self._iterate(frame, planned, carry, count)
                else:
                    for wave in range(sum(g.size) - 2):
                        carry["wave"].value = wave
                        carry.run(-(-g.size[0] // 8), -(-g.size[1] // 8), count)
                        frame.gl.ctx.memory_barrier(moderngl.SHADER_IMAGE_ACCESS_BARRIER_BIT)
                _set_grid(frame, gather, g, batch_first=first, batch_count=count)
                frame.compute(planned, gather, g.size, (4, 4, 4))

    @staticmethod
    def _iterate(frame: Frame, planned: Planned, carry, count: int) -> None:
        """The paper's iteration: all cells at once, one cell farther each time. The last one writes ``lpv.radiance``."""
        g = grid(planned.facts)
        textures = planned.texture_writes()
        slots = {t.name: slot for slot, t in enumerate(textures)}
        last = planned.facts.settings.lpv.iterations
        for iteration in range(last + 1):
            pair = ("lpv.carried", "lpv.radiance") if (last - iteration) % 2 == 0 else ("lpv.radiance", "lpv.carried")
            for name, slot in zip(pair, (slots["lpv.radiance"], slots["lpv.carried"]), strict=True):
                frame.resources[name].bind_to_image(slot, read=True, write=True)
            carry["wave"].value = iteration
            carry.run(-(-g.size[0] // 8), -(-g.size[1] // 8), g.size[2] * count)
            frame.gl.ctx.memory_barrier(moderngl.SHADER_IMAGE_ACCESS_BARRIER_BIT)


class IndirectLighting(ScreenPass):
    """The volume looked up at each pixel."""

    title = "LPV Lighting Computation"
    figure = "LPV Lighting Computation"
    reads = ("lpv.volume", Optional("lpv.walls"), "gbuffer.depth", "gbuffer.normal")
    writes = (INDIRECT_DIFFUSE,)
    uniforms = _GRIDS
    fragment = "engines/lpv/lighting_frag.glsl"

    def defines(self, facts: Facts) -> dict[str, int]:
        return _defines(facts, chooses=True)

    def absent(self, facts: Facts) -> str | None:
        return no_indirect(facts)

    def prepare(self, frame: Frame, planned: Planned, program) -> None:
        _set_grids(frame, program, planned.facts)


class InScattering(ScreenPass):
    """The volume's light that the air scatters to the eye."""

    title = "LPV In-scattering"
    figure = "Volumetric Lighting Computation"
    reads = ("lpv.volume", Optional("lpv.walls"), Optional("gbuffer.depth"))
    writes = (
        Texture("volume.indirect", "volume_indirect", "radiance of surfaces and of the air that it scatters towards the eye, "
                "W/(m²·sr)", "rgba32f", _screen),
    )  # fmt: skip
    uniforms = (
        *_GRIDS, *MEDIUM_UNIFORMS,
        Uniform("step_count", "int", "points on each ray"),
        Uniform("step_turn", "float", "where in its stratum each point lies in this sub-frame, [0, 1)"),
    )  # fmt: skip
    fragment = "engines/lpv/inscatter_frag.glsl"

    def defines(self, facts: Facts) -> dict[str, int]:
        return {**_defines(facts, chooses=True), **medium_defines(facts)}

    def absent(self, facts: Facts) -> str | None:
        return no_air(facts) or no_bounce(facts) or (None if scatters(facts) else "the air only absorbs")

    def prepare(self, frame: Frame, planned: Planned, program) -> None:
        facts = planned.facts
        set_medium(frame, program, facts)
        _set_grids(frame, program, facts, step_count=facts.settings.volume.samples, step_turn=step_turn(frame))


def _march_steps(facts: Facts) -> int:
    """Faces that a ray through the grids can pass."""
    return sum(sum(g.size) for g in grids(facts))


class AmbientOcclusion(ScreenPass):
    """Rays through the geometry volume."""

    title = "LPV AO Generation"
    figure = "AO Generation"
    reads = ("lpv.walls", "gbuffer.depth", "gbuffer.normal")
    writes = (
        Texture("ao.raw", "ao_raw", "cosine-weighted share of directions free of occluders within the AO distance; 1",
                "rg16f", _screen, scratch=True),
    )  # fmt: skip
    uniforms = (
        *_GRIDS,
        Uniform("ao_directions", "int", "rays per pixel"),
        Uniform("ao_distance", "float", "how far an occluder counts, m"),
    )
    fragment = "engines/lpv/ao_frag.glsl"

    def defines(self, facts: Facts) -> dict[str, int]:
        return {"MARCH_STEPS": _march_steps(facts), **_defines(facts, chooses=True)}

    def absent(self, facts: Facts) -> str | None:
        return None if facts.settings.use_ao else "ambient occlusion is switched off"

    def prepare(self, frame: Frame, planned: Planned, program) -> None:
        ao = planned.facts.settings.ao
        _set_grids(frame, program, planned.facts, ao_directions=ao.samples, ao_distance=planned.facts.ao_distance)


_RAY_SOURCE = "lamps' light from RSMs, bounces from the volume, hits from cells"
_RAY_READS = (
    "occupancy", "rsm.depth", "rsm.normal", "rsm.albedo", "rsm.lights", "rsm.views", "lpv.volume", "lpv.walls", "lpv.albedo",
    "gbuffer.depth", "gbuffer.normal", Optional("gbuffer.diffuse"), Optional("direct.diffuse"), Optional("indirect.diffuse"),
    Optional("vpls"), Optional("gbuffer.emission", ("transmission.indirect",)),
)  # fmt: skip
_RAY_UNIFORMS = (
    *_GRIDS, *CELL_UNIFORMS, *MEDIUM_UNIFORMS, Uniform("rsm_light_count", "int", "lights with reflective shadow maps"),
)  # fmt: skip


def _set_ray(frame: Frame, program, facts: Facts, **more) -> None:
    set_cells(frame, program, facts)
    set_medium(frame, program, facts)
    _set_grids(frame, program, facts, rsm_light_count=len(facts.rig.sources), **more)


def _ray_defines(facts: Facts) -> dict[str, int]:
    # raycast_lib can gather virtual lights; here are none.
    return {"MESH_LIGHTS": 0, "VISIBILITY_RAYS": 0, **_defines(facts, chooses=True), **medium_defines(facts)}


class GlossyLighting(ScreenPass):
    """Rays of the glossy lobe to the surfaces they meet."""

    title = "LPV Glossy Computation"
    figure = "LPV Lighting Computation"
    source = _RAY_SOURCE
    reads = (*_RAY_READS, *LOBE)
    writes = (GLOSSY_TRACED, GLOSSY_RAY)
    uniforms = _RAY_UNIFORMS
    fragment = "engines/lpv/glossy_frag.glsl"

    def defines(self, facts: Facts) -> dict[str, int]:
        return _ray_defines(facts)

    def absent(self, facts: Facts) -> str | None:
        return no_gloss(facts)

    def prepare(self, frame: Frame, planned: Planned, program) -> None:
        _set_ray(frame, program, planned.facts)


class Refraction(ScreenPass):
    """A refracted ray per pixel to the surface it meets."""

    title = "LPV Translucency"
    figure = "LPV Lighting Computation"
    source = _RAY_SOURCE
    reads = (*_RAY_READS, *REFRACTING)
    writes = (TRANSMISSION_INDIRECT,)
    uniforms = _RAY_UNIFORMS
    fragment = "engines/lpv/refraction_frag.glsl"

    def defines(self, facts: Facts) -> dict[str, int]:
        return _ray_defines(facts)

    def prepare(self, frame: Frame, planned: Planned, program) -> None:
        _set_ray(frame, program, planned.facts)
