# SPDX-License-Identifier: GPL-3.0-or-later
"""What the camera sees: the G-buffer and its low-resolution level."""

from __future__ import annotations

import moderngl
import numpy as np

from ..facts import Facts
from ..frame import Frame
from ..graph import Optional, Pass, Planned, Texture, Uniform
from ..scene import CAMERA, CATCHER, receiver_set
from .screen import ScreenPass, _screen, no_translucency

BACKGROUND_DEPTH = 0.0  # no surface: view depths are positive


def gather_scale(facts: Facts) -> int:
    """Pixels per side of one low-resolution gather: the setting's, or fewer where the technique needs as many rows of blocks."""
    scale = facts.settings.gather_scale
    rows = getattr(facts.settings.own, "block_rows", 0)
    return max(1, min(scale, facts.resolution[1] // rows)) if rows else scale


def gather_size(facts: Facts) -> tuple[int, int]:
    """Texels of the low-resolution gather: the blocks that cover the picture wherever their grid starts."""
    scale = gather_scale(facts)
    return tuple(-(-(n + scale - 1) // scale) for n in facts.resolution)


KIND_UNIFORMS = (
    Uniform("object_set", "float", "set of objects that what is drawn is lit with, over 255"),
    Uniform("object_catcher", "float", "1 where the camera sees only the shadow on it"),
)


class GBuffer(Pass):
    title = "G-buffers Generation"
    figure = "G-buffers Generation"
    reads = (Optional("brdf.albedo"), Optional("brdf.average"), Optional("brdf.energy"))
    writes = (
        Texture("gbuffer.depth", "gbuf_depth", "view depth, world units, 0 where nothing is; how far the smooth surface "
                "stands above the triangle, -1 in a holdout, -2 on a shadow catcher", "rg32f", _screen, scratch=True),
        Texture("gbuffer.normal", "gbuf_normal", "shading normal and triangle's normal, world space, octahedral",
                "rgba16", _screen),
        Texture("gbuffer.diffuse", "gbuf_diffuse", "diffuse albedo", "rgba16f", _screen,
                when=lambda f: None if f.diffuse else "no visible material is diffuse"),
        Texture("gbuffer.specular", "gbuf_specular", "reflectance F0 of the glossy lobe; roughness", "rgba16f", _screen,
                when=lambda f: None if f.glossy else "no visible material is glossy"),
        Texture("gbuffer.lobe", "gbuf_lobe", "index of refraction or curve; F90; multiple scattering", "rgba16f",
                _screen, when=lambda f: None if f.glossy else "no visible material is glossy"),
        Texture("gbuffer.emission", "gbuf_emission", "emitted radiance, W/(m²·sr)", "rgba32f", _screen,
                when=lambda f: None if f.emissive else "no visible material emits"),
        Texture("gbuffer.subsurface", "gbuf_subsurface", "mean free path in m; share of the diffuse albedo that scatters "
                "below the surface", "rgba16f", _screen,
                when=lambda f: None if f.subsurface else "no visible material scatters below its surface"),
        Texture("gbuffer.entry", "gbuf_entry", "roughness and index of refraction of the way into what scatters below; "
                "luminance of its own albedo", "rgba16f", _screen,
                when=lambda f: None if f.subsurface else "no visible material scatters below its surface"),
        Texture("gbuffer.set", "gbuf_set", "which set of objects the surface is lit with", "r8", _screen,
                when=lambda f: None if f.rig.linked else "every light lights everything"),
        Texture("gbuffer.z", "gbuf_z", "depth buffer", "depth24", _screen, scratch=True),
    )  # fmt: skip
    uniforms = KIND_UNIFORMS

    def defines(self, facts: Facts) -> dict[str, int]:
        return {"LAYER": 1}

    def absent(self, facts: Facts) -> str | None:
        return None if facts.visible else "the camera has no surface to see"

    def run(self, frame: Frame, planned: Planned) -> None:
        draw_for_camera(frame, planned, "passes/gbuffer_frag.glsl")


class TranslucentLayer(Pass):
    """The nearest refracting surface of each pixel.

    The opaque G-buffer sees through refracting surfaces: in a sub-frame where a surface's refracting share is chosen, it
    holds what lies behind, and this layer what lies in front.
    """

    title = "Transparency G-buffers Generation"
    figure = "G-buffers + Transparency G-buffers Generation"
    reads = ("gbuffer.depth", Optional("brdf.albedo"), Optional("brdf.average"), Optional("brdf.energy"))
    uniforms = KIND_UNIFORMS
    writes = (
        Texture("translucent.set", "translucent_set", "as gbuffer.set", "r8", _screen,
                when=lambda f: None if f.rig.linked else "every light lights everything"),
        Texture("translucent.depth", "translucent_depth", "view depth, world units; 0 where nothing refracts in front of "
                "the opaque surface", "r32f", _screen),
        Texture("translucent.normal", "translucent_normal", "shading normal and triangle's normal, as gbuffer.normal",
                "rgba16", _screen),
        Texture("translucent.color", "translucent_color", "tint of what passes this surface; roughness", "rgba16f", _screen),
        Texture("translucent.medium", "translucent_medium", "index of refraction as seen from the camera's side; 1 where "
                "the light is scattered on to the far side instead (translucent)", "rg16f", _screen),
        Texture("translucent.z", "translucent_z", "depth buffer", "depth24", _screen, scratch=True),
    )  # fmt: skip

    def absent(self, facts: Facts) -> str | None:
        return _nothing_refracts(facts)

    def run(self, frame: Frame, planned: Planned) -> None:
        _draw_translucent(frame, planned)


class TranslucentBack(Pass):
    """The farthest refracting surface of each pixel before the opaque one."""

    title = "Transparency Back Generation"
    reads = TranslucentLayer.reads
    writes = (
        Texture("translucent.back_depth", "translucent_back_depth", "its view depth, world units; 0 where there is none",
                "r32f", _screen),
        Texture("translucent.back_normal", "translucent_back_normal", "its normals, as gbuffer.normal", "rgba16", _screen),
        Texture("translucent.back_z", "translucent_back_z", "depth buffer", "depth24", _screen, scratch=True),
    )  # fmt: skip

    def absent(self, facts: Facts) -> str | None:
        return _nothing_refracts(facts)

    def run(self, frame: Frame, planned: Planned) -> None:
        _draw_translucent(frame, planned, far=0.0)


class TranslucentTint(Pass):
    """The tint of all refracting surfaces down to the opaque one: each multiplies what is behind it."""

    title = "Transparency Tint"
    reads = TranslucentLayer.reads
    writes = (
        Texture("gbuffer.transmission", "gbuf_transmission", "tint of all refracting surfaces in front of the opaque one; alpha "
                "0 where there are any", "rgba16f", _screen),
    )  # fmt: skip

    def defines(self, facts: Facts) -> dict[str, int]:
        return {f"HAS_{w.glsl.upper()}": 0 for w in TranslucentLayer.writes}

    def absent(self, facts: Facts) -> str | None:
        return _nothing_refracts(facts)

    def run(self, frame: Frame, planned: Planned) -> None:
        frame.gl.ctx.blend_func = moderngl.ZERO, moderngl.SRC_COLOR
        _draw_translucent(frame, planned, clear=1.0, mode=moderngl.BLEND)
        frame.gl.ctx.blend_func = moderngl.DEFAULT_BLENDING


class CameraTint(Pass):
    """The tint of all coloured transparent surfaces down to the opaque one."""

    title = "Camera Tint"
    reads = ("gbuffer.depth",)
    writes = (
        Texture("gbuffer.tint", "gbuf_tint", "share of what is behind that coloured transparent surfaces leave, by channel",
                "rgba16f", _screen),
    )  # fmt: skip

    def absent(self, facts: Facts) -> str | None:
        return None if facts.tinted else "nothing see-through has a colour"

    def run(self, frame: Frame, planned: Planned) -> None:
        frame.gl.ctx.blend_func = moderngl.ZERO, moderngl.SRC_COLOR
        draw_for_camera(frame, planned, "passes/camera_tint_frag.glsl", "tinted", clear=1.0, mode=moderngl.BLEND)
        frame.gl.ctx.blend_func = moderngl.DEFAULT_BLENDING


def _nothing_refracts(facts: Facts) -> str | None:
    return no_translucency(facts) or (None if facts.transmissive else "no visible material refracts")


def _draw_translucent(frame: Frame, planned: Planned, **options) -> None:
    draw_for_camera(
        frame, planned, "passes/translucent_frag.glsl", "transmissive", **options,
        defines={
            "TINT_ONLY": int(planned.has("gbuffer.transmission")),
            **{f"HAS_{w.glsl.upper()}": int(planned.has(w.name)) for w in (*TranslucentLayer.writes, *TranslucentBack.writes)},
        },
    )  # fmt: skip


def draw_for_camera(
    frame: Frame, planned: Planned, fragment: str, only: str = "", *, clear: float = 0.0, mode: int = moderngl.DEPTH_TEST,
    far: float = 1.0, defines: dict[str, int] | None = None,
) -> None:  # fmt: skip
    """Draw what the camera sees into the pass's targets: all of it, or what is ``only`` "transmissive" or "subsurface".

    ``clear`` is the targets' value where nothing is, ``far`` the depth buffer's; 0 asks for the farthest surfaces.
    """
    fbo = frame.targets(planned)
    fbo.use()
    fbo.scissor = None
    fbo.viewport = (0, 0, *fbo.size)
    fbo.clear(clear, clear, clear, clear, depth=far)
    frame.gl.ctx.enable_only(mode)
    frame.gl.ctx.depth_func = ">" if far == 0.0 else "<"
    frame.bind(planned)
    stages = {"vertex": "surface/surface_vert.glsl", "fragment": fragment}
    options = {
        "full": True, "only": only, "units": len(planned.texture_reads()),
        "defines": {
            "SURFACE_TABLES": int(planned.has("brdf.albedo")), "SURFACE_SEE_THROUGH_GLASS": 1, "SURFACE_SEEN_BY_CAMERA": 1,
            "SURFACE_SEEN_BY_SHADOW": 0, **(defines or {}),
        },
    }  # fmt: skip
    clip = np.ascontiguousarray(frame.view["clip_from_world"])
    kinds: dict[tuple, list[int]] = {}
    for bits in frame.gpu.bits(CAMERA):
        kinds.setdefault((receiver_set(bits), bool(bits & CATCHER)), []).append(bits)
    programs = frame.gpu.programs(planned, stages, CAMERA, **options) if KIND_UNIFORMS[0] in planned.task.uniforms else ()
    for (lit_with, catcher), among in kinds.items():
        for program in programs:
            frame.set(program, object_set=lit_with / 255.0, object_catcher=float(catcher))
        frame.gpu.draw(planned, stages, CAMERA, clip, among=tuple(among) if len(kinds) > 1 else None, **options)
    frame.gl.ctx.depth_func = "<"


class GBufferMips(ScreenPass):
    """One representative pixel per block, for passes at low resolution.

    Averages of positions and normals across an edge belong to no surface; a pixel does. Blocks take their nearest and
    their farthest surface by turns, so that both sides of an edge have a neighbour to interpolate from.
    """

    title = "G-buffers Mipmap Generation"
    figure = "G-buffers Mipmap Generation"
    reads = ("gbuffer.depth", "gbuffer.normal")
    writes = (
        Texture("gbuffer.low_depth", "low_depth", "view depth of the block's pixel, world units", "r32f", gather_size,
                scratch=True),
        Texture("gbuffer.low_normal", "low_normal", "its normals, as in gbuffer.normal", "rgba16", gather_size,
                scratch=True),
        Texture("gbuffer.low_pixel", "low_pixel", "its place in the block, (x + ½, y + ½) / scale", "rg8", gather_size,
                scratch=True),
    )  # fmt: skip
    fragment = "passes/gbuffer_mips_frag.glsl"

    def defines(self, facts: Facts) -> dict[str, int]:
        return {"GATHER_SCALE": gather_scale(facts)}
