# SPDX-License-Identifier: GPL-3.0-or-later
"""Reflected rays shared among neighbouring pixels: from what each pixel's rays found to what its glossy lobe reflects."""

from __future__ import annotations

from ..facts import Facts
from ..graph import Texture
from ..settings import Settings
from .screen import INDIRECT_GLOSSY, LOBE, ScreenPass, _screen

_NEARNESS = "1/distance of what is mirrored, 1/m, -1 where no lobe is"
# What a pass of reflected rays writes (lib/reflection_lib.glsl).
GLOSSY_TRACED = Texture("glossy.traced", "traced", f"radiance along the pixel's reflected ray, W/(m²·sr); {_NEARNESS}", "rgba32f",
                        _screen)  # fmt: skip
GLOSSY_RAY = Texture("glossy.ray", "traced_ray", "the ray's direction, world space; its density, 1/sr, 0 where it points below "
                     "the surface", "rgba32f", _screen)  # fmt: skip
# What of it is shared.
_SHARED = {"SHARED_GLOSSY": 0, "SHARED_SOURCES": 1}


class ReflectionSharing(ScreenPass):
    """A round of sharing: 1 or 2, which gives the light the lobe's colour; or 0, which only does that."""

    fragment = "passes/share_reflections_frag.glsl"

    def __init__(self, source: str, target: Texture, number: int, kind: str) -> None:
        self.title = f"Reflection Sharing of {target.name}"
        self.number, self.kind = number, kind
        rays = (GLOSSY_RAY.name,) if number < 2 else ()
        self.reads = (source, *rays, "gbuffer.depth", "gbuffer.normal", *LOBE)
        self.writes = (target,)

    def defines(self, facts: Facts) -> dict[str, int]:
        return {**_SHARED, "SHARED": _SHARED[self.kind], "SHARING_ROUND": self.number}


def reflection_sharing(
    settings: Settings, traced: Texture = GLOSSY_TRACED, target: Texture = INDIRECT_GLOSSY, kind: str = "SHARED_GLOSSY"
) -> list[ReflectionSharing]:
    """The passes that make ``target`` of what rays found, ``traced``."""
    if not settings.share_reflections:
        return [ReflectionSharing(traced.name, target, 0, kind)]
    mean = f"mean radiance over the lobe, W/(m²·sr); {_NEARNESS}"
    near = Texture(f"{traced.name}.near", "traced_near", mean, "rgba32f", _screen)
    return [ReflectionSharing(traced.name, near, 1, kind), ReflectionSharing(near.name, target, 2, kind)]
