# SPDX-License-Identifier: GPL-3.0-or-later
"""Grids of cubic cells over a scene, and finer ones within them around the camera.

Each grid has cells half as wide as the one around it and lies on that one's cells. A camera that moves by less than a cell of
the outer grid changes nothing; by more, the inner grid moves by whole cells of both, so that every lattice stays where it is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .focus import Focus

MOST_GRIDS = 4
# Cells at a side of an inner grid that nothing is looked up in: around a point farther in, all eight cells are the grid's own.
RIM = 2
# A beam is spread by √(distance × cell) on its way from cell to cell. Light flies one free path ℓ from surface to surface: it
# spreads by no more than half of that in cells up to ℓ/4.
_CELLS_PER_PATH = 4.0


@dataclass(frozen=True)
class Grid:
    """Cubic cells: ``origin`` (3,) of cell 0's low corner and ``cell`` edge, m; ``size`` (3,) cells.

    ``low`` (3,) is where an inner grid begins, in cells of the one around it. ``rim`` has bit 2·axis for the low and 2·axis + 1
    for the high side that another grid goes on behind. All grids' cells stand side by side in textures from ``column`` on along
    x, and one after the other in buffers from ``first`` on.
    """

    origin: tuple[float, float, float]
    cell: float
    size: tuple[int, int, int]
    low: tuple[int, int, int] = (0, 0, 0)
    rim: int = 0
    column: int = 0
    first: int = 0

    @staticmethod
    def over(bounds: np.ndarray, resolution: int) -> Grid:
        """The grid of ``resolution`` cells along the longest side of ``bounds`` (2, 3), one of padding at each end."""
        low, high = np.asarray(bounds, "f8")
        extent = np.maximum(high - low, 0.0)
        longest = float(extent.max()) or 1.0
        cell = longest / (resolution - 2)
        # A side of a whole number of cells must not gain one from rounding.
        size = np.ceil(extent / cell - 1e-6).astype(int) + 2
        origin = (low + high) / 2.0 - size * cell / 2.0
        return Grid(tuple(float(v) for v in origin), cell, tuple(int(v) for v in size))

    @property
    def cells(self) -> int:
        return int(np.prod(self.size))

    def around(self, eye: np.ndarray, core: np.ndarray, resolution: int, whole: Grid) -> Grid:
        """The grid of half as wide cells within this one, at most ``resolution`` of them along a side and those of the rims:
        about ``eye`` (3,), but no farther out than it still holds, or lies in, the box ``core`` (2, 3) of what matters. ``whole``
        is the outermost."""
        most = resolution - resolution % 2 + 2 * RIM
        size = np.minimum(2 * np.array(self.size), most)
        extent = size * self.cell / 2.0
        pad = self.cell
        near, far = core[0] - pad, core[1] + pad - extent
        wanted = np.clip(np.asarray(eye, "f8") - extent / 2.0, np.minimum(near, far), np.maximum(near, far))
        # An eye infinitely far away or not a number would be none of this scene's.
        wanted = np.where(np.isfinite(wanted), wanted, near)
        low = np.rint((wanted - np.array(self.origin)) / self.cell)
        low = np.clip(low, 0, np.array(self.size) - size // 2).astype(int)
        origin = np.array(self.origin) + low * self.cell
        rim = 0
        for axis in range(3):
            start = (origin[axis] - whole.origin[axis]) / whole.cell
            end = start + size[axis] * self.cell / 2.0 / whole.cell
            rim |= int(start > 1e-3) << (2 * axis) | int(end < whole.size[axis] - 1e-3) << (2 * axis + 1)
        return Grid(
            tuple(float(v) for v in origin), self.cell / 2.0, tuple(int(v) for v in size), tuple(int(v) for v in low), rim,
            self.column + self.size[0], self.first + self.cells,
        )  # fmt: skip


def grids_needed(focus: Focus, resolution: int) -> int:
    """How many grids, the outermost of ``resolution`` cells over the region, bring a cell down to what the scene asks for."""
    cell = Grid.over(focus.region, resolution).cell
    if focus.free_path <= 0.0:
        return 1
    return int(np.clip(1 + math.ceil(math.log2(_CELLS_PER_PATH * cell / focus.free_path) - 1e-3), 1, MOST_GRIDS))


def nested_grids(focus: Focus, resolution: int, count: int, eye: np.ndarray) -> list[Grid]:
    """The grid over the focus' region and ``count`` − 1 within each other around ``eye`` (3,), the outermost first. One that
    would not be smaller than the one around it is still finer. Sizes do not depend on ``eye``."""
    found = [Grid.over(focus.region, resolution)]
    while len(found) < count:
        found.append(found[-1].around(eye, focus.core, resolution, found[0]))
    return found
