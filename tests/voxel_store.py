# SPDX-License-Identifier: GPL-3.0-or-later
"""Read what the voxels' store of sheets holds (passes/voxels.py) as volumes."""

from __future__ import annotations

import numpy as np

from gi_addon.passes.voxels import VoxelGrid, voxel_grid
from gi_addon.renderer import Renderer


def store(renderer: Renderer, name: str) -> np.ndarray:
    """Texels (N, channels) of a texture of sheets, or of rows."""
    texture = renderer.frame.resources[name]
    dtype = {"f1": np.uint8, "f2": np.float16, "u4": np.uint32}[texture.dtype]
    return np.frombuffer(texture.read(alignment=1), dtype).reshape(-1, texture.components)


def places(renderer: Renderer, level: int = 0) -> tuple[VoxelGrid, np.ndarray, np.ndarray, np.ndarray]:
    """The grid, and of all sheets of a level their numbers (N,), cells (N, 3) as x, y, z, and parts (N,)."""
    grid = voxel_grid(renderer.frame.facts)
    rows = [(grid.size[1] >> k) * (grid.size[2] >> k) for k in range(grid.levels + 1)]
    before = store(renderer, "voxels.rows")[:, 0]
    numbers = np.arange(before[sum(rows[:level])], before[sum(rows[: level + 1])])
    place = store(renderer, "voxels.places")[numbers, 0]
    return grid, numbers, np.stack([place, place >> 9, place >> 18], -1) & 511, place >> 27


def light(renderer: Renderer, level: int = 0, name: str = "vct.radiance") -> tuple[VoxelGrid, np.ndarray]:
    """Light by part at a level, of fronts or (``vct.back``) of backs: the grid, and (axis, side, z, y, x, 4)."""
    grid, numbers, cell, part = places(renderer, level)
    out = np.zeros((6, *(n >> level for n in grid.size[::-1]), 4), "f4")
    out[part, cell[:, 2], cell[:, 1], cell[:, 0]] = store(renderer, name)[numbers]
    return grid, out.reshape(3, 2, *out.shape[1:])


def surfaces(renderer: Renderer) -> tuple[VoxelGrid, dict[str, np.ndarray]]:
    """The grid, and ``sheets`` (axis, side, z, y, x, [slope u, slope v, height, squares] of 65535) and by cell (z, y, x, …)
    ``kinds``, ``opacity``, ``albedo`` and, where voxels shine, ``emission``."""
    grid, numbers, cell, part = places(renderer)
    x, y, z = cell.T
    shape = grid.size[::-1]
    packed = store(renderer, "voxels.sheets")[numbers]
    cells = np.frombuffer(renderer.frame.resources["voxels.kinds"].read(alignment=1), np.uint8).reshape(*shape, 4)
    sheets = np.zeros((6, *shape, 4), "f4")
    sheets[part, z, y, x] = packed[:, :2].copy().view(np.uint16)
    albedo = np.zeros((*shape, 4), "f4")
    albedo[z, y, x] = packed[:, 3:].copy().view(np.uint8) / 255.0
    out = {"sheets": sheets.reshape(3, 2, *sheets.shape[1:]), "kinds": cells[..., 0], "opacity": cells[..., 1] / 255.0,
           "albedo": albedo}  # fmt: skip
    if "voxels.emission" in renderer.frame.resources:
        # The cell's is with its first sheet.
        first = np.concatenate([[True], (cell[1:] != cell[:-1]).any(axis=1)])
        emission = np.zeros((*shape, 4), "f4")
        emission[z[first], y[first], x[first]] = store(renderer, "voxels.emission")[numbers[first]]
        out["emission"] = emission
    return grid, out
