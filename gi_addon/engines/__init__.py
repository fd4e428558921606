# SPDX-License-Identifier: GPL-3.0-or-later
"""The techniques. Each file reads as its column of the paper's Figure 4: passes in order, edges by resource names."""

from __future__ import annotations

from collections.abc import Callable

from ..graph import Pass
from ..settings import Settings
from . import lpv, rsm, ssdo, vct

# Technique -> its passes in execution order, for the settings and the film layers wanted.
TECHNIQUES: dict[str, Callable[[Settings, tuple[str, ...]], list[Pass]]] = {
    "RSM": rsm.passes,
    "LPV": lpv.passes,
    "VCT": vct.passes,
    "SSDO": ssdo.passes,
}
