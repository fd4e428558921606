# SPDX-License-Identifier: GPL-3.0-or-later
"""Smoothing of a low-resolution gather, before it is interpolated."""

from __future__ import annotations

from ..facts import Facts
from ..graph import Texture
from .gbuffer import gather_scale, gather_size
from .screen import DIRECTION, LIGHT, ScreenPass


def raw_gather(low: str) -> tuple[Texture, Texture]:
    """What a low-resolution gather writes for ``BlockSmoothing(low)``."""
    return (
        Texture(f"{low}.raw", "raw_indirect", f"{LIGHT}; mean of 1/distance of what it comes from, 1/m (0: not known)",
                "rgba32f", gather_size, scratch=True),
        Texture(f"{low}.raw_direction", "raw_direction", DIRECTION, "rgba32f", gather_size, scratch=True),
    )


class BlockSmoothing(ScreenPass):
    """Neighbouring blocks of one surface share their directions: ``low``.raw becomes ``low``, for passes/interpolate.glsl.
    ``in_pairs`` leaves light that falls off towards a surface's edge as it is, with more noise there; ``radius`` counts blocks
    each way. ``seen`` names a texture with a bit for each of 5 × 5 blocks that are of a block's surface with nothing between;
    without it that is taken from the G-buffer and from how near what lights a block is."""

    fragment = "passes/smooth_blocks_frag.glsl"

    def __init__(
        self, low: str, title: str, figure: str = "", *, in_pairs: bool = False, radius: int = 1, seen: str = ""
    ) -> None:  # fmt: skip
        self.title, self.figure, self.in_pairs, self.radius, self.seen = title, figure, in_pairs, radius, seen
        blocks = ("gbuffer.low_depth", "gbuffer.low_normal", "gbuffer.low_pixel")
        self.reads = (f"{low}.raw", f"{low}.raw_direction", *blocks, *([seen] if seen else []))
        self.writes = (
            Texture(low, "low_indirect", LIGHT, "rgba32f", gather_size, scratch=True),
            Texture(f"{low}.direction", "low_direction", DIRECTION, "rgba32f", gather_size, scratch=True),
        )  # fmt: skip

    def defines(self, facts: Facts) -> dict[str, int]:
        return {
            "GATHER_SCALE": gather_scale(facts), "IN_PAIRS": int(self.in_pairs), "RADIUS": self.radius,
            "HAS_SEEN": int(bool(self.seen)),
        }  # fmt: skip
