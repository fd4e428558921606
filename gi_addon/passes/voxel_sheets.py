# SPDX-License-Identifier: GPL-3.0-or-later
"""How many sheets of surface a scene may have in a grid of voxels: a bound from its triangles, before anything is drawn.

Memory for sheets is planned by it (passes/voxels.py). A triangle faces one of six sides most and adds at most one sheet to each
cell that it meets.

Small and thin triangles, many in one cell, count by the cells of boxes, each cell once: a small one's own box; a thin one is cut
into slices one cell wide along the longest side of its box. Of very many triangles all six parts of the cells in their instances'
boxes count.

For all others let w, h be its extents across the axis that it faces, d the one along it, A the area of its shadow along the axis
and S of those along the other two, all in cells:

- its shadow meets at most A + 2 (w + h) + 4 columns: whole squares are no more than its area, and an edge of a convex shape
  enters a new square only where it crosses a line, each line twice;
- a column has one cell more for each layer's border that the triangle crosses within it. What it shares with one border is a
  segment, which meets at most du + dv + 3 columns; over all borders, d + 1 at most, the sum of du and dv is no more than
  S + w + h;
- it meets no cell outside its box.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..scene import DIFFUSE, Scene

# Rounding on the GPU: so much farther, in cells, may a triangle reach.
_ROUNDING = 1e-3
# And this much of a normal's length, or of its triangle's sides times a cell, may be otherwise.
_TIE = 1e-4
# Cells along each side of a box whose cells are counted; slices that a triangle is cut into at most.
_SMALL, _SLICES = 2, 32
_PARTS = 6
# Triangles that are looked at together, about 150 bytes each. Scenes that would take longer than so many of them, an instance as
# long as 64, count by their instances' boxes alone (1.5 s a million are too long to wait for at each change), unless that makes
# more sheets than so many (52 bytes and more each).
_BATCH, _MANY, _INSTANCE, _LOOSE = 1 << 19, 1 << 21, 64, 1 << 22


def most_sheets(scene: Scene, low: np.ndarray, cell: float, size: tuple[int, int, int], levels: int) -> tuple[int, ...]:
    """The most sheets in each level, the cells first: a coarse cell has what any of its eight has. The grid's corner
    ``low`` (3,) and ``cell`` in m."""
    taken = np.zeros(size[::-1], np.uint8)  # cells of what is counted by cells, a bit for each part
    counts = np.zeros(levels + 1)
    drawn = _drawn(scene)
    by_boxes = sum(len(scene.meshes[scene.instances.mesh[i]].triangles) + _INSTANCE for i in drawn) > _MANY
    if by_boxes:
        boxes = (scene.instance_bounds()[drawn] - low) / cell
        _take(taken, 1, *_boxes(boxes[:, 0], boxes[:, 1], size))
        by_boxes = _PARTS * np.count_nonzero(taken) <= _LOOSE
        taken *= (1 << _PARTS) - 1 if by_boxes else 0
    if not by_boxes:
        for corners, facing in _faced(scene, drawn, low, cell):
            counts += _add(taken, corners, facing, size, levels)
    for level in range(levels + 1):
        counts[level] += sum(int(np.count_nonzero(taken & (1 << part))) for part in range(_PARTS))
        if level < levels:
            taken = taken[::2] | taken[1::2]
            taken = taken[:, ::2] | taken[:, 1::2]
            taken = taken[:, :, ::2] | taken[:, :, 1::2]
    cells = np.array([np.prod([n >> level for n in size]) for level in range(levels + 1)])
    counts = np.minimum.accumulate(np.clip(np.ceil(counts), 1, _PARTS * cells))
    return tuple(int(n) for n in counts)


def _add(taken: np.ndarray, corners: np.ndarray, facing: np.ndarray, size: tuple[int, int, int], levels: int) -> np.ndarray:
    """Take the cells of small and thin triangles; what all others add, level by level."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    first, box = _boxes(np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c), size)
    inside = (box > 0).all(axis=1)
    if not inside.all():
        corners, facing, first, box = corners[inside], facing[inside], first[inside], box[inside]
    small = (box <= _SMALL).all(axis=1)
    thin = np.flatnonzero(~small & (box <= _SLICES).all(axis=1))
    slice_of, slice_first, slice_box = _slices(corners[thin], first[thin], box[thin], size)
    fat = np.zeros(len(thin), bool)
    fat[slice_of[(slice_box > _SMALL).any(axis=1)]] = True
    thin_slices = ~fat[slice_of]
    counted = np.concatenate([np.flatnonzero(small), thin[slice_of[thin_slices]]])
    boxes = np.concatenate([first[small], slice_first[thin_slices]]), np.concatenate([box[small], slice_box[thin_slices]])
    large = ~small
    large[thin[~fat]] = False
    counts = np.zeros(levels + 1)
    for part in range(_PARTS):
        chosen = facing[counted, part]
        _take(taken, 1 << part, boxes[0][chosen], boxes[1][chosen])
        chosen = large & facing[:, part]
        for level in range(levels + 1):
            counts[level] += _bound(corners[chosen], first[chosen], box[chosen], level, part >> 1)
    return counts


def _take(taken: np.ndarray, bits: int, first: np.ndarray, box: np.ndarray) -> None:
    """Set ``bits`` of all cells in boxes from cell ``first`` (N, 3), ``box`` (N, 3) cells a side."""
    large = (box > _SMALL).any(axis=1) & (box > 0).all(axis=1)
    for (x, y, z), (nx, ny, nz) in zip(first[large], box[large], strict=True):
        taken[z : z + nz, y : y + ny, x : x + nx] |= bits
    first, box = first[~large], box[~large]
    for offset in np.ndindex((_SMALL,) * 3):
        x, y, z = (first[(box > offset).all(axis=1)] + np.array(offset, np.int32)).T
        taken[z, y, x] |= bits


def _drawn(scene: Scene) -> list[int]:
    """The instances that are voxelized."""
    inst = scene.instances
    finite = np.isfinite(inst.matrix).all(axis=(1, 2))
    return [i for i in range(len(inst)) if inst.visibility[i] & DIFFUSE and inst.materials[i] and finite[i]]


def _faced(scene: Scene, drawn: list[int], low: np.ndarray, cell: float) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Corners (T, 3, 3) in cells of all triangles that are voxelized, and which of the six parts each may add to (T, 6), some
    at a time."""
    all_corners, all_facing, count = [], [], 0
    for positions, normals, triangles in _instances(scene, drawn):
        placed = ((positions - low) / cell).astype("f4")
        for k in range(0, len(triangles), _BATCH):
            some = triangles[k : k + _BATCH]
            corners = placed[some]
            one, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
            normal = _cross(one, other)
            extent = np.abs(normal)
            most = extent.max(axis=1)
            # By so much may the normal be another, on the GPU or here.
            error = (_TIE * (most + np.abs(one).sum(axis=1) + np.abs(other).sum(axis=1)))[:, None]
            axes = (extent >= most[:, None] - error) & (most > 0.0)[:, None]
            # The front is where the vertices' normals point.
            toward = np.einsum("tvk,tk->tv", normals[some], normal)
            along, against = (toward >= -error).any(axis=1)[:, None], (toward <= error).any(axis=1)[:, None]
            upwards, downwards = normal >= -error, normal <= error
            facing = [axes & (upwards & along | downwards & against), axes & (upwards & against | downwards & along)]
            all_corners.append(corners)
            all_facing.append(np.stack(facing, axis=2).reshape(-1, _PARTS))
            count += len(some)
            if count >= _BATCH:
                yield np.concatenate(all_corners), np.concatenate(all_facing)
                all_corners, all_facing, count = [], [], 0
    if count:
        yield np.concatenate(all_corners), np.concatenate(all_facing)


def _instances(scene: Scene, drawn: list[int]) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Positions (V, 3) and unit normals (V, 3), in world space, and triangles (T, 3), of what is voxelized."""
    inst = scene.instances
    for i in drawn:
        mesh, matrix = scene.meshes[inst.mesh[i]], inst.matrix[i]
        # Normals turn by the cofactors; a mirrored triangle winds the other way, its front stays.
        rows = matrix[:3, :3]
        cofactors = _cross(rows[[1, 2, 0]], rows[[2, 0, 1]]) * (-1.0 if np.linalg.det(rows) < 0.0 else 1.0)
        normals = mesh.normals @ (cofactors / max(np.abs(cofactors).max(), 1e-300)).T.astype("f4")
        normals /= np.maximum(np.sqrt(np.einsum("vk,vk->v", normals, normals)), 1e-20)[:, None]
        yield mesh.positions.astype("f8") @ rows.T + matrix[:3, 3], normals, mesh.triangles


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross products of (N, 3), several times as fast as NumPy's."""
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=1)


def _boxes(low: np.ndarray, high: np.ndarray, size: tuple[int, int, int]) -> tuple[np.ndarray, np.ndarray]:
    """First cells (N, 3) of boxes from ``low`` to ``high`` (N, 3) in the grid, and how many along each side (none: 0 or less)."""
    first = np.maximum(np.floor(low - _ROUNDING), 0).astype(np.int32)
    last = np.minimum(np.floor(high + _ROUNDING), np.array(size) - 1).astype(np.int32)
    return first, last - first + 1


def _slices(corners: np.ndarray, first: np.ndarray, box: np.ndarray, size: tuple[int, int, int]):
    """Boxes of slices one cell wide along the longest side of triangles' boxes (T, 3): of which triangle each is (N,), its first
    cell and how many cells along each side (N, 3)."""
    owners, firsts, boxes = [np.zeros(0, int)], [np.zeros((0, 3), np.int32)], [np.zeros((0, 3), np.int32)]
    longest = box.argmax(axis=1)
    for axis in range(3):
        chosen = np.flatnonzero(longest == axis)
        for k in range(int(box[chosen, axis].max(initial=0))):
            chosen = chosen[box[chosen, axis] > k]
            layer = first[chosen, axis] + k
            a = corners[chosen]
            b = a[:, [1, 2, 0]]
            # Each edge as far as it lies in the slice.
            along, way = a[..., axis], (b - a)[..., axis]
            near, far = (layer - _ROUNDING)[:, None], (layer + 1.0 + _ROUNDING)[:, None]
            way = np.where(np.abs(way) < 1e-12, 1e-12, way)
            t = np.clip(np.stack([(near - along) / way, (far - along) / way]), 0.0, 1.0)
            meets = (np.minimum(along, b[..., axis]) <= far) & (np.maximum(along, b[..., axis]) >= near)
            ends = a + (b - a) * t[..., None]
            outside = ~meets[..., None]
            low = np.where(outside, np.inf, ends.min(axis=0)).min(axis=1)
            high = np.where(outside, -np.inf, ends.max(axis=0)).max(axis=1)
            low[:, axis] = high[:, axis] = layer + 0.5
            there = meets.any(axis=1)
            slice_first, slice_box = _boxes(low[there], high[there], size)
            inside = (slice_box > 0).all(axis=1)
            owners.append(chosen[there][inside])
            firsts.append(slice_first[inside])
            boxes.append(slice_box[inside])
    return np.concatenate(owners), np.concatenate(firsts), np.concatenate(boxes)


def _bound(corners: np.ndarray, first: np.ndarray, box: np.ndarray, level: int, axis: int) -> float:
    """The most cells of a level that triangles (T, 3, 3) meet that face ``axis`` most, in boxes of the cells (T, 3)."""
    p = corners / (1 << level)
    box = ((first + box - 1 >> level) - (first >> level) + 1).astype("f8")
    u, v = (axis + 1) % 3, (axis + 2) % 3
    shadow = np.abs(_cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])) / 2.0
    extent = p.max(axis=1) - p.min(axis=1)
    around = extent[:, u] + extent[:, v]
    columns = np.minimum(shadow[:, axis] + 2.0 * around + 4.0, box[:, u] * box[:, v])
    deep = extent[:, axis]
    borders = shadow[:, u] + shadow[:, v] + around + 3.0 * (deep + 1.0)
    # What runs along a border may be on either side of it by rounding.
    rounded = shadow[:, axis] * np.minimum(2.0 * _ROUNDING * (deep + 1.0) / np.maximum(deep, 2.0 * _ROUNDING), 1.0)
    return float(np.minimum(columns + np.where(box[:, axis] > 1.0, borders + rounded, 0.0), box.prod(axis=1)).sum())
