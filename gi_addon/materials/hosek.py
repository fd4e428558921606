# SPDX-License-Identifier: GPL-3.0-or-later
"""The fits of Blender's Hosek–Wilkie sky around a setting."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np

from . import hosek_numbers as table

# Added to the cosine from the zenith: the way through the air at the horizon is finite.
HOSEK_SLANT = 0.01


def horizon_basis(gamma: np.ndarray) -> np.ndarray:
    """What radiance below the horizon is made of, (..., 4), at angles ``gamma`` to the sun, rad."""
    return np.stack([np.ones_like(gamma), np.cos(gamma), np.cos(gamma) ** 2, np.exp(-3.0 * gamma)], -1)


def hosek_neighbours(turbidity: float, elevation: float, albedo: float) -> Iterator[tuple[float, np.ndarray]]:
    """(weight, numbers (3, 10) per channel) of the grid's corners around a setting: six of Perez's formula, four of
    :func:`horizon_basis`. Weights sum to 1; ``elevation`` in rad."""
    axes = (table.TURBIDITIES, table.ELEVATIONS, table.ALBEDOS)
    numbers = np.array(table.NUMBERS).reshape(*(len(a) for a in axes), 3, 10)
    at = (turbidity, np.degrees(elevation), albedo)
    places = [np.interp(v, axis, np.arange(len(axis))) for v, axis in zip(at, axes, strict=True)]
    low = [min(int(p), len(axis) - 2) for p, axis in zip(places, axes, strict=True)]
    for corner in product((0, 1), repeat=3):
        weight = np.prod([p - i if k else 1.0 - (p - i) for p, i, k in zip(places, low, corner, strict=True)])
        if weight > 0.0:
            yield float(weight), numbers[tuple(i + k for i, k in zip(low, corner, strict=True))]
