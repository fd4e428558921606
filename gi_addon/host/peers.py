# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles as a rival: what a user would render instead, timed with the scene already loaded. EEVEE is in ``eevee.py``."""

from __future__ import annotations

import time
from collections.abc import Sequence

import bpy
import numpy as np

from ..compare.sweeps import Candidate
from . import cycles

# Bounces of Cycles' default light paths.
_BOUNCES = 12
VERSION = f"Blender {bpy.app.version_string}"


def render(scene: bpy.types.Scene, candidate: Candidate, names: Sequence[str]) -> tuple[dict[str, np.ndarray], float]:
    """Render ``scene`` with Cycles; passes by name and the seconds of Blender's render call, kept data included.

    The picture is formed as the reference's (box filter of a pixel); everything else is Cycles' default.
    """
    options = dict(candidate.options)
    _set_up(scene, int(options["samples"]), candidate.method.endswith("OIDN"))
    scene.render.use_persistent_data = True
    start = time.perf_counter()
    passes = cycles.render_passes(scene, names)
    return passes, time.perf_counter() - start


def _set_up(scene: bpy.types.Scene, samples: int, denoise: bool) -> None:
    cycles.set_up(scene, cycles.Reference(_BOUNCES, samples, seed=7, unbiased=False, denoise=denoise))
    c = scene.cycles
    # The defaults that a reference render before this one has switched off.
    c.sample_clamp_direct, c.sample_clamp_indirect = 0.0, 10.0
    c.blur_glossy = 1.0
    c.light_sampling_threshold = 0.01
    c.use_light_tree = True
    c.pixel_filter_type, c.filter_width = "BOX", 1.0
