# SPDX-License-Identifier: GPL-3.0-or-later
"""Square tiles into one texture."""

from __future__ import annotations

import math
from collections.abc import Sequence


def pack(sizes: Sequence[int], *, power_of_two: bool = False) -> tuple[list[tuple[int, int]], tuple[int, int]]:
    """Place square tiles of ``sizes`` texels on shelves, largest first; with ``power_of_two`` each in a block of the next
    power of two at a multiple of that, so that a texel of a coarser level is of one tile alone.

    Returns their lower-left corners in the order given, and the atlas's (width, height), at least (1, 1).
    """
    if not sizes:
        return [], (1, 1)
    if power_of_two:
        sizes = [_power_of_two(s) for s in sizes]
    area = sum(s * s for s in sizes)
    width = max(max(sizes), _power_of_two(math.ceil(math.sqrt(area))) if len(sizes) > 1 else sizes[0])
    corners: list[tuple[int, int]] = [(0, 0)] * len(sizes)
    x = y = shelf = 0
    for index in sorted(range(len(sizes)), key=lambda i: -sizes[i]):
        size = sizes[index]
        if x + size > width:
            x, y, shelf = 0, y + shelf, 0
        corners[index] = (x, y)
        x += size
        shelf = max(shelf, size)
    used = max(corners[i][0] + sizes[i] for i in range(len(sizes)))
    width, height = used, y + shelf
    if power_of_two:
        width, height = _power_of_two(width), _power_of_two(height)
    return corners, (width, height)


def _power_of_two(n: int) -> int:
    return 1 << max(0, (n - 1).bit_length())
