# SPDX-License-Identifier: GPL-3.0-or-later
"""Every setting, declared once. Blender's panels, the command line, the bench and the docs are generated from here.

A setting says what it is, its range and unit, and what more and less of it do. A test changes each one and looks for a
change in the picture or in the plan: there are no dead knobs.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

_META = "quartet"


class SettingError(ValueError):
    """An unknown setting or a value it can't take; the message says which and why."""


@dataclass(frozen=True)
class Meta:
    """What a setting is: shown name, help, range, unit, and what moving it does."""

    label: str
    help: str
    low: float | None = None
    high: float | None = None
    soft_high: float | None = None
    unit: str = ""
    higher: str = ""
    lower: str = ""
    choices: tuple[tuple[str, str, str], ...] = ()

    @property
    def text(self) -> str:
        """Help with what higher and lower do, one sentence each."""
        parts = [self.help.rstrip(".") + "."]
        if self.higher:
            parts.append(f"Higher: {self.higher}.")
        if self.lower:
            parts.append(f"Lower: {self.lower}.")
        return " ".join(parts)


def _setting(default: Any, label: str, help: str, **meta: Any) -> Any:
    return field(default=default, metadata={_META: Meta(label, help, **meta)})


def _group(cls: type) -> Any:
    return field(default_factory=cls)


TECHNIQUES = (
    ("RSM", "Reflective Shadow Maps", "One bounce gathered from virtual point lights on what the lights see"),
    ("LPV", "Light Propagation Volumes", "Bounces carried through a grid of cells over the scene"),
    ("VCT", "Voxel Cone Tracing", "Bounces gathered by cones through a grid of lit cells"),
    ("SSDO", "Screen-Space Directional Occlusion", "Bounces gathered from what the camera sees"),
)


@dataclass
class ShadowSettings:
    """Shadow maps, which every technique's direct light reads."""

    resolution: int = _setting(
        1024, "Resolution", "Texels along one side of a light's shadow map (a point light has six)",
        low=64, high=8192, unit="px", higher="finer shadow edges", lower="faster, blockier",
    )  # fmt: skip
    softness: float = _setting(
        1.0, "Filter", "Radius of the shadow filter", low=0.0, high=8.0, unit="texels",
        higher="smoother edges, less contact", lower="crisper, stair steps at few sub-frames",
    )  # fmt: skip


@dataclass
class AOSettings:
    """Ambient occlusion (Mittring 2007, in the paper's form)."""

    samples: int = _setting(
        4, "Directions", "Directions tested around each pixel and sub-frame", low=1, high=256,
        higher="less noise", lower="faster",
    )  # fmt: skip
    steps: int = _setting(
        12, "Steps", "Depth-buffer tests along each direction; 1 is the paper's single point per direction",
        low=1, high=32, higher="finds thin occluders", lower="faster",
    )  # fmt: skip
    distance: float = _setting(
        0.0, "Distance", "How far an occluder counts in the Ambient Occlusion pass; 0 takes the world's distance, as "
        "Cycles does", low=0.0, high=1e6, soft_high=100.0, unit="m", higher="darker, wider", lower="only contacts",
    )  # fmt: skip
    contact: float = _setting(
        0.05, "Contact", "How far an occluder dims indirect light that is not tested for visibility, as a share of the "
        "scene's radius", low=0.0, high=1.0, higher="wider dark corners", lower="only touching surfaces",
    )  # fmt: skip


@dataclass
class WorldSettings:
    """Light from the world, taken as a few distant suns per sub-frame."""

    samples: int = _setting(
        4, "Directions", "Directions of the world's light per sub-frame, each with its own shadow map",
        low=1, high=64, higher="smoother sky light", lower="faster",
    )  # fmt: skip
    resolution: int = _setting(
        512, "Resolution", "Texels along one side of those shadow maps", low=64, high=4096, unit="px",
        higher="finer openings", lower="faster, leaks through small walls",
    )  # fmt: skip
    aimed: bool = _setting(
        True, "Aim at Openings", "Draw the directions of direct light mostly from the parts of the sky that visible "
        "surfaces see, from four sub-frames on",
    )  # fmt: skip
    rays: int = _setting(
        32, "Rays", "Further directions per sub-frame whose shadows the grid of cells tells, to smooth diffuse light between "
        "those with maps; their mean adds no light. 0 is without", low=0, high=1024,
        higher="smoother sky light through openings", lower="faster",
    )  # fmt: skip


@dataclass
class VolumeSettings:
    """Light scattered in the air."""

    samples: int = _setting(
        8, "Samples", "Points of a pixel's ray that are tested for each light, per sub-frame", low=1, high=256,
        higher="less noise in shafts of light", lower="faster",
    )  # fmt: skip
    density: float = _setting(
        0.0, "Haze", "Share of light scattered per metre by a haze that fills the scene's bounds, where the world has no "
        "volume of its own", low=0.0, high=1e3, soft_high=1.0, unit="1/m", higher="thicker", lower="0 is clear air",
    )  # fmt: skip
    anisotropy: float = _setting(
        0.0, "Haze Anisotropy", "Mean cosine of the angle that the haze scatters by", low=-0.99, high=0.99,
        higher="glows around lights", lower="negative: scatters back",
    )  # fmt: skip


@dataclass
class RSMSettings:
    """Reflective shadow maps (Dachsbacher and Stamminger 2005)."""

    resolution: int = _setting(
        512, "Resolution", "Texels along one side of a light's reflective shadow map", low=16, high=4096, unit="px",
        higher="finer bounce sources", lower="faster",
    )  # fmt: skip
    samples: int = _setting(
        200, "Samples", "Virtual point lights gathered per pixel and sub-frame", low=1, high=4096,
        higher="less blotchy near surfaces", lower="faster",
    )  # fmt: skip
    own_samples: bool = _setting(
        False, "Samples of Each Light", "Every light has as many virtual lights of its own, whatever else shines, and all are "
        "tested: lights then add up exactly",
        higher="each light as fine as if it shone alone", lower="faster where many lights shine: they share the samples by flux",
    )  # fmt: skip
    visibility: str = _setting(
        "CELLS", "Visibility", "Whether virtual lights are blocked by objects",
        choices=(("NONE", "None", "They shine through everything, as in 2005; near contacts are dimmed by ambient occlusion"),
                 ("CELLS", "Cells", "Rays to them are tested in a grid of the cells that surfaces pass through")),
    )  # fmt: skip
    visibility_rays: int = _setting(
        128, "Visibility Rays", "Rays per pixel, of all sub-frames together, to virtual lights drawn by what they send; 0 tests "
        "all of them",
        low=0, high=4096, higher="less noise in half shadow", lower="faster, except 0",
    )  # fmt: skip
    visibility_resolution: int = _setting(
        128, "Visibility Resolution", "Cells along the scene's longest side", low=16, high=512,
        higher="finer shadows in indirect light", lower="faster",
    )  # fmt: skip


@dataclass
class LPVSettings:
    """Light propagation volumes (Kaplanyan and Dachsbacher 2010)."""

    resolution: int = _setting(
        32, "Resolution", "Cells along the longest side of the scene", low=8, high=128, unit="cells",
        higher="finer indirect light, less leaking through walls", lower="faster",
    )  # fmt: skip
    cascades: str = _setting(
        "AUTO", "Cascades", "Grids within each other around the camera, each of cells half as wide as the one around it",
        choices=(("AUTO", "Automatic", "As many as bring a cell down to a quarter of the way from surface to surface"),
                 ("1", "1", "One grid over the scene"), ("2", "2", "Cells half as wide around the camera"),
                 ("3", "3", "A quarter"), ("4", "4", "An eighth")),
    )  # fmt: skip
    iterations: int = _setting(
        0, "Iterations", "How many cells far light is carried, in one grid; 0 is as far as it comes, at the cost of one "
        "iteration", low=0, high=512, higher="reaches farther", lower="dark far from lit surfaces; slower than 0 all the same",
    )  # fmt: skip
    directions: str = _setting(
        "AUTO", "Directions", "Directions that light travels in through the grid; too few for a fine grid show as rays",
        choices=(("AUTO", "Automatic", "72 up to 32 cells, 144 up to 64, 288 for more"),
                 ("48", "48", "Fastest"), ("72", "72", "For 32 cells"), ("144", "144", "For 64 cells"),
                 ("288", "288", "For 128 cells")),
    )  # fmt: skip
    occlusion: bool = _setting(True, "Occlusion", "Objects stop light on its way through the grid")


@dataclass
class SSDOSettings:
    """Screen-space directional occlusion (Ritschel, Grosch and Seidel 2009)."""

    samples: int = _setting(
        512, "Samples", "Points tested in the depth buffer per gathering pixel, sub-frame and bounce", low=8, high=4096,
        higher="less noise", lower="faster",
    )  # fmt: skip
    steps: int = _setting(
        32, "Steps", "How many of the samples lie on one side of a slice of the hemisphere", low=2, high=256,
        higher="finds thin and far things; fewer slices", lower="more slices; misses small things",
    )  # fmt: skip
    radius: float = _setting(
        0.0, "Radius", "How far away light is gathered from; 0 is everywhere on the screen", low=0.0, high=1e6,
        soft_high=100.0, unit="m", higher="light from farther away", lower="finer near by, dark rooms",
    )  # fmt: skip
    thickness: float = _setting(
        0.25, "Thickness", "How thick what the screen shows is taken to be where no layer behind tells, as a share of its "
        "distance from the receiver",
        low=0.01, high=10.0, higher="fewer leaks behind things", lower="light passes behind thin things",
    )  # fmt: skip
    layers: int = _setting(
        2, "Layers", "How many surfaces behind each other are known at each pixel: those behind the first are not seen, but they "
        "send light, and say how thick things are", low=1, high=3, higher="light from hidden surfaces", lower="faster",
    )  # fmt: skip
    occlusion: str = _setting(
        "MITTRING", "Ambient Occlusion", "How the Ambient Occlusion pass is made",
        choices=(("BITMASK", "Visibility Bitmask", "Sectors of slices that samples fill"),
                 ("MITTRING", "Mittring", "Points along directions, as the other techniques and the paper do")),
    )  # fmt: skip
    shadows: str = _setting(
        "MAPS", "Shadows", "Where shadows come from",
        choices=(("MAPS", "Shadow Maps", "What every light sees"),
                 ("CONTACT", "Maps and Contacts", "Shadow maps, and short rays through the depth buffer over them"),
                 ("SCREEN", "Screen", "Rays through the depth buffer alone: what is not in the picture throws no shadow")),
    )  # fmt: skip
    contact: float = _setting(
        0.02, "Contact", "Length of the rays for contact shadows, as a share of the scene's radius", low=0.0, high=2.0,
        higher="longer fine shadows", lower="only where things touch",
    )  # fmt: skip
    volumetric: str = _setting(
        "MARCH", "Volumetric", "How light in the air is shadowed",
        choices=(("MARCH", "Shadow Maps", "Points on each pixel's ray are looked up in the lights' maps"),
                 ("RADIAL", "Radial Blur", "The share of the screen between a pixel and the light that does not hide it; the "
                  "light must be in the picture")),
    )  # fmt: skip
    margin: float = _setting(
        0.25, "Margin", "How much is drawn beyond each side of the picture, as a share of its longer side: what lies there "
        "still counts", low=0.0, high=1.0, higher="light from just outside", lower="faster",
    )  # fmt: skip
    sources: str = _setting(
        "MAPS", "World and Emitters", "How the world and emissive surfaces light the scene",
        choices=(("MAPS", "Shadow Maps", "As lights with shadow maps, on and off the screen"),
                 ("SCREEN", "Screen", "Directional occlusion: directions that meet nothing on the screen see the world, the "
                  "others the emissive pixels")),
    )  # fmt: skip


@dataclass
class VCTSettings:
    """Voxel cone tracing (Crassin et al. 2011)."""

    # Blocks share where their cones end, the better the nearer they are to one another: fewer rows of blocks than this up the
    # picture are more error for no less time (docs/techniques/vct.md), since all the more pixels lie beside edges and gather for
    # themselves.
    block_rows: ClassVar[int] = 72

    resolution: int = _setting(
        64, "Resolution", "Cells along the longest side of the voxel grid", low=16, high=512,
        higher="thinner walls hold, finer bounce light", lower="faster, less memory",
    )  # fmt: skip
    cones: int = _setting(
        12, "Cones", "Cones traced from each point into its hemisphere and sub-frame", low=1, high=64,
        higher="finer directions, sharper contact", lower="faster, blurrier",
    )  # fmt: skip
    shadow_cones: bool = _setting(
        False, "Shadow Cones", "Direct light's shadows by cones through the voxels in place of shadow maps: soft at one "
        "sub-frame, as fine as the grid",
    )  # fmt: skip
    emissive_voxels: bool = _setting(
        False, "Emissive Voxels", "Emissive surfaces shine out of the voxels, into the indirect passes: any number of them "
        "without noise, as fine as the grid; else lights are drawn from them, into the direct passes",
    )  # fmt: skip
    continuous_voxelization: bool = _setting(
        False, "Continuous Voxelization", "Voxelize in every sub-frame, as the paper's Table 2 has it; else only when a "
        "mesh, a transform or a material has changed. Light is always injected anew when it changes",
    )  # fmt: skip


@dataclass
class Settings:
    """All of ``scene.quartet``."""

    technique: str = _setting("RSM", "Technique", "How light bounces", choices=TECHNIQUES)
    use_indirect_diffuse: bool = _setting(True, "Indirect Diffuse", "Light that bounced off surfaces onto surfaces")
    use_glossy: bool = _setting(True, "Glossy Reflections", "What glossy surfaces mirror")
    share_reflections: bool = _setting(
        True, "Share Reflections", "Pixels of one surface share what their reflected rays found; rough reflections need it"
    )
    use_shadows: bool = _setting(True, "Shadows", "Lights are blocked by objects")
    use_ao: bool = _setting(True, "Ambient Occlusion", "Near surfaces block light that nothing else tests")
    use_translucency: bool = _setting(True, "Translucency", "Light through and inside objects")
    use_volumetric: bool = _setting(True, "Volumetric Light", "Light scattered in the air")
    use_area_lights: bool = _setting(True, "Area Lights", "Area lights and emissive surfaces give light")
    samples: int = _setting(
        16, "Samples", "Jittered sub-frames averaged in a final image", low=1, high=65536, soft_high=256,
        higher="smoother edges, shadows and lens blur", lower="faster",
    )  # fmt: skip
    viewport_samples: int = _setting(
        16, "Viewport Samples", "Sub-frames averaged in the viewport while nothing changes", low=1, high=65536,
        soft_high=256, higher="smoother after a while", lower="settles sooner",
    )  # fmt: skip
    motion_steps: int = _setting(
        8, "Motion Steps", "Times at which the scene is read while the shutter is open, with motion blur switched on; the "
        "sub-frames are shared among them", low=1, high=256, higher="smoother streaks, longer sync", lower="faster; 1 is sharp",
    )  # fmt: skip
    bounces: int = _setting(
        1, "Bounces", "Diffuse bounces of light, as far as the technique can; 1 is the paper's", low=0, high=16,
        higher="brighter interiors", lower="0 is direct light only",
    )  # fmt: skip
    gather_scale: int = _setting(
        4, "Gather Scale", "Pixels per side of one low-resolution gather; the rest is interpolated where surfaces agree. With "
        "voxel cones no more than a 72nd of the picture's height",
        low=1, high=16, unit="px", higher="faster", lower="less blur; 1 gathers at every pixel",
    )  # fmt: skip
    pixel_filter: str = _setting(
        "BOX", "Pixel Filter", "How sub-frames weigh in a pixel",
        choices=(("BOX", "Box", "Every point of the pixel alike"),
                 ("BLACKMAN_HARRIS", "Blackman-Harris", "Cycles' default: soft, without ringing")),
    )  # fmt: skip
    filter_width: float = _setting(
        1.0, "Filter Width", "Width of the pixel filter", low=0.01, high=10.0, unit="px",
        higher="softer image", lower="sharper image",
    )  # fmt: skip
    shadows: ShadowSettings = _group(ShadowSettings)
    ao: AOSettings = _group(AOSettings)
    world: WorldSettings = _group(WorldSettings)
    volume: VolumeSettings = _group(VolumeSettings)
    rsm: RSMSettings = _group(RSMSettings)
    lpv: LPVSettings = _group(LPVSettings)
    vct: VCTSettings = _group(VCTSettings)
    ssdo: SSDOSettings = _group(SSDOSettings)

    # -- access by dotted name ---------------------------------------------------------------------------------

    @property
    def own(self) -> Any:
        """The technique's own group; None where it has none."""
        return getattr(self, self.technique.lower(), None)

    def get(self, path: str) -> Any:
        """Value at a dotted ``path`` such as ``rsm.samples``. Raises SettingError for an unknown one."""
        owner, name = self._owner(path)
        return getattr(owner, name)

    def set(self, path: str, value: Any) -> None:
        """Set ``path`` from a value or its text; checks type, range and choices. Raises SettingError."""
        owner, name = self._owner(path)
        setattr(owner, name, convert(path, value, getattr(type(owner)(), name), meta_of(type(owner), name)))

    def _owner(self, path: str) -> tuple[Any, str]:
        owner: Any = self
        *groups, name = path.split(".")
        for group in groups:
            if not dataclasses.is_dataclass(getattr(owner, group, None)):
                raise SettingError(_unknown(path))
            owner = getattr(owner, group)
        known = {f.name: f for f in dataclasses.fields(owner)}
        if name not in known or _META not in known[name].metadata:
            raise SettingError(_unknown(path))
        return owner, name

    def as_dict(self) -> dict[str, Any]:
        """All values by dotted name."""
        return {path: self.get(path) for path, _, _ in walk()}

    def copy(self) -> Settings:
        """An independent copy."""
        other = Settings()
        for path, value in self.as_dict().items():
            other.set(path, value)
        return other


def meta_of(cls: type, name: str) -> Meta:
    """The Meta of field ``name`` of a settings class."""
    return next(f.metadata[_META] for f in dataclasses.fields(cls) if f.name == name)


def walk(cls: type = Settings, prefix: str = "") -> Iterator[tuple[str, Any, Meta]]:
    """(dotted name, default, Meta) of every setting, in declaration order."""
    instance = cls()
    for f in dataclasses.fields(cls):
        value = getattr(instance, f.name)
        if _META in f.metadata:
            yield prefix + f.name, value, f.metadata[_META]
        else:
            yield from walk(type(value), f"{prefix}{f.name}.")


def convert(path: str, value: Any, default: Any, meta: Meta) -> Any:
    """``value`` (typed or text) as the type of ``default``, checked. Raises SettingError."""
    try:
        if isinstance(default, bool):
            if isinstance(value, str):
                value = {"true": True, "on": True, "1": True, "yes": True}.get(
                    value.lower(), False if value.lower() in ("false", "off", "0", "no") else None
                )
            if not isinstance(value, (bool, int)) or value is None:
                raise ValueError
            return bool(value)
        if isinstance(default, int):
            number = int(value)
            if isinstance(value, float) and number != value:
                raise ValueError
            value = number
        elif isinstance(default, float):
            value = float(value)
            if value != value:
                raise ValueError
            # Blender's numbers have 32 bits: its nearest to 0.99 is a little more, and meant to be 0.99.
            ends = (end for end in (meta.low, meta.high) if end is not None and np.float32(end) == np.float32(value))
            value = next(ends, value)
        else:
            value = str(value).upper() if meta.choices else str(value)
    except (TypeError, ValueError):
        raise SettingError(f"{path}: {value!r} is not a{_kind(default)}") from None
    if meta.choices and value not in [c[0] for c in meta.choices]:
        raise SettingError(f"{path}: {value!r} is none of {', '.join(c[0] for c in meta.choices)}")
    if (meta.low is not None and value < meta.low) or (meta.high is not None and value > meta.high):
        raise SettingError(f"{path}: {value} is outside {meta.low} … {meta.high}")
    return value


def _kind(default: Any) -> str:
    if isinstance(default, bool):
        return "n on/off value"
    if isinstance(default, int):
        return " whole number"
    return " number" if isinstance(default, float) else " name"


def _unknown(path: str) -> str:
    import difflib

    near = difflib.get_close_matches(path, [p for p, _, _ in walk()], n=1)
    return f"there is no setting {path!r}" + (f"; did you mean {near[0]!r}?" if near else "")


def markdown() -> str:
    """The settings reference of the docs."""
    rows = ["| setting | default | range | what it does |", "| --- | --- | --- | --- |"]
    for path, default, meta in walk():
        if meta.choices:
            span = ", ".join(f"`{c[0]}`" for c in meta.choices)
        elif isinstance(default, bool):
            span = "on, off"
        else:
            span = f"{meta.low} … {meta.high} {meta.unit}".strip()
        rows.append(f"| `{path}` | `{default}` | {span} | {meta.text} |")
    return "\n".join(rows) + "\n"
