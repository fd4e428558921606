# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the scene's surfaces are, in cells: what light that no map was made for is tested against."""

from __future__ import annotations

from dataclasses import dataclass

import moderngl
import numpy as np

from ..facts import Facts
from ..frame import Frame
from ..graph import Pass, Planned, Texture, Uniform
from ..scene import SHADOW

# Levels of empty blocks above a cell: blocks of 2⁵ cells cross a room of 128 in four steps.
_LEVELS = 5


@dataclass(frozen=True)
class CellGrid:
    """Cubic cells over the scene's bounds: ``origin`` (3,) world space, ``cell`` edge in m, ``size`` cells per axis, all
    multiples of the largest block. Bounds lie on cell centres, so that walls at them fill one layer of cells, not two."""

    origin: np.ndarray
    cell: float
    size: tuple[int, int, int]

    @staticmethod
    def over(bounds: np.ndarray, resolution: int) -> CellGrid:
        """The grid with ``resolution`` cells along the longest side of ``bounds`` (2, 3)."""
        low, high = np.asarray(bounds, "f8")
        # A cell and a half on each side: the wall's own cell, and one that rays may leave it through.
        cell = max(float((high - low).max()) / (resolution - 3), 1e-12 * (1.0 + float(np.abs(low).max())))
        block = 1 << _LEVELS
        size = [int(-(-(np.ceil((h - lo) / cell) + 3) // block) * block) for lo, h in zip(low, high, strict=True)]
        return CellGrid(low - 1.5 * cell, cell, tuple(min(s, -(-resolution // block) * block) for s in size))


def cell_grid(facts: Facts) -> CellGrid:
    """The frame's grid."""
    return CellGrid.over(facts.rig.region, facts.settings.rsm.visibility_resolution)


CELL_UNIFORMS = (
    Uniform("cell_origin_ws", "vec3", "corner of the grid of cells, world space, m"),
    Uniform("cell_size", "float", "edge of a cell, m"),
)


def set_cells(frame: Frame, program, facts: Facts) -> None:
    """Set CELL_UNIFORMS."""
    grid = cell_grid(facts)
    frame.set(program, cell_origin_ws=tuple(float(v) for v in grid.origin), cell_size=grid.cell)


class Occupancy(Pass):
    """Marks the cells that surfaces pass through, and finds how large a block around every other cell is empty."""

    title = "Occupancy"
    writes = (
        Texture("occupancy.cells", "occupancy_cells", "1 where a surface passes through the cell; its levels: anywhere in "
                "the block", "r8", lambda f: cell_grid(f).size, mips=lambda f: _LEVELS, access="readwrite", scratch=True),
        Texture("occupancy", "occupancy", "0 in a cell that a surface passes through, else (1 + level of the largest empty "
                "block that holds the cell) / 255", "r8", lambda f: cell_grid(f).size),
        Texture("occupancy.target", "occupancy_target", "what the draws are aimed at; nothing is written", "r8",
                lambda f: (max(cell_grid(f).size),) * 2, scratch=True),
    )  # fmt: skip
    uniforms = (*CELL_UNIFORMS, Uniform("dominant", "int", "axis that the scene is looked at along"))
    shaders = {
        "reduce": {"compute": "passes/occupancy_reduce_comp.glsl"},
        "levels": {"compute": "passes/occupancy_levels_comp.glsl"},
    }
    depends = ("transforms", "meshes", "materials")
    settings = ("rsm.visibility_resolution",)

    def rate(self, facts: Facts) -> str:
        return "static"

    def absent(self, facts: Facts) -> str | None:
        return None if facts.triangles else "the scene has no surfaces"

    def run(self, frame: Frame, planned: Planned) -> None:
        facts, grid = planned.facts, cell_grid(planned.facts)
        cells, free = frame.resources["occupancy.cells"], frame.resources["occupancy"]
        ctx = frame.gl.ctx
        cells.write(bytes(int(np.prod(grid.size))))
        fbo = frame.pool.framebuffer([frame.resources["occupancy.target"]])
        fbo.use()
        ctx.enable_only(moderngl.NOTHING)
        cells.bind_to_image(0, read=False, write=True)
        stages = {"vertex": "surface/surface_vert.glsl", "fragment": "passes/occupancy_frag.glsl"}
        options = {
            "full": False, "units": 0, "defines": {
                "SURFACE_TABLES": 0, "SURFACE_SEE_THROUGH_GLASS": 1, "SURFACE_SEEN_BY_CAMERA": 0,
                "SURFACE_SEEN_BY_SHADOW": 0,
            },
        }  # fmt: skip
        extent = np.array(grid.size) * grid.cell
        for axis in range(3):
            across = [(axis + 1) % 3, (axis + 2) % 3]
            fbo.viewport = (0, 0, grid.size[across[0]], grid.size[across[1]])
            clip = np.zeros((4, 4))
            for row, k in enumerate((*across, axis)):
                clip[row, k] = 2.0 / extent[k]
                clip[row, 3] = -1.0 - 2.0 * grid.origin[k] / extent[k]
            clip[3, 3] = 1.0
            for program in frame.gpu.programs(planned, stages, SHADOW, **options):
                frame.set(program, dominant=axis)
                set_cells(frame, program, facts)
            frame.gpu.draw(planned, stages, SHADOW, np.ascontiguousarray(clip.T, "f4"), **options)
        ctx.memory_barrier(moderngl.ALL_BARRIER_BITS)
        reduce = frame.program(planned, "reduce")
        size = np.array(grid.size)
        for level in range(_LEVELS):
            size //= 2
            cells.bind_to_image(0, read=True, write=False, level=level)
            cells.bind_to_image(1, read=False, write=True, level=level + 1)
            reduce.run(*(int(-(-s // 4)) for s in size))
            ctx.memory_barrier(moderngl.ALL_BARRIER_BITS)
        cells.use(0)
        free.bind_to_image(0, read=False, write=True)
        frame.program(planned, "levels").run(*(-(-s // 4) for s in grid.size))
        ctx.memory_barrier(moderngl.ALL_BARRIER_BITS)
