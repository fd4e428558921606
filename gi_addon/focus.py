# SPDX-License-Identifier: GPL-3.0-or-later
"""Which part of a scene the grids and maps are for, where something huge only lies around it.

A ground of a kilometre under a chair leaves one cell, or one texel of the sun's map, for the chair. Such a backdrop
receives shadows and bounced light but needs no cells of its own far from everything else: what it does to the rest it does
from near by. Of a plane at distance h, what lies farther than R from its nearest point has the view factor h²/(h² + R²) for a
receiver along it, and ½ h/√(h² + R²) for one across it: that share of the ground's bounced light is lost.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .scene import Scene

# How many times larger than all the rest a backdrop is. Below, the region would hardly be smaller than the whole.
_LARGER = 8.0
# The region reaches this many diagonals of the rest beyond it, and this many times the distance from the rest's middle to the
# nearest backdrop: view factor 1/26 along it, at most 1/10 across (of ½).
_AROUND = 2.0
_AROUND_DISTANCES = 5.0
# What is not this much smaller than everything is not worth leaving anything out for.
_WORTH = 0.5
# What is hit along this many of the six axes from the rest's middle encloses it: a room, not a ground.
_ENCLOSED = 4
# An enclosure this many times larger (a sky's dome) is as good as infinitely far.
_FAR_AWAY = 64.0
# Meshes above this many triangles are not looked at closely, and count as enclosures.
_MOST_TRIANGLES = 300_000


@dataclass(frozen=True)
class Focus:
    """World-space boxes (2, 3) in m: ``core`` holds all but the backdrop, ``region`` what grids and bounce maps cover,
    ``whole`` everything. All three are the same where there is no backdrop. ``free_path``: how far light flies in the core from
    surface to surface, m; 0 where that has no meaning."""

    core: np.ndarray
    region: np.ndarray
    whole: np.ndarray
    free_path: float = 0.0

    @staticmethod
    def on(bounds: np.ndarray) -> Focus:
        """A scene without a backdrop."""
        return Focus(bounds, bounds, bounds)

    @property
    def narrow(self) -> bool:
        return self.core is not self.whole


def find_focus(scene: Scene) -> Focus:
    """The scene's focus, and how dense what it holds stands."""
    focus = _without_backdrop(scene)
    return replace(focus, free_path=_free_path(scene, focus.core))


def _free_path(scene: Scene, core: np.ndarray) -> float:
    """Mean length of chords in the box ``core`` (2, 3) between the surfaces inside and its sides, m: 4 V/S (A. Cauchy), S the
    larger of the surfaces' area and the box's own, which most rooms' walls are."""
    extent = np.maximum(core[1] - core[0], 0.0)
    volume = float(np.prod(extent))
    if not np.isfinite(volume) or volume <= 0.0:
        return 0.0
    sides = 2.0 * float(extent[0] * extent[1] + extent[1] * extent[2] + extent[2] * extent[0])
    boxes = scene.instance_bounds()
    inside = ((boxes >= core[0]) & (boxes <= core[1])).all(axis=(1, 2)) if len(boxes) else np.zeros(0, bool)
    placed: dict[int, list[np.ndarray]] = {}
    for i in np.flatnonzero(inside):
        placed.setdefault(int(scene.instances.mesh[i]), []).append(scene.instances.matrix[i][:3, :3])
    surface = 0.0
    for mesh, turns in placed.items():
        corners = scene.meshes[mesh].positions.astype("f8")[scene.meshes[mesh].triangles]
        twice = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        own = float(np.linalg.norm(twice, axis=1).sum()) / 2.0
        for turn in turns:
            # Exact where an instance is scaled alike along all axes.
            surface += own * abs(float(np.linalg.det(turn))) ** (2.0 / 3.0)
    return 4.0 * volume / max(surface, sides)


def _without_backdrop(scene: Scene) -> Focus:
    """Leave out the largest instances one by one, as long as each dwarfs what remains and does not enclose it."""
    whole = scene.bounds()
    boxes = scene.instance_bounds()
    finite = np.isfinite(boxes).all(axis=(1, 2))
    size = np.where(finite, np.linalg.norm(boxes[:, 1] - boxes[:, 0], axis=1), -1.0) if len(boxes) else np.zeros(0)
    order = [int(i) for i in np.argsort(-size, kind="stable") if size[i] >= 0.0]
    if len(order) < 2:
        return Focus.on(whole)
    # Box of the k-th and all smaller ones.
    low = np.minimum.accumulate(boxes[order, 0][::-1], axis=0)[::-1]
    high = np.maximum.accumulate(boxes[order, 1][::-1], axis=0)[::-1]
    first = 0
    while first + 1 < len(order):
        rest = np.stack([low[first + 1], high[first + 1]])
        diagonal = float(np.linalg.norm(rest[1] - rest[0]))
        ratio = size[order[first]] / max(diagonal, 1e-30)
        if diagonal <= 0.0 or ratio < _LARGER or (ratio < _FAR_AWAY and _encloses(scene, order[first], rest.mean(axis=0))):
            break
        first += 1
    if first == 0:
        return Focus.on(whole)
    core = np.stack([low[first], high[first]])
    nearest = min(_distance(_corners(scene, i, core.mean(axis=0))) for i in order[:first])
    around = max(_AROUND * float(np.linalg.norm(core[1] - core[0])), _AROUND_DISTANCES * nearest)
    region = np.stack([np.maximum(core[0] - around, whole[0]), np.minimum(core[1] + around, whole[1])])
    worth = np.linalg.norm(region[1] - region[0]) < _WORTH * np.linalg.norm(whole[1] - whole[0])
    return Focus(core, region, whole) if worth else Focus.on(whole)


def _corners(scene: Scene, instance: int, point: np.ndarray) -> np.ndarray:
    """Triangle corners (T, 3, 3) of an instance, relative to ``point`` (3,) of the world."""
    mesh, matrix = scene.meshes[scene.instances.mesh[instance]], scene.instances.matrix[instance]
    return (mesh.positions.astype("f8") @ matrix[:3, :3].T + matrix[:3, 3] - point)[mesh.triangles]


def _distance(corners: np.ndarray) -> float:
    """Distance from the origin to the nearest of triangles (T, 3, 3)."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    nearest = []
    for p, q in ((a, b), (b, c), (c, a)):
        d = q - p
        t = np.clip(-(p * d).sum(axis=1) / np.maximum((d * d).sum(axis=1), 1e-300), 0.0, 1.0)
        nearest.append(np.linalg.norm(p + d * t[:, None], axis=1))
    best = np.min(nearest, axis=0)
    # The foot on the triangle's plane, where it lies within all three edges.
    n = np.cross(b - a, c - a)
    area2 = (n * n).sum(axis=1)
    height = (a * n).sum(axis=1) / np.sqrt(np.maximum(area2, 1e-300))
    within = area2 > 0.0
    for p, q in ((a, b), (b, c), (c, a)):
        within = within & ((np.cross(q - p, -p) * n).sum(axis=1) >= 0.0)
    return float(np.where(within, np.minimum(np.abs(height), best), best).min(initial=np.inf))


def _encloses(scene: Scene, instance: int, point: np.ndarray) -> bool:
    """Whether axis-parallel rays from ``point`` hit the instance in at least _ENCLOSED of the six directions."""
    if len(scene.meshes[scene.instances.mesh[instance]].triangles) > _MOST_TRIANGLES:
        return True
    corners = _corners(scene, instance, point)
    hits = 0
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
        # Twice the signed areas that the ray's foot (the origin) spans with each edge.
        wa, wb, wc = (p[:, u] * q[:, v] - p[:, v] * q[:, u] for p, q in ((b, c), (c, a), (a, b)))
        total = wa + wb + wc
        inside = ((wa >= 0) & (wb >= 0) & (wc >= 0)) | ((wa <= 0) & (wb <= 0) & (wc <= 0))
        inside &= total != 0.0
        at = (wa * a[:, axis] + wb * b[:, axis] + wc * c[:, axis])[inside] / total[inside]
        hits += int((at > 0.0).any()) + int((at < 0.0).any())
    return hits >= _ENCLOSED
