# SPDX-License-Identifier: GPL-3.0-or-later
"""Which parts of the world light what the camera sees: a room is lit through its windows, and directions that end at its
walls are wasted."""

from __future__ import annotations

import numpy as np

from ..facts import Facts
from ..frame import Frame
from ..gpu_types import LIGHT_WORLD
from ..graph import Buffer, Pass, Planned
from .occupancy import CELL_UNIFORMS, set_cells

# Bins of the sky (rows from −z to +z by elevation, columns by azimuth: 15° each) and points that look at each of them.
ROWS, COLUMNS = 12, 24
RECEIVERS = 256
# Fewer sub-frames than this are a preview that must not wait.
_FEWEST_SUBFRAMES = 4


class WorldGuide(Pass):
    """Counts, for every bin of the sky, the visible points whose ray into it leaves the scene, and lets the world's
    directions of direct light be drawn by radiance × count. Only the density changes, not the estimate: see
    WorldMap.guided. Bounces come from surfaces that need not be in sight, so theirs are drawn by radiance alone."""

    title = "World Guide"
    reads = ("occupancy",)
    writes = (
        Buffer("world.receivers", "world_receivers", "visible points; w is 0 where the camera sees none", "vec4",
               np.dtype(("f4", 4)), lambda f: RECEIVERS, scratch=True),
        Buffer("world.guide", "world_guide", "visible points that see the bin of the sky", "uint", np.dtype("u4"),
               lambda f: ROWS * COLUMNS),
    )  # fmt: skip
    uniforms = CELL_UNIFORMS
    shaders = {
        "receivers": {"compute": "passes/world_receivers_comp.glsl"},
        "main": {"compute": "passes/world_guide_comp.glsl"},
    }
    depends = ("camera", "transforms", "meshes", "materials")
    settings = ("world.aimed",)

    def defines(self, facts: Facts) -> dict[str, int]:
        return {"GUIDE_ROWS": ROWS, "GUIDE_COLUMNS": COLUMNS, "GUIDE_RECEIVERS": RECEIVERS}

    def absent(self, facts: Facts) -> str | None:
        if not any(s.kind == LIGHT_WORLD for s in facts.rig.sources):
            return "the world gives no light"
        if not facts.settings.use_shadows:
            return "shadows are switched off"
        if not facts.settings.world.aimed:
            return "the world's directions are not aimed"
        return None if facts.subframes >= _FEWEST_SUBFRAMES else f"fewer than {_FEWEST_SUBFRAMES} sub-frames"

    def run(self, frame: Frame, planned: Planned) -> None:
        if frame.subframe > 0:
            return
        counts = frame.resources["world.guide"]
        if planned.stale:
            counts.write(bytes(counts.size))
            for key, size in (("receivers", (RECEIVERS,)), ("main", (RECEIVERS, ROWS * COLUMNS))):
                program = frame.program(planned, key)
                set_cells(frame, program, planned.facts)
                frame.compute(planned, program, size, (64, 1))
        rig = planned.facts.rig
        seen = np.frombuffer(counts.read(), np.uint32)[: ROWS * COLUMNS].reshape(ROWS, COLUMNS)
        rig.direct_world = rig.world.guided(seen / RECEIVERS)
