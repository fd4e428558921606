# SPDX-License-Identifier: GPL-3.0-or-later
"""What the planner knows of a frame: the scene's facts, the settings, the picture's size."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .lights import Emitters, LightRig, build_rig
from .materials import CompiledGraph, Medium, mean_medium
from .outputs import film_layers
from .scene import CAMERA, Scene
from .settings import Settings
from .world_map import WorldMap

# Points of emissive meshes per sub-frame, each with a full cube of maps.
_EMITTER_SAMPLES = 2


@dataclass
class Facts:
    """Facts about one frame. Reasons that passes give for their absence come from these."""

    settings: Settings
    resolution: tuple[int, int]
    outputs: tuple[str, ...]
    subframes: int
    rig: LightRig
    radius: float
    triangles: int
    visible: bool
    emissive: bool
    transparent: bool
    diffuse: bool
    glossy: bool
    transmissive: bool
    subsurface: bool
    layered: bool
    world_black: bool
    ao_distance: float
    medium: Medium | None = None  # that fills the world
    stamps: dict[str, str] = field(default_factory=dict)

    @property
    def layers(self) -> tuple[str, ...]:
        """Film layers of the outputs."""
        return film_layers(self.outputs)

    @property
    def lit(self) -> bool:
        return bool(self.rig.sources)


def gather_facts(
    scene: Scene,
    compiled: list[CompiledGraph],
    settings: Settings,
    resolution: tuple[int, int],
    outputs: tuple[str, ...],
    subframes: int,
    world: WorldMap | None,
    emitters: Emitters,
) -> Facts:
    """Look at everything once."""
    bounds = scene.bounds()
    s = settings
    seen = scene.instances.visibility & CAMERA if len(scene.instances) else np.zeros(0, "u4")
    used = {m for i, ms in enumerate(scene.instances.materials) if seen[i] for m in ms}
    some = [compiled[m] for m in used]
    # Whatever looks at lit surfaces looks at the lights' bounce maps.
    bounced = s.use_indirect_diffuse or (s.use_glossy and any(c.glossy for c in some))
    bounced = bounced or (s.use_translucency and any(c.transmissive or c.subsurface for c in some))
    rig = build_rig(
        scene.lights, bounds,
        world=world, world_samples=s.world.samples,
        emitters=emitters, emitter_samples=_EMITTER_SAMPLES, area_lights=s.use_area_lights,
        shadows=s.use_shadows, bounces=s.bounces > 0 and bounced,
        shadow_resolution=s.shadows.resolution, bounce_resolution=s.rsm.resolution,
        world_resolution=s.world.resolution,
    )  # fmt: skip
    return Facts(
        settings=s,
        resolution=resolution,
        outputs=outputs,
        subframes=subframes,
        rig=rig,
        radius=float(np.linalg.norm(bounds[1] - bounds[0]) / 2.0) or 1.0,
        triangles=scene.triangle_count(),
        visible=bool(seen.any()) and scene.triangle_count() > 0,
        emissive=any(c.emissive for c in some),
        transparent=any(c.transparent or c.transmissive for c in some),
        diffuse=any(c.diffuse or c.subsurface for c in some),
        glossy=any(c.glossy for c in some),
        transmissive=any(c.transmissive for c in some),
        subsurface=any(c.subsurface for c in some),
        layered=any(c.glossy or c.transmissive for c in compiled),
        world_black=world is None or world.black,
        ao_distance=s.ao.distance or scene.world.ao_distance,
        medium=mean_medium(scene.world.graph, scene.images),
        stamps=scene.stamps(),
    )
