# SPDX-License-Identifier: GPL-3.0-or-later
"""What the planner knows of a frame: the scene's facts, the settings, the picture's size."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from .emitters import Emitters
from .focus import Focus, find_focus
from .lights import LightRig, build_rig
from .materials import CompiledGraph, Medium, mean_medium
from .outputs import film_layers
from .scene import CAMERA, CATCHER, Mesh, Scene
from .settings import Settings
from .world_map import WorldMap

# Volume objects that count; every ray is cut with each.
_MOST_DOMAINS = 8
# Points of emissive meshes per sub-frame, each with a full cube of maps.
_EMITTER_SAMPLES = 2
# What Facts.once has found, the oldest first: of so many scenes at a time.
_MOST_FOUND = 16
_FOUND: dict[tuple, object] = {}
T = TypeVar("T")


@dataclass(frozen=True)
class Domain:
    """What a homogeneous ``medium`` fills: everywhere, or what ``unit_from_world`` (4, 4) takes into the cube from −1 to 1 or,
    for a ``ball``, into the unit ball."""

    medium: Medium
    unit_from_world: np.ndarray | None = None
    ball: bool = False


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
    tinted: bool  # some of what is see-through has a colour
    diffuse: bool
    glossy: bool
    transmissive: bool
    subsurface: bool
    bodies: bool  # anything that light scatters below the surface of, seen by the camera or not
    layered: bool
    world_black: bool
    ao_distance: float
    world_visible: bool = True  # to the camera
    catchers: bool = False  # the camera sees objects of which only the shadow on them shows
    media: tuple[Domain, ...] = ()  # of the world and of objects that are volumes
    margin: int = 0  # px drawn beyond each side of the picture
    stamps: dict[str, str] = field(default_factory=dict)
    emitters: Emitters = field(default_factory=Emitters.none)  # all of them, sampled as lights or not
    focus: Focus = field(default_factory=lambda: Focus.on(np.zeros((2, 3))))
    eye: np.ndarray = field(default_factory=lambda: np.zeros(3))  # the camera's place, world space, m
    scene: Scene | None = field(default=None, repr=False)

    def once(self, kind: str, place: tuple, find: Callable[[Scene], T]) -> T:
        """What ``find`` knows of the scene's surfaces at ``place``: found once as long as they stay."""
        key = (kind, place, self.stamps["meshes"], self.stamps["transforms"])
        if key not in _FOUND:
            while len(_FOUND) >= _MOST_FOUND:
                _FOUND.pop(next(iter(_FOUND)), None)
            _FOUND[key] = find(self.scene)
        return _FOUND[key]

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
    tinted = any(compiled[m].tinted for m in {m for ms in scene.instances.materials for m in ms})
    from_screen = s.technique == "SSDO" and s.ssdo.sources == "SCREEN"
    rig = build_rig(
        scene.lights, focus,
        world=None if from_screen else world, world_samples=s.world.samples,
        emitters=Emitters.none() if from_screen or voxels_shine(s) else emitters, emitter_samples=_EMITTER_SAMPLES,
        area_lights=s.use_area_lights,
        shadows=s.use_shadows and not (s.technique == "SSDO" and s.ssdo.shadows == "SCREEN"),
        bounces=s.bounces > 0 and bounced and s.technique != "SSDO",
        shadow_resolution=s.shadows.resolution, bounce_resolution=s.rsm.resolution,
        world_resolution=s.world.resolution, tinted=tinted,
    )  # fmt: skip
    medium, domains = mean_medium(scene.world.graph, scene.images), _domains(scene)
    if len(domains) > _MOST_DOMAINS:
        rig.notes.append(f"{len(domains) - _MOST_DOMAINS} of {len(domains)} volume objects are left out: {_MOST_DOMAINS} count, "
                         "the largest")  # fmt: skip
    media = (*([Domain(medium)] if medium is not None else []), *domains[:_MOST_DOMAINS])
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
        tinted=tinted,
        diffuse=any(c.diffuse or c.subsurface for c in some),
        glossy=any(c.glossy for c in some),
        transmissive=any(c.transmissive for c in some),
        subsurface=any(c.subsurface for c in some),
        bodies=any(compiled[m].subsurface for m in {m for ms in scene.instances.materials for m in ms}),
        layered=any(c.glossy or c.transmissive for c in compiled),
        world_black=world is None or world.black,
        ao_distance=s.ao.distance or scene.world.ao_distance,
        world_visible=scene.world.visible_camera,
        catchers=bool((scene.instances.visibility[seen > 0] & CATCHER).any()),
        media=media,
        stamps=scene.stamps(),
        emitters=emitters,
        focus=focus,
        eye=eye,
        scene=scene,
    )


def _domains(scene: Scene) -> list[Domain]:
    """Of the objects that are a volume and nothing else, the largest first. Each counts as the box or the ellipsoid in its own
    bounds, whichever is nearer to the volume of its mesh."""
    found = []
    inst = scene.instances
    media = [mean_medium(m.graph, scene.images) if m.graph.surface is None else None for m in scene.materials]
    for i in range(len(inst)):
        medium = next((media[m] for m in inst.materials[i] if media[m] is not None), None)
        mesh = scene.meshes[inst.mesh[i]]
        if medium is None or mesh.empty or not np.isfinite(inst.matrix[i]).all():
            continue
        low, high = mesh.bounds
        unit = np.diag([*((high - low) / 2.0), 1.0])
        unit[:3, 3] = (low + high) / 2.0
        world_from_unit = inst.matrix[i] @ unit
        size = abs(float(np.linalg.det(world_from_unit[:3, :3])))
        if size <= 1e-12 * float(np.abs(world_from_unit[:3, :3]).max()) ** 3:
            continue  # flat: nothing is inside
        ball = _enclosed(mesh) < 0.5 * (1.0 + np.pi / 6.0) * float(np.prod(high - low))
        found.append((size, Domain(medium, np.linalg.inv(world_from_unit), ball)))
    return [domain for _, domain in sorted(found, key=lambda f: -f[0])]


def _enclosed(mesh: Mesh) -> float:
    """Volume that a closed mesh encloses, m³ in its own space: the sum of the tetrahedra to a point."""
    a, b, c = np.moveaxis(mesh.positions[mesh.triangles].astype("f8") - mesh.bounds.mean(axis=0), 1, 0)
    return abs(float(np.einsum("ij,ij->", a, np.cross(b, c)))) / 6.0
