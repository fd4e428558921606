# SPDX-License-Identifier: GPL-3.0-or-later
"""Screen-space directional occlusion, Figure 4d of the paper.

T. Ritschel, T. Grosch and H.-P. Seidel, "Approximating Dynamic Global Illumination in Image Space", I3D 2009. What the
camera sees is all the geometry there is: each pixel gathers the light that the other pixels reflect, over slices of its
hemisphere with a visibility bitmask. What lies outside the picture, or behind something, sends nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from ..facts import Facts
from ..frame import Frame
from ..gpu_scene import world_source
from ..gpu_types import LIGHT_SUN, LIGHT_WORLD
from ..graph import Optional, Pass, Planned, Texture, Uniform, glsl_name
from ..passes.ao import AOBlur, AOGeneration
from ..passes.brdf_tables import BRDFTables
from ..passes.direct_lighting import DirectLighting, TranslucentLighting, set_lamps
from ..passes.gbuffer import CameraTint, GBuffer, GBufferMips, TranslucentBack, TranslucentLayer, TranslucentTint
from ..passes.lights import LightList, ShadowMaps, ShadowTint
from ..passes.occupancy import Occupancy
from ..passes.reflections import GLOSSY_RAY, GLOSSY_TRACED, reflection_sharing
from ..passes.resolve import Resolve
from ..passes.screen import (
    LIGHT,
    LOBE,
    REFRACTING,
    SCATTERED,
    SUBSURFACE,
    TRANSMISSION_INDIRECT,
    ScreenPass,
    _screen,
    no_gloss,
    no_translucency,
)
from ..passes.smoothing import BlockSmoothing, raw_gather
from ..passes.volumetric import Volumetric, medium_defines
from ..passes.world_guide import WorldGuide
from ..passes.world_rays import WorldRays
from ..settings import Settings


def passes(settings: Settings, layers: tuple[str, ...]) -> list[Pass]:
    """Figure 4d, in order; each further bounce repeats the gather."""
    layers_behind = range(2, settings.ssdo.layers + 1)
    bounces = []
    for bounce in range(1, settings.bounces + 1):
        last = bounce == settings.bounces
        bounces += [
            SentLight(bounce),
            InterpolatedIndirect(f"ssdo.sent.{bounce}", f"ssdo.low.{bounce}", layers_behind, last=last),
            _smoothing(f"ssdo.sent.{bounce}", f"ssdo.low.{bounce}"),
            *_lighting(f"ssdo.sent.{bounce}", f"ssdo.low.{bounce}",
                       "indirect.diffuse" if last else f"ssdo.bounce.{bounce}", layers_behind),
        ]  # fmt: skip
    return [
        BRDFTables(),
        Occupancy(),
        WorldGuide(),
        LightList(),
        ShadowMaps(),
        ShadowTint(),
        GBuffer(),
        TranslucentTint(),
        GBufferMips(),
        ScreenPlanes(),
        AOGeneration() if settings.ssdo.occlusion == "MITTRING" else AOScan(),
        AOBlur(),
        InterpolatedIndirect("gbuffer.emission", "screen.low"),
        _smoothing("gbuffer.emission", "screen.low"),
        *_lighting("gbuffer.emission", "screen.low", "screen.light"),
        WorldRays(),
        DirectLighting() if settings.ssdo.shadows == "MAPS" or not settings.use_shadows else ScreenShadowLighting(),
        *(task for layer in layers_behind for task in _layer(layer)),
        *bounces,
        ShadedScreen(),
        NearnessPyramid(),
        Reflections(),
        *reflection_sharing(settings),
        *reflection_sharing(settings, SOURCES_TRACED, REFLECTED_SOURCES, "SHARED_SOURCES"),
        CameraTint(),
        TranslucentLayer(),
        TranslucentBack(),
        TranslucentLighting(),
        Refraction(),
        Subsurface(),
        Volumetric() if settings.ssdo.volumetric == "MARCH" else RadialBlur(),
        Resolve(layers),
    ]


def _layer(layer: int) -> list[Pass]:
    """The surfaces behind the layer before, their planes and what they send."""
    return [Layer(layer), ScreenPlanes(layer), LayerLighting(layer), SentLight(1, layer)]


# What a gather takes, and what it makes (gather_lib.glsl, lighting_frag.glsl).
_SENT = {"SENT_NOTHING": 0, "SENT_BOUNCE": 1, "SENT_EMISSION": 2}
_TARGET = {"TARGET_INDIRECT": 0, "TARGET_BOUNCE": 1, "TARGET_SCREEN_LIGHT": 2}
_LIT = {
    "TARGET_INDIRECT": Texture("indirect.diffuse", "indirect_diffuse", LIGHT, "rgba32f", _screen),
    "TARGET_BOUNCE": Texture("ssdo.bounce", "last_bounce", LIGHT, "rgba32f", _screen),  # of each bounce but the last
    "TARGET_SCREEN_LIGHT": Texture("screen.light", "screen_light", LIGHT, "rgba32f", _screen),
}


def _target(resource: str) -> str:
    """The key of _LIT that a resource's light is of."""
    return next((kind for kind, lit in _LIT.items() if lit.name == resource), "TARGET_BOUNCE")



def _no_bounce(facts: Facts) -> str | None:
    if not facts.settings.use_indirect_diffuse:
        return "indirect diffuse is switched off"
    return "no visible material is diffuse" if not facts.diffuse else None


def _no_rays(facts: Facts) -> str | None:
    """Why nothing looks behind what the camera sees, or None."""
    return _no_bounce(facts) and no_gloss(facts) and "nothing is gathered or mirrored"


class ScreenPlanes(ScreenPass):
    """The depth buffer in a form in which planes and rays are linear."""

    fragment = "engines/ssdo/planes_frag.glsl"

    def __init__(self, layer: int = 1) -> None:
        self.layer = layer
        self.title = "SSDO Planes" if layer == 1 else f"SSDO Planes {layer}"
        self.reads = tuple(_of_layer(name, layer) for name in ("gbuffer.depth", "gbuffer.normal"))
        self.writes = (
            Texture(_planes(layer), "ssdo_planes" if layer == 1 else f"ssdo_planes_{layer}", "nearness of the surface (1/view "
                    "depth; orthographic: −view depth), its slope per pixel of the surface's plane, and whether the eye is "
                    "before it: 1, or −1", "rgba32f", _screen),
        )  # fmt: skip

    def defines(self, facts: Facts) -> dict[str, int]:
        return {"LAYER": self.layer}


def _of_layer(name: str, layer: int) -> str:
    """The G-buffer's ``gbuffer.x`` and ``direct.diffuse``, of what lies behind it for layers from 2."""
    return name if layer == 1 else f"ssdo.layer{layer}.{name.removeprefix('gbuffer.')}"


def _planes(layer: int) -> str:
    return "ssdo.planes" if layer == 1 else f"ssdo.planes.{layer}"


class Layer(GBuffer):
    """What lies behind the layer before, whichever way it faces: depth peeling."""

    figure = "G-buffers + Transparency G-buffers Generation"

    def __init__(self, layer: int) -> None:
        self.layer = layer
        self.title = f"SSDO Layer {layer}"
        self.reads = (*GBuffer.reads, _planes(layer - 1))
        kept = ("depth", "normal", "diffuse", "specular", "lobe", "set", "z")
        self.writes = tuple(
            replace(w, name=_of_layer(w.name, layer)) for w in GBuffer.writes if w.name.removeprefix("gbuffer.") in kept
        )

    def defines(self, facts: Facts) -> dict[str, int]:
        left_out = {f"HAS_{w.glsl.upper()}": 0 for w in GBuffer.writes}
        return {"LAYER": self.layer, **{n: v for n, v in left_out.items() if n not in _present(self)}}

    def absent(self, facts: Facts) -> str | None:
        return super().absent(facts) or _no_rays(facts)


def _present(task: Pass) -> set[str]:
    return {f"HAS_{w.glsl.upper()}" for w in task.writes}


class LayerLighting(DirectLighting):
    """Direct light on a layer that the camera does not see."""

    kept = ("lights", Optional("lights.views"), Optional("shadow.depth"), Optional("rsm.depth"))

    def __init__(self, layer: int) -> None:
        self.title = f"SSDO Layer {layer} Direct Lighting"
        self.reads = (*self.kept, *(_of_layer(name, layer) for name in ("gbuffer.depth", "gbuffer.normal")),
                      Optional(_of_layer("gbuffer.set", layer)))  # fmt: skip
        self.writes = (replace(DirectLighting.writes[0], name=_of_layer("direct.diffuse", layer)),)

    def defines(self, facts: Facts) -> dict[str, int]:
        told = {*self.kept, Optional("gbuffer.set")}
        others = [r.name for r in DirectLighting.reads if isinstance(r, Optional) and r not in told]
        others += [w.name for w in DirectLighting.writes[1:]]
        return {**super().defines(facts), **{f"HAS_{glsl_name(name).upper()}": 0 for name in others}}


class SentLight(ScreenPass):
    """What each pixel sends on: direct light, and the bounce before this one."""

    fragment = "engines/ssdo/sent_frag.glsl"

    def __init__(self, bounce: int, layer: int = 1) -> None:
        self.title = f"SSDO Sent Light {bounce}" if layer == 1 else f"SSDO Layer {layer} Sent Light"
        self.bounce, self.layer = bounce, layer
        before = (Optional(f"ssdo.bounce.{bounce - 1}"),) if bounce > 1 else ()
        self.reads = (
            _of_layer("direct.diffuse", layer), _of_layer("gbuffer.diffuse", layer),
            Optional(_of_layer("gbuffer.specular", layer)), Optional(_of_layer("gbuffer.lobe", layer)),
            Optional("brdf.average"), Optional("brdf.energy"), *before,
        )  # fmt: skip
        name, glsl = (f"ssdo.sent.{bounce}", "ssdo_sent") if layer == 1 else [f"ssdo{c}layer{layer}{c}sent" for c in "._"]
        self.writes = (Texture(name, glsl, "radiance that leaves the surface, W/(m²·sr)", "rgba32f", _screen),)

    def defines(self, facts: Facts) -> dict[str, int]:
        return {"LAYER": self.layer, **({} if self.bounce > 1 else {"HAS_LAST_BOUNCE": 0})}

    def absent(self, facts: Facts) -> str | None:
        return _no_bounce(facts) if self.layer == 1 else _no_rays(facts)


_BOX = Uniform("ssdo_box", "vec4", "the rectangle of the screen that the scene's box covers: low x, y, high x, y, pixels")


def _screen_box(frame: Frame, facts: Facts) -> tuple[float, float, float, float]:
    """``ssdo_box`` of this sub-frame, within what is drawn; all that where the eye is in it."""
    width, height = facts.resolution
    corners = np.array([[(low, high)[k >> axis & 1] for axis, (low, high) in enumerate(zip(*facts.rig.bounds, strict=True))]
                        for k in range(8)])  # fmt: skip
    clip = np.c_[corners, np.ones(8)] @ frame.view["clip_from_world"].astype("f8")  # stored by columns
    if (clip[:, 3] <= 1e-6 * facts.radius).any():
        return (0.0, 0.0, float(width), float(height))
    at = (clip[:, :2] / clip[:, 3:] * 0.5 + 0.5) * (width, height)
    low, high = np.clip([at.min(axis=0), at.max(axis=0)], 0.0, (width, height))
    return (*low.tolist(), *high.tolist())


class _Gather(ScreenPass):
    """Light from the screen: ``sent`` is the radiance that pixels send, or their emission, which comes with the world's light."""

    uniforms = (
        Uniform("ssdo_slices", "int", "slices per pixel"),
        Uniform("ssdo_steps", "int", "depth tests along each of a slice's two sides"),
        Uniform("ssdo_radius", "float", "how far light is gathered from, world units; 0 = everywhere"),
        Uniform("ssdo_thickness", "float", "thickness of what the screen shows, as a share of its distance from the receiver"),
        _BOX,
    )
    sent = ""
    layers = 1  # of depth that light comes from
    last = False  # bounce: what it lights sends no further

    def behind(self, layers: Iterable[int]) -> tuple[str, ...]:
        """What it reads of the layers behind."""
        self.layers = max(layers, default=1)
        return tuple(name for layer in layers for name in (_planes(layer), f"ssdo.layer{layer}.sent"))

    @property
    def from_sources(self) -> bool:
        return not self.sent.startswith("ssdo.")

    def absent(self, facts: Facts) -> str | None:
        if not self.from_sources:
            return _no_bounce(facts)
        if not facts.screen_sources:
            return "the world and emissive surfaces shine through shadow maps"
        return None if facts.emissive_light or not facts.world_black else "the world is black and nothing emits"

    def defines(self, facts: Facts) -> dict[str, int]:
        emits = self.from_sources and facts.emissive_light
        return {
            **_SENT,
            "SENT": _SENT["SENT_EMISSION" if emits else "SENT_NOTHING" if self.from_sources else "SENT_BOUNCE"],
            "GATHER_WORLD": int(self.from_sources and not facts.world_black),
            "GATHER_SCALE": facts.settings.gather_scale,
            "LAYERS": self.layers,
            "MARGIN_RECEIVES": int(not self.last or _shaded_screen_wanted(facts)),
        }

    def run(self, frame: Frame, planned: Planned) -> None:
        settings = planned.facts.settings.ssdo
        with _world(frame, planned, bool(self.defines(planned.facts)["GATHER_WORLD"])) as virtual:
            program = frame.program(planned, virtual=virtual)
            frame.set(
                program,
                ssdo_slices=max(1, settings.samples // (2 * settings.steps)),
                ssdo_steps=settings.steps,
                ssdo_radius=settings.radius,
                ssdo_thickness=settings.thickness,
                ssdo_box=_screen_box(frame, planned.facts),
            )
            frame.screen(planned, program)


class InterpolatedIndirect(_Gather):
    """Light from the screen at one pixel per block. Blocks of one pixel too share their directions with their neighbours."""

    figure = "SSDO Interpolated Indirect Lighting Computation"
    fragment = "engines/ssdo/gather_low_frag.glsl"

    def __init__(self, sent: str, low: str, layers_behind: Sequence[int] = (), *, last: bool = False) -> None:
        self.sent, self.last = sent, last
        self.title = f"{_title(sent)} (low resolution)"
        self.reads = ("ssdo.planes", _read(sent), "gbuffer.low_depth", "gbuffer.low_normal", "gbuffer.low_pixel",
                      *self.behind(layers_behind))  # fmt: skip
        self.writes = raw_gather(low)


class IndirectLighting(_Gather):
    """Light from the screen for every pixel: interpolated where the low resolution has its surface, gathered where not."""

    figure = "SSDO Lighting Computation"
    fragment = "engines/ssdo/lighting_frag.glsl"

    def __init__(self, sent: str, low: str, target: str, layers_behind: Sequence[int] = ()) -> None:
        self.sent = sent
        self.title = _title(sent)
        self.reads = (
            "ssdo.planes", _read(sent), "gbuffer.depth", "gbuffer.normal", Optional("gbuffer.low_depth"),
            Optional("gbuffer.low_normal"), Optional("gbuffer.low_pixel"), Optional(low), Optional(f"{low}.direction"),
            *self.behind(layers_behind),
        )  # fmt: skip
        self.last = target == "indirect.diffuse"
        self.target = _target(target)
        rough = replace(_LIT[self.target], name=f"{target}.rough", glsl="rough_light", scratch=True,
                        doc=f"{LIGHT}; 0 where none is wanted, 1 interpolated, 2 gathered here")  # fmt: skip
        self.writes = (replace(_LIT[self.target], name=target) if self.target == "TARGET_BOUNCE" else rough,)

    def defines(self, facts: Facts) -> dict[str, int]:
        return {**super().defines(facts), **_TARGET, "TARGET": _TARGET[self.target]}


class PixelSmoothing(ScreenPass):
    """Neighbouring pixels that gathered afresh share their directions, as blocks do."""

    figure = "Gaussian Blur"
    fragment = "engines/ssdo/smooth_pixels_frag.glsl"

    def __init__(self, sent: str, target: str) -> None:
        self.title = f"{_title(sent)} (smoothing of pixels)"
        self.reads = (f"{target}.rough", "gbuffer.depth", "gbuffer.normal")
        self.target = _target(target)
        self.writes = (_LIT[self.target],)

    def defines(self, facts: Facts) -> dict[str, int]:
        return {**_TARGET, "TARGET": _TARGET[self.target]}


def _lighting(sent: str, low: str, target: str, layers_behind: Sequence[int] = ()) -> list[Pass]:
    smoothing = [PixelSmoothing(sent, target)] if _target(target) != "TARGET_BOUNCE" else []
    return [IndirectLighting(sent, low, target, layers_behind), *smoothing]


def _shaded_screen_wanted(facts: Facts) -> bool:
    """Whether something looks at the screen's own light: mirrors, glass and what scatters below its surface."""
    if no_gloss(facts) is None:
        return True
    return no_translucency(facts) is None and (facts.transmissive or facts.subsurface)


def _title(sent: str) -> str:
    return f"SSDO Bounce {sent.rsplit('.', 1)[1]}" if sent.startswith("ssdo.") else "SSDO Directional Occlusion"


def _smoothing(sent: str, low: str) -> BlockSmoothing:
    return BlockSmoothing(low, f"{_title(sent)} (smoothing)", "Gaussian Blur", in_pairs=True)


def _read(sent: str) -> str | Optional:
    return sent if sent.startswith("ssdo.") else Optional(sent)


class AOScan(ScreenPass):
    """Ambient occlusion from the visibility bitmask, in the place of Mittring's."""

    title = "SSDO AO Generation"
    figure = "SSAO Generation"
    reads = ("ssdo.planes", "gbuffer.depth", "gbuffer.normal")
    writes = (
        Texture("ao.raw", "ao_raw", "cosine-weighted share of directions free of occluders within the AO distance, twice",
                "rg16f", _screen, scratch=True),
    )  # fmt: skip
    uniforms = (
        Uniform("ao_slices", "int", "slices per pixel"),
        Uniform("ao_steps", "int", "depth tests along each of a slice's two sides"),
        Uniform("ao_distance", "float", "how far an occluder counts, m"),
        Uniform("ao_thickness", "float", "thickness of what the screen shows, as a share of its distance from the receiver"),
        _BOX,
    )
    fragment = "engines/ssdo/ao_scan_frag.glsl"

    def absent(self, facts: Facts) -> str | None:
        return None if facts.settings.use_ao else "ambient occlusion is switched off"

    def prepare(self, frame: Frame, planned: Planned, program) -> None:
        facts = planned.facts
        frame.set(
            program,
            ao_slices=max(1, facts.settings.ao.samples // 2),
            ao_steps=facts.settings.ao.steps,
            ao_distance=min(facts.ao_distance, 2.0 * facts.radius),
            ao_thickness=facts.settings.ssdo.thickness,
            ssdo_box=_screen_box(frame, facts),
        )


class ShadedScreen(ScreenPass):
    """What reflections and refractions see of each pixel."""

    title = "SSDO Shaded Screen"
    reads = (
        Optional("gbuffer.diffuse"), Optional("direct.diffuse"), Optional("indirect.diffuse"), Optional("direct.glossy"),
    )  # fmt: skip
    writes = (
        Texture("ssdo.shaded", "ssdo_shaded", "radiance that leaves the surface, without its emission, W/(m²·sr)", "rgba32f",
                _screen),
    )  # fmt: skip
    fragment = "engines/ssdo/shaded_frag.glsl"


class NearnessPyramid(Pass):
    """The nearest of 2 × 2, 4 × 4 … pixels."""

    title = "SSDO Nearness Pyramid"
    figure = "G-buffers Mipmap Generation"
    reads = ("ssdo.planes",)
    writes = (
        Texture("ssdo.pyramid", "ssdo_pyramid", "nearness of the nearest surface below the texel", "r32f", _screen,
                mips=lambda f: max(f.resolution).bit_length() - 1),
    )  # fmt: skip
    shaders = {"main": {"compute": "engines/ssdo/pyramid_comp.glsl"}}

    def run(self, frame: Frame, planned: Planned) -> None:
        pyramid = frame.resources["ssdo.pyramid"]
        width, height = planned.facts.resolution
        frame.bind(planned)
        for level in range(max(width, height).bit_length()):
            program = frame.program(planned, FIRST_LEVEL=int(level == 0))
            if level:
                pyramid.bind_to_image(0, read=True, write=False, level=level - 1)
            pyramid.bind_to_image(min(level, 1), read=False, write=True, level=level)
            program.run(-(-width // 8), -(-height // 8))
            frame.gl.ctx.memory_barrier()
            width, height = max(1, width // 2), max(1, height // 2)


SOURCES_TRACED = replace(
    GLOSSY_TRACED, name="sources.traced", glsl="traced_sources",
    when=lambda f: None if _sources_traced(f) else "the world and emissive surfaces shine through shadow maps",
)  # fmt: skip
REFLECTED_SOURCES = Texture("reflected.sources", "reflected_sources", "radiance that the glossy lobe reflects of the world and "
                            "of emissive pixels, W/(m²·sr)", "rgba32f", _screen)  # fmt: skip


# What a ray through the depth buffer is traced in, and the light that it finds (trace_lib.glsl, met_lib.glsl).
_TRACED = (
    "ssdo.planes", "ssdo.pyramid", "ssdo.shaded", Optional(_planes(2)), Optional("ssdo.layer2.sent"), "gbuffer.depth",
    "gbuffer.normal", Optional("gbuffer.diffuse"), Optional("gbuffer.set"), Optional("lights"), Optional("lights.views"),
    Optional("shadow.depth"), Optional("shadow.tint"), Optional("rsm.depth"),
)  # fmt: skip
_TRACED_UNIFORMS = (
    Uniform("ssdo_thickness", "float", "thickness of what the screen shows, as a share of its distance from the receiver"),
    *DirectLighting.uniforms,
)


def _traced_defines(facts: Facts) -> dict[str, int]:
    """Lamps are looked up where a ray ends if shadow maps tell all about them there."""
    settings = facts.settings
    mapped = settings.ssdo.shadows == "MAPS" or not settings.use_shadows
    return {**medium_defines(facts), "LAMPS_AT_HITS": int(mapped and facts.lit and facts.diffuse)}


def _set_traced(frame: Frame, planned: Planned, program) -> None:
    set_lamps(frame, planned, program)
    frame.set(program, ssdo_thickness=planned.facts.settings.ssdo.thickness)


class Reflections(Pass):
    """Glossy reflections of the screen."""

    title = "SSDO Reflections"
    reads = (
        *_TRACED, *LOBE, Optional("gbuffer.emission", ("sources.traced",)),
    )  # fmt: skip
    writes = (
        GLOSSY_TRACED, SOURCES_TRACED, GLOSSY_RAY,
    )  # fmt: skip
    uniforms = _TRACED_UNIFORMS
    shaders = {"main": {"compute": "engines/ssdo/reflections_comp.glsl"}}

    def absent(self, facts: Facts) -> str | None:
        return no_gloss(facts)

    def defines(self, facts: Facts) -> dict[str, int]:
        return {
            **_traced_defines(facts),
            "TRACE_WORLD": int(facts.screen_sources and not facts.world_black),
            "TRACE_EMISSION": int(facts.screen_sources and facts.emissive_light),
        }

    def run(self, frame: Frame, planned: Planned) -> None:
        world = bool(self.defines(planned.facts)["TRACE_WORLD"])
        with _world(frame, planned, world) as virtual:
            program = frame.program(planned, virtual=virtual)
            _set_traced(frame, planned, program)
            frame.compute(planned, program, planned.facts.resolution)


def _sources_traced(facts: Facts) -> bool:
    return facts.screen_sources and (facts.emissive_light or not facts.world_black)


@contextmanager
def _world(frame: Frame, planned: Planned, wanted: bool) -> Iterator[dict[str, str]]:
    """The world's shader for a program, and its images bound after the pass's own textures."""
    units = len(planned.texture_reads())
    if not wanted:
        yield {"generated/world.glsl": "// no world\n"}
        return
    frame.gpu.bind_world_params()
    frame.gpu.bind_images(frame.gpu.world, units)
    yield {"generated/world.glsl": world_source(frame.gpu.world, units, camera=False)}
    frame.gpu.unbind_images(units, len(frame.gpu.world.images))


class ScreenShadowLighting(DirectLighting):
    """Direct light with shadows by screen-space rays: short ones over the shadow maps, or whole ones in their place."""

    reads = (*DirectLighting.reads, "ssdo.planes")
    uniforms = (
        *DirectLighting.uniforms,
        Uniform("ssdo_shadow_reach", "float", "length of the rays, world units"),
        Uniform("ssdo_shadow_steps", "int", "depth tests along each"),
        Uniform("ssdo_thickness", "float", "thickness of what the screen shows, as a share of its distance from the receiver"),
    )

    def defines(self, facts: Facts) -> dict[str, int]:
        return {**super().defines(facts), "HAS_SSDO_PLANES": 1}

    def prepare(self, frame: Frame, planned: Planned, program) -> None:
        facts = planned.facts
        settings = facts.settings.ssdo
        frame.set(
            program,
            ssdo_shadow_reach=(settings.contact if settings.shadows == "CONTACT" else 2.0) * facts.radius,
            ssdo_shadow_steps=settings.steps,
            ssdo_thickness=settings.thickness,
        )
        super().prepare(frame, planned, program)


class Refraction(Pass):
    """What is seen through refracting surfaces: a refracted ray per pixel, traced through the opaque G-buffer."""

    title = "SSDO Refraction"
    figure = "Lighting Computation"
    reads = (
        *_TRACED, *REFRACTING, Optional("gbuffer.emission"),
    )  # fmt: skip
    writes = (TRANSMISSION_INDIRECT,)
    uniforms = _TRACED_UNIFORMS
    shaders = {"main": {"compute": "engines/ssdo/refraction_comp.glsl"}}

    def defines(self, facts: Facts) -> dict[str, int]:
        return _traced_defines(facts)

    def run(self, frame: Frame, planned: Planned) -> None:
        program = frame.program(planned)
        _set_traced(frame, planned, program)
        frame.compute(planned, program, planned.facts.resolution)


class Subsurface(ScreenPass):
    """Light that entered the surface near by."""

    title = "SSDO Subsurface Scattering"
    reads = (
        "gbuffer.subsurface", "gbuffer.depth", "gbuffer.normal", "gbuffer.diffuse",
        *SCATTERED,
    )  # fmt: skip
    writes = SUBSURFACE
    fragment = "engines/ssdo/subsurface_frag.glsl"

    def absent(self, facts: Facts) -> str | None:
        return no_translucency(facts)


class RadialBlur(Volumetric):
    """The paper's cheap volumetric light: lights are visible from a pixel's air as far as the way to them on the screen is."""

    title = "SSDO Volumetric Light by Radial Blur"
    reads = (Optional("lights", ("volume.light",)), Optional("gbuffer.depth"))

    def defines(self, facts: Facts) -> dict[str, int]:
        # Without the camera's surfaces there is nothing in the way.
        maps = {"VOXEL_VISIBILITY": 0, "HAS_LIGHT_VIEWS": 0, "HAS_SHADOW_DEPTH": 0, "HAS_RSM_DEPTH": 0}
        return {**super().defines(facts), "RADIAL_BLUR": int(facts.visible), **maps}

    def prepare(self, frame: Frame, planned: Planned, program) -> None:
        if frame.subframe == 0:
            notes = planned.facts.rig.notes
            notes += [n for n in self.unseen(frame, planned.facts) if n not in notes]
        super().prepare(frame, planned, program)

    @staticmethod
    def unseen(frame: Frame, facts: Facts) -> list[str]:
        """A message for each lamp that is not in the picture, and so scatters no light here."""
        out = []
        clip_from_world = frame.view["clip_from_world"].T.astype("f8")
        for light in frame.light_sample(bounce=False).lights:
            parallel = light["kind"] in (LIGHT_SUN, LIGHT_WORLD)
            x, y, _, w = clip_from_world @ np.append(-light["axis_ws"] if parallel else light["position_ws"], not parallel)
            if w <= 0.0 or max(abs(x), abs(y)) > w:
                out.append("a light is outside the picture: radial blur shows no beams of it; ssdo.volumetric MARCH does")
        return out[:1]
