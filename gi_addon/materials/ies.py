# SPDX-License-Identifier: GPL-3.0-or-later
"""Photometric files of lamps (IESNA LM-63): what they send on average over all directions."""

from __future__ import annotations

import numpy as np

# Cycles' IES Texture gives candela as the strength of an emission: 4π/177.83, where 177.83 lm/W is the efficacy that it takes
# white light to have.
STRENGTH_PER_CANDELA = 4.0 * np.pi / 177.83
_STEPS = 2048


def mean_strength(text: str) -> float | None:
    """Mean over the sphere of what Cycles' IES Texture gives; None where ``text`` is no such file. Outside the angles listed
    nothing is sent."""
    _, found, rest = text.partition("TILT=")
    if not found:
        return None
    first, _, rest = rest.partition("\n")
    try:
        numbers = [float(word) for word in rest.replace(",", " ").split()]
        if first.strip().upper() == "INCLUDE":
            numbers = numbers[2 + 2 * int(numbers[1]) :]
        multiplier, down, around = numbers[2], int(numbers[3]), int(numbers[4])
        factor = multiplier * numbers[10] * numbers[11]
        angles = np.radians(numbers[13 : 13 + down])
        turns = np.array(numbers[13 + down : 13 + down + around])
        start = 13 + down + around
        candela = np.array(numbers[start : start + down * around]).reshape(around, down)
    except (ValueError, IndexError):
        return None
    if down < 1 or around < 1:
        return None
    middle = (turns[1:] - turns[:-1]) / 2.0
    share = np.ones(1) if around == 1 else np.append(middle, 0.0) + np.append(0.0, middle)
    mean = (share / share.sum()) @ candela
    theta = (np.arange(_STEPS) + 0.5) * np.pi / _STEPS
    value = np.interp(theta, angles, mean, left=0.0, right=0.0)
    return float(factor * STRENGTH_PER_CANDELA * (value * np.sin(theta)).sum() * np.pi / _STEPS / 2.0)
