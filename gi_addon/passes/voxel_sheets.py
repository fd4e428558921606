# SPDX-License-Identifier: GPL-3.0-or-later
"""How many sheets of surface a scene may have in a grid of voxels: a bound from its triangles, before anything is drawn.

Memory for sheets is planned by it (passes/voxels.py). A triangle faces one of six sides most and adds at most one sheet to each
cell that it meets. With w, h its extents across the axis that it faces, d the one along it, A the area of its shadow along the
axis and S of those along the other two, all in cells:

- its shadow meets at most A + 2 (w + h) + 4 columns: whole squares are no more than its area, and an edge of a convex shape
  enters a new square only where it crosses a line, each line twice;
- a column has one cell more for each layer's border that the triangle crosses within it. What it shares with one border is a
  segment, which meets at most du + dv + 3 columns; over all borders, d + 1 at most, the sum of du and dv is no more than
  S + w + h;
- it meets no cell outside its box.

Triangles of no more than two cells a side, many in one cell, count by the cells of their boxes, each once.
"""

from __future__ import annotations

import numpy as np

from ..scene import DIFFUSE, Scene

# Rounding on the GPU: so much farther, in cells, may a triangle reach.
_ROUNDING = 1e-3
# The two largest of a normal's parts may be taken for each other by rounding when they are this near to each other.
_TIE = 1e-4
# Cells along each side of the box of a triangle that is counted by its cells.
_SMALL = 2
_PARTS = 6


def most_sheets(scene: Scene, low: np.ndarray, cell: float, size: tuple[int, int, int], levels: int) -> tuple[int, ...]:
    """The most sheets in each level, the cells first: a coarse cell has what any of its eight has. The grid's corner
    ``low`` (3,) and ``cell`` in m."""
    corners, facing = _faced(scene, low, cell)
    counts = []
    for level in range(levels + 1):
        cells = np.array(size) >> level
        most = sum(_of_one_side(corners[facing[:, part]] / (1 << level), cells, part >> 1) for part in range(_PARTS))
        most = min(most, _PARTS * int(np.prod(cells)))
        counts.append(min([most, *counts[-1:]]))
    return tuple(max(1, n) for n in counts)


def _faced(scene: Scene, low: np.ndarray, cell: float) -> tuple[np.ndarray, np.ndarray]:
    """Corners (T, 3, 3) in cells of all triangles that are voxelized, and which of the six parts each may add to (T, 6)."""
    all_corners, all_facing = [np.zeros((0, 3, 3))], [np.zeros((0, _PARTS), bool)]
    for triangles, normals in _instances(scene):
        corners = (triangles - low) / cell
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        size = np.abs(normal)
        axes = (size >= (1.0 - _TIE) * size.max(axis=1, keepdims=True)) & (size.max(axis=1, keepdims=True) > 0.0)
        # The front is where the vertices' normals point.
        toward = np.einsum("tvk,tk->tv", normals, normal)
        slack = _TIE * np.linalg.norm(normals, axis=-1) * np.linalg.norm(normal, axis=-1)[:, None]
        along, against = (toward >= -slack).any(axis=1), (toward <= slack).any(axis=1)
        facing = np.zeros((len(corners), _PARTS), bool)
        for axis in range(3):
            upwards = normal[:, axis] >= 0.0
            facing[:, 2 * axis] = axes[:, axis] & np.where(upwards, along, against)
            facing[:, 2 * axis + 1] = axes[:, axis] & np.where(upwards, against, along)
        all_corners.append(corners)
        all_facing.append(facing)
    return np.concatenate(all_corners), np.concatenate(all_facing)


def _instances(scene: Scene):
    """Corners (T, 3, 3), and normals (T, 3, 3) at them, in world space of what is voxelized."""
    every = [True] * len(scene.materials)
    done: dict[int, int] = {}
    for i, _, triangles in scene.world_triangles(DIFFUSE, every):
        mesh = scene.meshes[scene.instances.mesh[i]]
        first = done.get(i, 0)
        done[i] = first + len(triangles)
        # Slots come in the order of the triangles.
        rows = np.concatenate([np.arange(a, a + n) for _, a, n in mesh.slots if n])[first : done[i]]
        matrix = scene.instances.matrix[i, :3, :3]
        # Normals turn by the cofactors, of either sign, and are no longer unit vectors.
        cofactors = np.stack([np.cross(matrix[1], matrix[2]), np.cross(matrix[2], matrix[0]), np.cross(matrix[0], matrix[1])])
        sign = -1.0 if np.linalg.det(matrix) < 0.0 else 1.0
        yield triangles, sign * (mesh.normals[mesh.triangles[rows]].astype("f8") @ cofactors.T)


def _of_one_side(corners: np.ndarray, size: np.ndarray, axis: int) -> int:
    """The most cells that triangles (T, 3, 3), in cells, meet that face ``axis`` most."""
    first = np.maximum(np.floor(corners.min(axis=1) - _ROUNDING), 0).astype(np.int64)
    last = np.minimum(np.floor(corners.max(axis=1) + _ROUNDING), size - 1).astype(np.int64)
    box = last - first + 1
    inside = (box > 0).all(axis=1)
    small = inside & (box <= _SMALL).all(axis=1)
    keys = [_key(np.minimum(first[small] + offset, last[small]), size) for offset in np.ndindex((_SMALL,) * 3)]
    count = len(np.unique(np.concatenate(keys)))
    large = inside & ~small
    if large.any():
        p, box = corners[large], box[large].astype("f8")
        u, v = (axis + 1) % 3, (axis + 2) % 3
        shadow = np.abs(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])) / 2.0
        extent = p.max(axis=1) - p.min(axis=1)
        around = extent[:, u] + extent[:, v]
        columns = np.minimum(shadow[:, axis] + 2.0 * around + 4.0, box[:, u] * box[:, v])
        deep = extent[:, axis]
        borders = shadow[:, u] + shadow[:, v] + around + 3.0 * (deep + 1.0)
        # What runs along a border may be on either side of it by rounding.
        rounded = shadow[:, axis] * np.minimum(2.0 * _ROUNDING * (deep + 1.0) / np.maximum(deep, 2.0 * _ROUNDING), 1.0)
        cells = np.minimum(columns + np.where(box[:, axis] > 1.0, borders + rounded, 0.0), box.prod(axis=1))
        count += int(np.ceil(cells).sum())
    return count


def _key(cell: np.ndarray, size: np.ndarray) -> np.ndarray:
    """A number for each of cells (N, 3)."""
    return (cell[:, 2] * size[1] + cell[:, 1]) * size[0] + cell[:, 0]
