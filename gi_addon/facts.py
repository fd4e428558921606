# SPDX-License-Identifier: GPL-3.0-or-later
"""What the planner knows of a frame: the scene's facts, the settings, the picture's size."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .focus import Focus, find_focus
from .lights import Emitters, LightRig, build_rig
from .materials import CompiledGraph, Medium, mean_medium
from .outputs import film_layers
from .scene import CAMERA, CATCHER, Scene
from .settings import Settings
from .world_map import WorldMap

# Points of emissive meshes per sub-frame, each with a full cube of maps.
_EMITTER_SAMPLES = 2


@dataclass
class Facts:
    """Facts about one frame. Reasons that passes give for their absence come from these."""

    settings: Settings
    resolution: tuple[int, int]  # of what is drawn: the picture and its margin
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
    world_visible: bool = True  # to the camera
    catchers: bool = False  # the camera sees objects of which only the shadow on them shows
    medium: Medium | None = None  # that fills the world, or the box
    medium_box: np.ndarray | None = None  # (2, 3) world space, m; None: everywhere
    margin: int = 0  # px drawn beyond each side of the picture
    stamps: dict[str, str] = field(default_factory=dict)
    emitters: Emitters = field(default_factory=Emitters.none)  # all of them, sampled as lights or not
    focus: Focus = field(default_factory=lambda: Focus.on(np.zeros((2, 3))))
    eye: np.ndarray = field(default_factory=lambda: np.zeros(3))  # the camera's place, world space, m

    @property
    def glowing_voxels(self) -> bool:
        """Whether emissive surfaces shine out of voxels rather than as lights drawn from them."""
        return len(self.emitters) > 0 and voxels_shine(self.settings)

    @property
    def layers(self) -> tuple[str, ...]:
        """Film layers of the outputs."""
        return film_layers(self.outputs)

    @property
    def picture(self) -> tuple[int, int]:
        """Size of the picture, px."""
        return (self.resolution[0] - 2 * self.margin, self.resolution[1] - 2 * self.margin)

    @property
    def lit(self) -> bool:
        return bool(self.rig.sources) or (self.screen_sources and (self.emissive_light or not self.world_black))

    @property
    def emissive_light(self) -> bool:
        """Whether what emits also lights."""
        return self.emissive and self.settings.use_area_lights

    @property
    def screen_sources(self) -> bool:
        """Whether the world and emissive surfaces light what they do on the screen, not as lights with maps."""
        return self.settings.technique == "SSDO" and self.settings.ssdo.sources == "SCREEN"


def voxels_shine(settings: Settings) -> bool:
    """Whether the technique takes emission from voxels."""
    return settings.technique == "VCT" and settings.vct.emissive_voxels and settings.use_area_lights


def gather_facts(
    scene: Scene,
    compiled: list[CompiledGraph],
    settings: Settings,
    resolution: tuple[int, int],
    outputs: tuple[str, ...],
    subframes: int,
    world: WorldMap | None,
    emitters: Emitters,
    focus: Focus | None = None,
    eye: np.ndarray | None = None,
) -> Facts:
    """Look at everything once. ``resolution`` is the picture's; ``focus`` is found where it is not given, ``eye`` is then the
    scene's own camera's."""
    margin = round(settings.ssdo.margin * max(resolution)) if settings.technique == "SSDO" else 0
    focus = focus or find_focus(scene)
    if eye is None:
        eye = np.zeros(3) if scene.camera is None else np.asarray(scene.camera.world_from_view, "f8")[:3, 3]
    s = settings
    seen = scene.instances.visibility & CAMERA if len(scene.instances) else np.zeros(0, "u4")
    used = {m for i, ms in enumerate(scene.instances.materials) if seen[i] for m in ms}
    some = [compiled[m] for m in used]
    # Whatever looks at lit surfaces looks at the lights' bounce maps.
    bounced = s.use_indirect_diffuse or (s.use_glossy and any(c.glossy for c in some))
    bounced = bounced or (s.use_translucency and any(c.transmissive or c.subsurface for c in some))
    from_screen = s.technique == "SSDO" and s.ssdo.sources == "SCREEN"
    rig = build_rig(
        scene.lights, focus,
        world=None if from_screen else world, world_samples=s.world.samples,
        emitters=Emitters.none() if from_screen or voxels_shine(s) else emitters, emitter_samples=_EMITTER_SAMPLES,
        area_lights=s.use_area_lights,
        shadows=s.use_shadows and not (s.technique == "SSDO" and s.ssdo.shadows == "SCREEN"),
        bounces=s.bounces > 0 and bounced and s.technique != "SSDO",
        shadow_resolution=s.shadows.resolution, bounce_resolution=s.rsm.resolution,
        world_resolution=s.world.resolution,
    )  # fmt: skip
    medium, medium_box = mean_medium(scene.world.graph, scene.images), None
    domains = _domains(scene)
    if medium is None and domains:
        medium, medium_box = domains[0]
    ignored = len(domains) - (medium_box is not None)
    if ignored:
        rig.notes.append(f"{ignored} of {len(domains)} volume objects are left out: one medium can fill the scene")
    return Facts(
        settings=s,
        resolution=(resolution[0] + 2 * margin, resolution[1] + 2 * margin),
        margin=margin,
        outputs=outputs,
        subframes=subframes,
        rig=rig,
        radius=float(np.linalg.norm(focus.region[1] - focus.region[0]) / 2.0) or 1.0,
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
        world_visible=scene.world.visible_camera,
        catchers=bool((scene.instances.visibility[seen > 0] & CATCHER).any()),
        medium=medium,
        medium_box=medium_box,
        stamps=scene.stamps(),
        emitters=emitters,
        focus=focus,
        eye=eye,
    )


def _domains(scene: Scene) -> list[tuple[Medium, np.ndarray]]:
    """(medium, box in world space) of the objects that are a volume and nothing else, the largest first. A domain counts as
    the box around it, which a cube along the axes is."""
    found = []
    inst = scene.instances
    media = [mean_medium(m.graph, scene.images) if m.graph.surface is None else None for m in scene.materials]
    for i in range(len(inst)):
        medium = next((media[m] for m in inst.materials[i] if media[m] is not None), None)
        if medium is None or scene.meshes[inst.mesh[i]].empty or not np.isfinite(inst.matrix[i]).all():
            continue
        low, high = scene.meshes[inst.mesh[i]].bounds
        corners = np.array([[(low, high)[k >> axis & 1][axis] for axis in range(3)] for k in range(8)])
        corners = corners @ inst.matrix[i, :3, :3].T + inst.matrix[i, :3, 3]
        found.append((medium, np.stack([corners.min(axis=0), corners.max(axis=0)])))
    return sorted(found, key=lambda d: -float(np.prod(d[1][1] - d[1][0])))
