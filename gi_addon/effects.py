# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's seven effects, and where each technique takes its data from: the passes themselves say so."""

from __future__ import annotations

from dataclasses import dataclass

from .engines import TECHNIQUES
from .graph import Pass
from .outputs import OUTPUTS, film_layers
from .settings import Settings


@dataclass(frozen=True)
class Source:
    """Where an effect comes from: ``kind`` is ``own`` (the technique's own pass), ``shared`` (a pass that all techniques
    share) or ``none``; ``text`` names the pass or says why there is none."""

    kind: str
    text: str
    detail: str = ""  # what its light is made of, where the pass's name does not say


# Setting -> (graph resource that carries the effect, what is missing where only that one is there), the best first.
RESOURCES: dict[str, tuple[tuple[str, str], ...]] = {
    "use_indirect_diffuse": (("indirect.diffuse", ""),),
    "use_glossy": (("glossy.traced", ""), ("direct.glossy", "highlights of lights only")),
    "use_shadows": (("shadow.depth", ""),),
    "use_ao": (("ao", ""),),
    "use_translucency": (("transmission.indirect", ""), ("gbuffer.transmission", "what lies straight behind only")),
    "use_volumetric": (("volume.light", ""),),
    "use_area_lights": (("lights", ""),),
}


# What must be for a setting, or all of a group, to change the picture: settings that are on, or have that value.
NEEDS: dict[str, tuple[str, ...]] = {
    "gather_scale": ("use_indirect_diffuse",),
    "share_reflections": ("use_glossy",),
    "shadows": ("use_shadows",),
    "ao": ("use_ao",),
    "world.aimed": ("use_shadows",),
    "world.rays": ("use_shadows",),
    "volume": ("use_volumetric",),
    "volume.anisotropy": ("volume.density",),
    "vct.shadow_cones": ("use_shadows",),
    "vct.emissive_voxels": ("use_area_lights",),
    "ssdo.occlusion": ("use_ao",),
    "ssdo.shadows": ("use_shadows",),
    "ssdo.contact": ("use_shadows", "ssdo.shadows=CONTACT"),
    "ssdo.volumetric": ("use_volumetric",),
}


def needs_of(path: str) -> tuple[str, ...]:
    """What must be for the setting ``path`` to have an effect, as in NEEDS."""
    return (*NEEDS.get(path.rpartition(".")[0], ()), *NEEDS.get(path, ()))


def in_effect(path: str, settings: Settings) -> bool:
    """Whether the setting ``path`` changes anything beside the others in ``settings``."""
    for need in needs_of(path):
        name, _, value = need.partition("=")
        found = settings.get(name)
        if found != value if value else not found:
            return False
    return True


def source_of(technique: str, effect: str) -> Source:
    """Where ``technique`` takes an effect (a key of RESOURCES) from."""
    passes = TECHNIQUES[technique](Settings(), film_layers(OUTPUTS))
    for resource, caveat in RESOURCES[effect]:
        for task in passes:
            if any(write.name == resource for write in task.writes):
                text = f"{task.title} ({caveat})" if caveat else task.title
                return Source("own" if _is_own(task) else "shared", text, task.source)
    return Source("none", f"no pass of this technique makes it ({RESOURCES[effect][0][0]})")


def _is_own(task: Pass) -> bool:
    return ".engines." in type(task).__module__
