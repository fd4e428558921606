# SPDX-License-Identifier: GPL-3.0-or-later
"""Emissive triangles as a light to draw points from: by their power, and by how much of it reaches the scene's surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from .scene import DIFFUSE, Scene

_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
# Share of the points that the receivers have a say in. The rest is drawn by power alone, so that no point weighs more than
# four times what it does without them, however wrong they are about what stands between.
_GUIDED = 0.75
# More emissive triangles than this are drawn by power alone: every one is looked at from every receiver.
_MOST_GUIDED = 50_000


@dataclass(frozen=True)
class Emitters:
    """Emissive triangles of the scene: corners (T, 3, 3) world space, radiance (T, 3) W/(m²·sr) from both sides. ``outward``
    (T,) is 1 where the triangle's own normal points out of a closed mesh, −1 where into it, 0 where the mesh is open: the inside
    of a closed one lights nothing. ``receivers`` (R, 3) are points that are to be lit."""

    corners: np.ndarray
    radiance: np.ndarray
    outward: np.ndarray | None = None
    receivers: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))

    @staticmethod
    def none() -> Emitters:
        return Emitters(np.zeros((0, 3, 3)), np.zeros((0, 3)))

    @staticmethod
    def of(scene: Scene, emission: Sequence[np.ndarray], receivers: np.ndarray | None = None) -> Emitters:
        """The emissive triangles of ``scene``; ``emission`` is the mean radiance (3,) of each material. Triangles
        without area are left out."""
        corners, radiance, outward = [], [], []
        for _, material, triangles in scene.world_triangles(DIFFUSE, [(value > 0.0).any() for value in emission]):
            corners.append(triangles)
            radiance.append(np.broadcast_to(emission[material], (len(triangles), 3)))
            outward.append(np.full(len(triangles), _orientation(triangles)))
        if not corners:
            return Emitters.none()
        found = Emitters(np.concatenate(corners), np.concatenate(radiance))
        solid = found.areas() > 0.0
        receivers = np.zeros((0, 3)) if receivers is None else receivers
        return Emitters(found.corners[solid], found.radiance[solid], np.concatenate(outward)[solid], receivers)

    def __len__(self) -> int:
        return len(self.corners)

    def areas(self) -> np.ndarray:
        """Triangle areas (T,), m²."""
        return 0.5 * np.linalg.norm(self._crosses(), axis=1)

    def _crosses(self) -> np.ndarray:
        return np.cross(self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0])

    @cached_property
    def share(self) -> np.ndarray:
        """Each triangle's share (T,) of the points: by luminous power, and by what of it arrives at the receivers.

        Of all densities p that serves receivers y with irradiances E_y = Σ_t g_ty best together: the sum of their relative
        variances, Σ_y Σ_t g_ty² / (p_t E_y²), is least where p_t ∝ √(Σ_y g_ty² / E_y²).
        """
        power = self.areas() * (self.radiance @ _LUMINANCE)
        by_power = power / power.sum()
        if not len(self.receivers) or len(self) > _MOST_GUIDED or self.outward is None:
            return by_power
        normal = self._crosses()
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        middle, area = self.corners.mean(axis=1), self.areas()
        square = np.zeros(len(self))
        for receiver in self.receivers:
            to = receiver - middle
            d2 = (to * to).sum(axis=1)
            cos = (normal * to).sum(axis=1) / np.sqrt(np.maximum(d2, 1e-30))
            cos = np.where(self.outward == 0.0, np.abs(cos), np.maximum(cos * self.outward, 0.0))
            arriving = power * cos / (d2 + area)  # the triangle's own area bounds what it gives a point on it
            total = arriving.sum()
            if total > 0.0:
                square += (arriving / total) ** 2
        guided = np.sqrt(square)
        if not guided.sum() > 0.0:
            return by_power
        return _GUIDED * guided / guided.sum() + (1.0 - _GUIDED) * by_power

    @cached_property
    def cumulative(self) -> np.ndarray:
        return np.cumsum(self.share)


def _orientation(corners: np.ndarray) -> float:
    """1 or −1 where triangles (T, 3, 3) close a volume, by the sign of what they enclose; 0 where an edge is open."""
    if not 4 <= len(corners) <= _MOST_GUIDED:
        return 0.0
    # Vertices in one place are one, to a rounding of 32 bits; triangles that have lost a corner by that are none.
    points = corners.reshape(-1, 3)
    grain = 1e-5 * float(np.ptp(points, axis=0).max()) or 1.0
    _, vertex = np.unique(np.round((points - points.min(axis=0)) / grain), axis=0, return_inverse=True)
    vertex = vertex.reshape(-1, 3)
    a, b, c = vertex.T
    vertex = vertex[(a != b) & (b != c) & (c != a)]
    edges = np.concatenate([vertex[:, (0, 1)], vertex[:, (1, 2)], vertex[:, (2, 0)]])
    _, forth = np.unique(edges, axis=0, return_counts=True)
    _, both = np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)
    if (forth != 1).any() or (both != 2).any():  # each edge once in either direction
        return 0.0
    a, b, c = np.moveaxis(corners - corners.reshape(-1, 3).mean(axis=0), 1, 0)
    return float(np.sign(np.einsum("ij,ij->", a, np.cross(b, c))))
