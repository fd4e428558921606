# SPDX-License-Identifier: GPL-3.0-or-later
"""The world's radiance as a map to draw directions from."""

from __future__ import annotations

from copy import copy

import numpy as np

_GUIDED = 0.75  # share of the directions that a guide has a say in


class WorldMap:
    """Equirectangular radiance, importance-sampled by luminance × solid angle.

    ``radiance`` (H, W, 3), row 0 at the bottom (−Z); a direction d has u = ½ − atan2(d.y, d.x)/2π and
    v = asin(d.z)/π + ½, Blender's equirectangular convention.
    """

    def __init__(self, radiance: np.ndarray) -> None:
        self.radiance = np.where(np.isfinite(radiance), np.maximum(radiance, 0.0), 0.0).astype(np.float64)
        height, width = self.radiance.shape[:2]
        edges = np.sin(np.pi * (np.arange(height + 1) / height - 0.5))
        self.solid_angle = (np.diff(edges) * 2.0 * np.pi / width)[:, None] * np.ones((1, width))
        weight = (self.radiance @ np.array([0.2126, 0.7152, 0.0722])) * self.solid_angle
        self.total = float(weight.sum())
        if self.total > 0.0:
            self._draw_by(weight / self.total)

    def _draw_by(self, probability: np.ndarray) -> None:
        rows = probability.sum(axis=1)
        self._row_cdf = np.concatenate([[0.0], np.cumsum(rows)]) / rows.sum()
        safe = np.where(rows > 0.0, rows, 1.0)[:, None]
        zeros = np.zeros((len(rows), 1))
        self._column_cdf = np.concatenate([zeros, np.cumsum(probability, axis=1) / safe], axis=1)
        self.probability = probability

    def guided(self, visible: np.ndarray) -> WorldMap:
        """The same world, directions drawn by luminance × √``visible`` (rows, columns): the share in [0, 1] of the receivers
        that see a bin of equal angles, laid out as the map. Of all densities p that serves them best together: the sum of
        their variances, Σ ∫ (V L)²/p, is least where p ∝ L √(Σ V). A quarter is still drawn by luminance alone,
        so that no direction weighs more than four times what it does without a guide, however wrong the guide is."""
        if self.black:
            return self
        height, width = self.probability.shape
        rows, columns = visible.shape
        row = (np.arange(height) + 0.5) / height * rows
        column = (np.arange(width) + 0.5) / width * columns
        weight = self.probability * np.sqrt(visible)[row.astype(int)[:, None], column.astype(int)[None, :]]
        if weight.sum() <= 0.0:
            return self
        guided = copy(self)
        guided._draw_by(_GUIDED * weight / weight.sum() + (1.0 - _GUIDED) * self.probability)
        return guided

    @property
    def black(self) -> bool:
        return self.total <= 0.0

    def irradiance_scale(self) -> float:
        """Luminous flux density over all directions, W/m²: the sum of radiance × solid angle."""
        return self.total

    def sample(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Directions for points ``u`` (N, 2) in [0, 1): unit vectors (N, 3) towards the sky, radiance / pdf (N, 3) with
        the pdf per solid angle, and the pdf (N,)."""
        height, width = self.radiance.shape[:2]
        row = np.clip(np.searchsorted(self._row_cdf, u[:, 1], side="right") - 1, 0, height - 1)
        span = self._row_cdf[row + 1] - self._row_cdf[row]
        v = (row + np.where(span > 0, (u[:, 1] - self._row_cdf[row]) / np.where(span > 0, span, 1.0), 0.5)) / height
        cdf = self._column_cdf[row]
        column = np.clip((cdf <= u[:, :1]).sum(axis=1) - 1, 0, width - 1)
        index = np.arange(len(u))
        low, high = cdf[index, column], cdf[index, column + 1]
        fraction = np.where(high > low, (u[:, 0] - low) / np.where(high > low, high - low, 1.0), 0.5)
        phi = 2.0 * np.pi * (0.5 - (column + fraction) / width)
        # Uniform in the cell's solid angle: linear in z between the row's edges.
        z0, z1 = np.sin(np.pi * (row / height - 0.5)), np.sin(np.pi * ((row + 1) / height - 0.5))
        z = z0 + (z1 - z0) * (v * height - row)
        r = np.sqrt(np.maximum(0.0, 1.0 - z * z))
        direction = np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1)
        pdf = self.probability[row, column] / self.solid_angle[row, column]
        return direction, self.radiance[row, column] / pdf[:, None], pdf
