# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene in voxels: per cell and side the sheet of surface that faces it most, and albedo and emission averaged by area.

A triangle faces one of the six sides (±x, ±y, ±z) most. What faces the same side of a cell is one sheet: a plane, the mean of
its triangles', which of 4 × 4 squares of the cell's face it covers, and how far it reaches along the two axes of the face. So a
flat surface is where it is, not where its cell is, a wall thinner than a cell has two sides, an edge along an axis is where it
is, and another is known to a quarter of a cell.

Every triangle is drawn along the axis that it faces most, grown by half a cell, and clipped exactly against each cell it
meets: none is missed, and each adds the area that lies inside. Sums are integers, so that the order of drawing does not
show. The layers of the grid are made a few at a time, so that the sums need little memory at any resolution.
"""

from __future__ import annotations

from dataclasses import dataclass

import moderngl
import numpy as np

from ..facts import Facts
from ..frame import Frame
from ..gl.context import MIB
from ..graph import Buffer, Optional, Pass, Planned, Texture, Uniform
from ..scene import DIFFUSE
from .screen import no_translucency

# Sums are fixed point: this many units are one cell face of area. 32 bits then hold 4096 layers of surface in one cell.
UNITS = 1 << 20
# An emitter of the scene's brightest mean radiance fills 2¹⁶ units, so that textures may outshine their mean 4096 times over.
EMISSION_UNITS = 1 << 16
# Words per cell: area, area × opacity, albedo; of each of six sheets its area, slopes and height; squares covered; how much of
# what is reflected is diffuse; how far each sheet reaches; emission; area of lamps by side; of what light scatters below the
# surface of its area, mean free path, share, albedo, roughness and index of the way in, kinds of sheets.
_WORDS, _EMISSION_WORDS, _LAMP_WORDS, _BODY_WORDS = 57, 3, 6, 11
# For the sums of the layers that are made at once; OpenGL 4.3 promises storage blocks of no more than 128 MiB.
_SLAB_BYTES = 128 * MIB

GRID_UNIFORMS = (
    Uniform("grid_low", "vec3", "corner of the voxel grid, world space, m"),
    Uniform("grid_cell", "float", "width of a cell, m"),
    Uniform("grid_size", "ivec3", "cells along x, y, z"),
)


@dataclass(frozen=True)
class VoxelGrid:
    """A grid of cubic cells: corner ``low`` (3,) in m, ``cell`` width in m, ``size`` in cells, and ``levels`` of mips
    above the cells that halve exactly."""

    low: tuple[float, float, float]
    cell: float
    size: tuple[int, int, int]
    levels: int

    @staticmethod
    def around(bounds: np.ndarray, resolution: int) -> VoxelGrid:
        """The grid of ``resolution`` cells along the longest side of ``bounds`` (2, 3). The outermost surfaces of that
        side lie in the middle of cells: a wall on the border between two cells would be in either by rounding."""
        low, high = np.asarray(bounds, "f8")
        extent = high - low
        longest = float(extent.max())
        cell = longest / (resolution - 1) if longest > 0.0 else 1.0
        # The coarsest mip has 8 cells along the longest side; all sides are whole multiples of its cells.
        levels = max(1, resolution.bit_length() - 4)
        step = 1 << levels
        needed = np.ceil(extent / cell - 1e-6) + 1.0
        size = (np.ceil(needed / step) * step).astype(int)
        corner = (low + high) / 2.0 - size * cell / 2.0
        return VoxelGrid(tuple(corner.tolist()), cell, tuple(size.tolist()), levels)

    def uniforms(self) -> dict:
        """Values of GRID_UNIFORMS."""
        return {"grid_low": self.low, "grid_cell": self.cell, "grid_size": self.size}


def voxel_grid(facts: Facts) -> VoxelGrid:
    """The frame's grid."""
    return VoxelGrid.around(facts.rig.region, facts.settings.vct.resolution)


def _size(facts: Facts) -> tuple[int, int, int]:
    return voxel_grid(facts).size


def _body_word(facts: Facts) -> int:
    """Where the words of what light scatters below the surface of begin."""
    return _WORDS + (_EMISSION_WORDS if facts.glowing_voxels else _LAMP_WORDS if _lamps(facts) else 0)


def _words(facts: Facts) -> int:
    return _body_word(facts) + (_BODY_WORDS if no_bodies(facts) is None else 0)


def no_bodies(facts: Facts) -> str | None:
    """Why no light walks through bodies from one sheet to another, or None."""
    return no_translucency(facts) or (None if facts.bodies else "no material scatters below its surface")


def _lamps(facts: Facts) -> bool:
    """Whether lights are drawn from emissive surfaces."""
    return len(facts.emitters) > 0 and facts.emissive_light and not facts.glowing_voxels


def voxel_atlas(facts: Facts) -> tuple[int, int, int]:
    """Six parts of the grid's size: two sides by three axes."""
    x, y, z = voxel_grid(facts).size
    return (2 * x, y, 3 * z)


def _slab(facts: Facts) -> int:
    """Layers of the grid that are made at once."""
    x, y, z = _size(facts)
    return int(np.clip(_SLAB_BYTES // (x * y * 4 * _words(facts)), 1, z))


class Voxelisation(Pass):
    """Triangles to cells. Static: run when meshes, transforms or materials change."""

    title = "Voxelization"
    figure = "Voxelization"
    reads = (Optional("brdf.albedo"), Optional("brdf.average"), Optional("brdf.energy"))
    writes = (
        Texture("voxels.sheets", "voxel_sheets", "by side and axis: ½ + ½ slopes and ½ + ⅓ height of the sheet over the cell's "
                "middle, in cells; a bit for each square that it covers, over 65535", "rgba16", voxel_atlas),
        Texture("voxels.extents", "voxel_extents", "by side and axis: how far the sheet reaches over the cell's face, "
                "down u and v from its far sides, and up from its near ones", "rgba8", voxel_atlas),
        Texture("voxels.kinds", "voxel_kinds", "a bit for each kind of sheet in the cell or, in an empty one, 64 + level of the "
                "largest empty block around it, over 255; mean opacity", "rg8", _size,
                mips=lambda f: voxel_grid(f).levels, scratch=True),
        Texture("voxels.albedo", "voxel_albedo", "mean share of light that the surfaces reflect; how much of it is diffuse",
                "rgba8", _size),
        Texture("voxels.emission", "voxel_emission", "mean emitted radiance over the brightest emitter's", "rgba16f", _size,
                when=lambda f: None if f.glowing_voxels else "no voxel shines: nothing emits, or lights sampled on it do"),
        Texture("voxels.lamps", "voxel_lamps", "share of the cell's face along x, y, z that lamps cover", "rgba8", _size,
                when=lambda f: None if _lamps(f) else "no light is drawn from emissive surfaces"),
        Texture("voxels.bodies", "voxel_bodies", "packed (lib/body_lib.glsl) what light scatters below the surface of: mean free path, "
                "share of what is reflected that has been there, albedo, kinds of sheets, way in", "rgba32ui", _size, when=no_bodies),
        Buffer("voxels.sums", "voxel_sums", "fixed-point sums of the layers in the making", "uint", np.dtype("u4"),
               lambda f: _slab(f) * _size(f)[0] * _size(f)[1] * _words(f), scratch=True),
        Texture("voxels.raster", "voxel_raster", "stands for the grid's layers while triangles are drawn; holds nothing",
                "r8", lambda f: (max(_size(f)),) * 2, scratch=True),
    )  # fmt: skip
    uniforms = (
        *GRID_UNIFORMS,
        Uniform("slab", "ivec2", "first layer in the making, and how many"),
        Uniform("emission_unit", "float", "radiance of one unit of the emission's sums per unit of weight, W/(m²·sr)"),
        Uniform("size", "ivec3", "cells of the level that is made"),
        Uniform("upwards", "int", "1 when a level is made of the finer one"),
        Uniform("topmost", "int", "1 when no level is above"),
    )
    shaders = {
        "resolve": {"compute": "passes/voxels_comp.glsl"}, "empty": {"compute": "passes/voxels_empty_comp.glsl"},
    }  # fmt: skip
    depends = ("transforms", "meshes", "materials")
    settings = ("vct.resolution", "vct.emissive_voxels", "use_area_lights", "use_translucency")

    def rate(self, facts: Facts) -> str:
        return "subframe" if facts.settings.vct.continuous_voxelization else "static"

    def absent(self, facts: Facts) -> str | None:
        return None if facts.triangles else "the scene has no surfaces"

    def defines(self, facts: Facts) -> dict[str, int]:
        return {"VOXEL_UNITS": UNITS, "VOXEL_WORDS": _words(facts), "VOXEL_EMISSION": int(facts.glowing_voxels),
                "VOXEL_LAMPS": int(_lamps(facts)), "EMISSION_UNITS": EMISSION_UNITS,
                "VOXEL_BODIES": int(no_bodies(facts) is None), "BODY_WORD": _body_word(facts)}

    def run(self, frame: Frame, planned: Planned) -> None:
        facts = planned.facts
        grid = voxel_grid(facts)
        target = frame.pool.framebuffer([frame.resources["voxels.raster"]])
        sums = frame.resources["voxels.sums"]
        resolve = frame.program(planned, "resolve")
        stages = {
            "vertex": "passes/voxels_vert.glsl", "geometry": "passes/voxels_geom.glsl",
            "fragment": "passes/voxels_frag.glsl",
        }  # fmt: skip
        options = {
            "full": True, "units": len(planned.texture_reads()), "defines": {
                "SURFACE_TABLES": 2 if planned.has("brdf.average") else 0, "SURFACE_SEE_THROUGH_GLASS": 1,
                "SURFACE_SEEN_BY_CAMERA": 0, "SURFACE_SEEN_BY_SHADOW": 0,
            },
        }  # fmt: skip
        brightest = float(facts.emitters.radiance.max()) if len(facts.emitters) else 1.0
        values = {**grid.uniforms(), "emission_unit": max(brightest, 1e-30) / EMISSION_UNITS}
        layers = _slab(facts)
        for first in range(0, grid.size[2], layers):
            count = min(layers, grid.size[2] - first)
            sums.clear()
            frame.gl.ctx.memory_barrier()
            target.use()
            target.scissor = None
            target.viewport = (0, 0, *target.size)
            frame.gl.ctx.enable_only(moderngl.NOTHING)
            frame.bind(planned)
            for program in frame.gpu.programs(planned, stages, DIFFUSE, **options):
                frame.set(program, slab=(first, count), **values)
            frame.gpu.draw(planned, stages, DIFFUSE, _slab_view(grid, first, count), **options)
            frame.gl.ctx.memory_barrier()
            frame.set(resolve, slab=(first, count), **values)
            self._resolve(frame, planned, resolve, (*grid.size[:2], count))
        self._find_empty(frame, planned, grid)

    @staticmethod
    def _find_empty(frame: Frame, planned: Planned, grid: VoxelGrid) -> None:
        """The levels of voxels.kinds, up and down again."""
        program, kinds = frame.program(planned, "empty"), frame.resources["voxels.kinds"]
        steps = [(level, True) for level in range(grid.levels)] + [(level, False) for level in range(grid.levels, -1, -1)]
        for level, upwards in steps:
            kinds.bind_to_image(4, read=True, write=True, level=level)
            kinds.bind_to_image(5, read=True, write=True, level=min(level + 1, grid.levels))
            size = tuple(n >> (level + upwards) for n in grid.size)
            frame.set(program, size=size, upwards=int(upwards), topmost=int(level == grid.levels))
            program.run(*(-(-n // 4) for n in size))
            frame.gl.ctx.memory_barrier()

    @staticmethod
    def _resolve(frame: Frame, planned: Planned, program, size: tuple[int, int, int]) -> None:
        """Sums to means, as Frame.compute, without the raster target among the images."""
        frame.bind(planned)
        for slot, texture in enumerate(planned.texture_writes()):
            if len(texture.size(planned.facts)) == 3:
                frame.resources[texture.name].bind_to_image(slot, read=False, write=True)
        program.run(*(-(-n // 4) for n in size))
        frame.gl.ctx.memory_barrier()


def _slab_view(grid: VoxelGrid, first: int, count: int) -> np.ndarray:
    """clip_from_world (4, 4), column-major, of the box around ``count`` layers: what is drawn for them."""
    low, size = np.array(grid.low), np.array(grid.size, "f8")
    low = low + np.array([0.0, 0.0, first * grid.cell])
    half = np.array([size[0], size[1], count]) * grid.cell / 2.0
    clip = np.diag([*(1.0 / half), 1.0])
    clip[:3, 3] = -(low + half) / half
    return np.ascontiguousarray(clip.T, "f4")
