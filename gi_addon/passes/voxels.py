# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene in voxels: per cell and side the sheet of surface that faces it most, and albedo and emission averaged by area.

A triangle faces one of the six sides (±x, ±y, ±z) most. What faces the same side of a cell is one sheet: a plane, the mean of
its triangles', which of 4 × 4 squares of the cell's face it covers, and how far it reaches along the two axes of the face. So a
flat surface is where it is, not where its cell is, a wall thinner than a cell has two sides, an edge along an axis is where it
is, and another is known to a quarter of a cell.

Every triangle is drawn along the axis that it faces most, grown by half a cell, and clipped exactly against each cell it
meets: none is missed, and each adds the area that lies inside. Sums are integers, so that the order of drawing does not
show.

Few cells have surfaces, and few of those more than one sheet. So a cell holds four bytes, and sheets are kept one after another
(glsl/passes/voxel_store.glsl). Triangles are drawn twice: the first time they only mark the kinds of sheets in each cell. Adding
up those of each row, and of all rows before, in the order of the cells, gives every sheet its place, whatever the order of
drawing; then the sheets' sums are made. Memory is planned by a bound from the triangles (voxel_sheets.py).
"""

from __future__ import annotations

from dataclasses import dataclass

import moderngl
import numpy as np

from ..facts import Facts
from ..frame import Frame
from ..gl.context import MIB
from ..gl.errors import GLError
from ..graph import Buffer, Optional, Pass, Planned, Texture, Uniform
from ..scene import DIFFUSE
from .screen import no_translucency
from .voxel_sheets import most_sheets

# Sums are fixed point: this many units are one cell face of area. 32 bits then hold 4096 layers of surface in one cell.
UNITS = 1 << 20
# An emitter of the scene's brightest mean radiance fills 2¹⁶ units, so that textures may outshine their mean 4096 times over.
EMISSION_UNITS = 1 << 16
# Words of sums per sheet (voxel_sums.glsl), and more with emission or lamps.
_WORDS, _EMISSION_WORDS, _LAMP_WORDS = 15, 3, 1
# Of a sheet that light scatters below: its area, and × mean free path, share, albedo, roughness and index of the way in.
_BODY_WORDS = 10
# For the sums of the sheets that are made at once; OpenGL 4.3 promises storage blocks of no more than 128 MiB.
_SUMS_BYTES = 128 * MIB
# A cell has up to this many sheets. What is left of a part's last cell is made with the next part.
_MOST_IN_CELL = 6
# Texels of a row of a texture of sheets (voxel_store.glsl). OpenGL 4.3 promises 16384 rows: 2²⁶ sheets.
STORE_WIDTH = 4096
# Invocations of a work group that takes sheets one by one.
STORE_GROUP = 64
# What voxels_empty_comp.glsl and voxels_rows_comp.glsl are to do.
_STEPS = {"STEP_CLEAR": 0, "STEP_UP": 1, "STEP_DOWN": 2, "STEP_COUNT": 0, "STEP_PLACE": 1}
_R32UI = 0x8236  # OpenGL's name of the format as which four bytes are one word

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


def sheet_counts(facts: Facts) -> tuple[int, ...]:
    """The sheets that there is memory for at each level of the frame's grid, the cells first: the most that there can be, rounded
    up to an eighth, so that what moves seldom needs other memory."""
    grid = voxel_grid(facts)
    counts = facts.once("sheets", (grid,), lambda scene: most_sheets(scene, grid.low, grid.cell, grid.size, grid.levels))
    eighths = [1 << max(n.bit_length() - 4, 0) for n in counts]
    return tuple(-(-n // step) * step for n, step in zip(counts, eighths, strict=True))


def store_size(count: int) -> tuple[int, int]:
    """Size of a texture of ``count`` sheets."""
    return (STORE_WIDTH, -(-count // STORE_WIDTH))


def store_groups(count: int) -> tuple[int, int]:
    """Work groups of STORE_GROUP invocations for ``count`` sheets, an invocation a texel."""
    return (STORE_WIDTH // STORE_GROUP, -(-count // STORE_WIDTH))


def all_sheets(facts: Facts) -> tuple[int, int]:
    """Size of a texture of the sheets of all levels."""
    return store_size(sum(sheet_counts(facts)))


def cell_sheets(facts: Facts) -> tuple[int, int]:
    """Size of a texture of the cells' sheets."""
    return store_size(sheet_counts(facts)[0])


def _rows(facts: Facts) -> list[int]:
    """Rows of cells of each level."""
    grid = voxel_grid(facts)
    return [(grid.size[1] >> level) * (grid.size[2] >> level) for level in range(grid.levels + 1)]


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


def _chunk(facts: Facts) -> int:
    """Sheets that are made at once."""
    return int(min(sheet_counts(facts)[0], _SUMS_BYTES // (4 * _words(facts)))) + _MOST_IN_CELL


class Voxelisation(Pass):
    """Triangles to cells. Static: run when meshes, transforms or materials change."""

    title = "Voxelization"
    figure = "Voxelization"
    only = ""  # the flag that materials must have to be drawn
    reads = (Optional("brdf.albedo"), Optional("brdf.average"), Optional("brdf.energy"))
    writes = (
        Texture("voxels.kinds", "voxel_kinds", "r: a bit for each kind of sheet in the cell or, in an empty one, 64 + level of "
                "the largest empty block around it, over 255; g: mean opacity; b, a: sheets before the cell's in its row, low "
                "and high byte", "rgba8", _size, mips=lambda f: voxel_grid(f).levels, scratch=True),
        Texture("voxels.sheets", "voxel_sheets", "by sheet of the cells, packed: ½ + ½ slopes; ½ + ⅓ height over the cell's "
                "middle, in cells, and a bit for each square that it covers; how far it reaches over the cell's face, down u and "
                "v from its far sides, and up from its near ones; mean share of light that the cell's surfaces reflect, how much "
                "of it is diffuse",
                "rgba32ui", cell_sheets),
        Texture("voxels.emission", "voxel_emission", "by sheet: mean emitted radiance of its cell over the brightest emitter's",
                "rgba16f", cell_sheets,
                when=lambda f: None if f.glowing_voxels else "no voxel shines: nothing emits, or lights sampled on it do"),
        Texture("voxels.lamps", "voxel_lamps", "by sheet: share of the cell's face that its lamps cover", "r8", cell_sheets,
                when=lambda f: None if _lamps(f) else "no light is drawn from emissive surfaces"),
        Texture("voxels.bodies", "voxel_bodies", "by sheet, packed (lib/body_lib.glsl): mean free path below it, share of what "
                "it reflects that has been there, albedo, way in; 0 where there is none", "rgba32ui", cell_sheets,
                when=no_bodies),
        Texture("voxels.rows", "voxel_rows", "by row of cells, level after level: sheets before it; then how many there are",
                "r32ui", lambda f: store_size(sum(_rows(f)) + 1), scratch=True),
        Texture("voxels.places", "voxel_places", "by sheet, level after level, packed: its cell and part", "r32ui", all_sheets,
                scratch=True),
        Texture("voxels.raster", "voxel_raster", "stands for the grid's layers while triangles are drawn; holds nothing",
                "r8", lambda f: (max(_size(f)),) * 2, scratch=True),
        Buffer("voxels.sums", "voxel_sums", "fixed-point sums of the sheets in the making", "uint", np.dtype("u4"),
               lambda f: _chunk(f) * _words(f), scratch=True),
        Buffer("voxels.total", "voxel_total", "sheets of the cells; of all levels", "uint", np.dtype("u4"), lambda f: 2,
               scratch=True),
    )  # fmt: skip
    uniforms = (
        *GRID_UNIFORMS,
        Uniform("chunk", "uvec2", "first sheet in the making, and how many"),
        Uniform("chunk_step", "uint", "first sheet of the next ones, from there"),
        Uniform("sheet_count", "uint", "sheets of the cells"),
        Uniform("store_size", "uint", "sheets that there is memory for"),
        Uniform("emission_unit", "float", "radiance of one unit of the emission's sums per unit of weight, W/(m²·sr)"),
        Uniform("step_", "int", "what is to be done"),
        Uniform("level", "int", "level that is made, or the finer of two"),
        Uniform("size", "ivec3", "cells of the level that is made"),
        Uniform("topmost", "int", "1 when no level is above"),
        Uniform("row_count", "uint", "rows of all levels"),
        Uniform("cell_rows", "uint", "rows of the cells"),
    )
    shaders = {
        "resolve": {"compute": "passes/voxels_comp.glsl"}, "empty": {"compute": "passes/voxels_empty_comp.glsl"},
        "rows": {"compute": "passes/voxels_rows_comp.glsl"}, "scan": {"compute": "passes/voxels_scan_comp.glsl"},
    }  # fmt: skip
    depends = ("transforms", "meshes", "materials")
    settings = ("vct.resolution", "vct.emissive_voxels", "use_area_lights", "use_translucency")

    def rate(self, facts: Facts) -> str:
        return "subframe" if facts.settings.vct.continuous_voxelization else "static"

    def absent(self, facts: Facts) -> str | None:
        return None if facts.triangles else "the scene has no surfaces"

    def defines(self, facts: Facts) -> dict[str, int]:
        return {**_STEPS, "VOXEL_UNITS": UNITS, "VOXEL_WORDS": _words(facts), "VOXEL_EMISSION": int(facts.glowing_voxels),
                "VOXEL_LAMPS": int(_lamps(facts)), "EMISSION_UNITS": EMISSION_UNITS, "VOXEL_MARK": 0,
                "VOXEL_BODIES": int(no_bodies(facts) is None), "SUM_BODY": _body_word(facts)}

    def run(self, frame: Frame, planned: Planned) -> None:
        facts = planned.facts
        grid = voxel_grid(facts)
        brightest = float(facts.emitters.radiance.max()) if len(facts.emitters) else 1.0
        values = {**grid.uniforms(), "emission_unit": max(brightest, 1e-30) / EMISSION_UNITS}
        self._cells(frame, planned, grid, clear=True)
        self._draw(frame, planned, grid, values, VOXEL_MARK=1)
        self._cells(frame, planned, grid, clear=False)
        sheets = self._number(frame, planned, grid)
        resolve = frame.program(planned, "resolve")
        size = _chunk(facts)
        step = size - _MOST_IN_CELL
        for first in range(0, sheets, step):
            frame.resources["voxels.sums"].clear()
            frame.gl.ctx.memory_barrier()
            chunk = {"chunk": (first, size), "chunk_step": step, "sheet_count": sheets}
            self._draw(frame, planned, grid, {**values, **chunk}, VOXEL_MARK=0)
            frame.bind(planned)
            for slot, texture in enumerate(planned.texture_writes()):
                if texture.glsl in ("voxel_sheets", "voxel_emission", "voxel_lamps", "voxel_bodies"):
                    frame.resources[texture.name].bind_to_image(slot, read=False, write=True)
            _bind_words(frame)
            frame.set(resolve, **grid.uniforms(), **chunk)
            resolve.run(*store_groups(min(size, sheets - first)))
            frame.gl.ctx.memory_barrier()

    def _draw(self, frame: Frame, planned: Planned, grid: VoxelGrid, values: dict, **defines: int) -> None:
        """All triangles, along the axes that they face."""
        target = frame.pool.framebuffer([frame.resources["voxels.raster"]])
        target.use()
        target.scissor = None
        target.viewport = (0, 0, *target.size)
        frame.gl.ctx.enable_only(moderngl.NOTHING)
        frame.bind(planned)
        _bind_words(frame)
        stages = {
            "vertex": "passes/voxels_vert.glsl", "geometry": "passes/voxels_geom.glsl",
            "fragment": "passes/voxels_frag.glsl",
        }  # fmt: skip
        options = {
            "full": True, "only": self.only, "units": len(planned.texture_reads()), "defines": {
                "SURFACE_TABLES": 2 if planned.has("brdf.average") else 0, "SURFACE_SEE_THROUGH_GLASS": 1,
                "SURFACE_SEEN_BY_CAMERA": 0, "SURFACE_SEEN_BY_SHADOW": 0, **defines,
            },
        }  # fmt: skip
        for program in frame.gpu.programs(planned, stages, DIFFUSE, **options):
            frame.set(program, **values)
        frame.gpu.draw(planned, stages, DIFFUSE, _grid_view(grid), **options)
        frame.gl.ctx.memory_barrier()

    @staticmethod
    def _cells(frame: Frame, planned: Planned, grid: VoxelGrid, *, clear: bool) -> None:
        """Empty the cells; or the levels of their kinds, up and down again."""
        program = frame.program(planned, "empty")
        levels = range(grid.levels)
        up, down = [(level, 1, "STEP_UP") for level in levels], [(k, 0, "STEP_DOWN") for k in (grid.levels, *reversed(levels))]
        for level, above, step in [(0, 0, "STEP_CLEAR")] if clear else [*up, *down]:
            _bind_words(frame, level, min(level + 1, grid.levels))
            size = tuple(n >> (level + above) for n in grid.size)
            frame.set(program, size=size, level=level, step_=_STEPS[step], topmost=int(level == grid.levels))
            program.run(*(-(-n // 4) for n in size))
            frame.gl.ctx.memory_barrier()

    @staticmethod
    def _number(frame: Frame, planned: Planned, grid: VoxelGrid) -> int:
        """Give every sheet its place. Returns how many the cells have; raises GLError where that is more than was planned."""
        counts, rows = sheet_counts(planned.facts), _rows(planned.facts)
        walk, scan = frame.program(planned, "rows"), frame.program(planned, "scan")
        frame.bind(planned)
        for step in ("STEP_COUNT", "STEP_PLACE"):
            frame.set(walk, **grid.uniforms(), step_=_STEPS[step], store_size=sum(counts))
            for level, n in enumerate(rows):
                _bind_words(frame, level)
                frame.set(walk, level=level)
                walk.run(-(-n // STORE_GROUP))
            frame.gl.ctx.memory_barrier()
            if step == "STEP_COUNT":
                frame.set(scan, row_count=sum(rows), cell_rows=rows[0])
                scan.run(1)
                frame.gl.ctx.memory_barrier()
        # Reading back waits for the GPU: only when there may be others.
        if planned.stale or "sheets" not in planned.memory:
            total = np.frombuffer(frame.resources["voxels.total"].read(), "u4")
            if total[0] > counts[0] or total[1] > sum(counts):
                raise GLError(f"voxels: {total[0]} sheets of surface, {total[1]} with coarser levels, where the triangles' bound "
                              f"is {counts[0]} and {sum(counts)}")  # fmt: skip
            planned.memory["sheets"] = int(total[0])
        return planned.memory["sheets"]


class BodyVoxels(Voxelisation):
    """The sheets that light scatters below: what walks go between, in engines without voxels of their own."""

    title = "Body Voxelization"
    only = "subsurface"

    def absent(self, facts: Facts) -> str | None:
        return super().absent(facts) or no_bodies(facts)


def _bind_words(frame: Frame, level: int = 0, above: int = 0) -> None:
    """Cells of two levels as words, rows and places, as the shaders have them."""
    frame.resources["voxels.kinds"].bind_to_image(4, read=True, write=True, level=level, format=_R32UI)
    frame.resources["voxels.kinds"].bind_to_image(5, read=True, write=True, level=above, format=_R32UI)
    frame.resources["voxels.rows"].bind_to_image(6, read=True, write=True)
    frame.resources["voxels.places"].bind_to_image(7, read=True, write=True)


def _grid_view(grid: VoxelGrid) -> np.ndarray:
    """clip_from_world (4, 4), column-major, of the grid's box: what is drawn for it."""
    low, half = np.array(grid.low), np.array(grid.size, "f8") * grid.cell / 2.0
    clip = np.diag([*(1.0 / half), 1.0])
    clip[:3, 3] = -(low + half) / half
    return np.ascontiguousarray(clip.T, "f4")
