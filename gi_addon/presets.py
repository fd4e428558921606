# SPDX-License-Identifier: GPL-3.0-or-later
"""Named sets of settings: the paper's own, and three trades of time for quality.

A preset lists only what it is about; a technique's settings that it does not name keep their values.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .settings import Settings, walk


@dataclass(frozen=True)
class Preset:
    """A preset: shown ``label``, one sentence of help, values by dotted setting name."""

    label: str
    help: str
    values: dict[str, Any]


# What each preset of our own may take: its time as a share of that of Cycles at one sample with OpenImageDenoise, which is what a
# user would otherwise do (`quartet compare --sweep presets` says how near each comes).
SHARES = {"PREVIEW": 0.25, "BALANCED": 1.0, "FINAL": 4.0}

# What a preset of our own takes back of the paper's.
_OURS: dict[str, Any] = {
    "share_reflections": True, "rsm.visibility": "CELLS", "lpv.cascades": "AUTO", "vct.shadow_cones": False,
    "vct.continuous_voxelization": False, "ssdo.layers": 2, "ssdo.margin": 0.25, "ssdo.steps": 24,
}  # fmt: skip

PRESETS: dict[str, Preset] = {
    "PAPER": Preset(
        "Paper", "Each technique as the paper's section VI measures it: a row of Table 2, one bounce, one sub-frame",
        # RSM: 512², one of four sets, virtual lights without visibility, Mittring's occlusion by single points. LPV: 32³. VCT: a
        # shadow cone, voxels made anew in each frame. SSDO: the smallest set, what the picture shows and no more, Mittring's
        # occlusion, shadow maps. A ray of each pixel's own for reflections. The paper names neither its numbers of cones for
        # diffuse light nor of iterations; LPV's iterations end when all light has arrived.
        {"samples": 1, "viewport_samples": 1, "bounces": 1, "share_reflections": False, "gather_scale": 4, "ao.steps": 1,
         "rsm.resolution": 512, "rsm.samples": 200, "rsm.visibility": "NONE", "lpv.resolution": 32, "lpv.cascades": "1",
         "vct.resolution": 128, "vct.cones": 12, "vct.shadow_cones": True, "vct.continuous_voxelization": True,
         "ssdo.samples": 100, "ssdo.steps": 32, "ssdo.layers": 1, "ssdo.margin": 0.0},
    ),
    "PREVIEW": Preset(
        "Preview", "The fastest picture worth looking at: small maps, few samples, one bounce",
        {**_OURS, "samples": 1, "viewport_samples": 8, "bounces": 1, "gather_scale": 8, "shadows.resolution": 512, "ao.steps": 6,
         "world.samples": 2, "world.resolution": 256,
         "rsm.resolution": 256, "rsm.samples": 48, "lpv.resolution": 16, "vct.resolution": 32,
         "vct.cones": 4, "ssdo.samples": 48, "ssdo.layers": 1, "ssdo.margin": 0.1},
    ),
    # Against a Cycles that bounces on, later bounces are worth more than all else, and in grids they cost next to nothing
    # while the light stands still. Sub-frames average every other noise, so each takes few cones and samples; virtual lights are
    # bounded as discs, which too few of make dark.
    "BALANCED": Preset(
        "Balanced", "About the time of Cycles with one denoised sample: four sub-frames, three bounces",
        {**_OURS, "samples": 4, "viewport_samples": 16, "bounces": 3, "gather_scale": 4, "shadows.resolution": 1024,
         "ao.steps": 12, "world.samples": 4, "world.resolution": 512,
         "rsm.resolution": 512, "rsm.samples": 100, "lpv.resolution": 32, "vct.resolution": 64,
         "vct.cones": 4, "ssdo.samples": 48},
    ),
    "FINAL": Preset(
        # Cycles' own default is four diffuse bounces.
        "Final", "Smooth edges, shadows and bounce light for stills: sixteen sub-frames, four bounces as Cycles by default",
        {**_OURS, "samples": 16, "viewport_samples": 64, "bounces": 4, "gather_scale": 4, "shadows.resolution": 2048,
         "ao.steps": 16, "world.samples": 4, "world.resolution": 1024,
         "rsm.resolution": 512, "rsm.samples": 200, "lpv.resolution": 32, "vct.resolution": 64,
         "vct.cones": 4, "ssdo.samples": 48},
    ),
}  # fmt: skip


def apply(settings: Settings, name: str) -> Settings:
    """Set ``settings`` to a preset's values and return it. Raises KeyError for an unknown preset."""
    known = {path for path, _, _ in walk()}
    for path, value in PRESETS[name].values.items():
        # Values of techniques that this build does not have wait for them.
        if path in known:
            settings.set(path, value)
    return settings
