# SPDX-License-Identifier: GPL-3.0-or-later
"""The lights of a sub-frame and their maps: shadow maps for direct light, reflective shadow maps for bounces."""

from __future__ import annotations

import moderngl
import numpy as np

from ..facts import Facts
from ..frame import Frame
from ..gpu_types import LIGHT, LIGHT_VIEW
from ..graph import Buffer, Optional, Pass, Planned, Texture, Uniform
from ..lights import LightRig
from ..scene import DIFFUSE, SHADOW, blocker_set, receiver_set

_VERTEX = "surface/surface_vert.glsl"
_UNIFORMS = (
    Uniform("light_origin_ws", "vec3", "origin of the map's view, world space, m"),
    Uniform("light_axis_ws", "vec3", "unit vector along which its depth is measured"),
    Uniform("light_perspective", "float", "1 for a view from a point, 0 for parallel light"),
)


def _no_light(facts: Facts) -> str | None:
    return None if facts.lit else "no light shines: no lamp with power, the world is black, nothing emits"


class LightList(Pass):
    """Sends the lights to the GPU."""

    title = "Light List"
    reads = (Optional("world.guide"),)
    writes = (
        Buffer("lights", "lights", "the lights' points of this sub-frame", "Light", LIGHT,
               lambda f: max(1, len(f.rig.sources))),
        Buffer("lights.views", "light_views", "what their shadow maps show", "LightView", LIGHT_VIEW,
               lambda f: max(1, len(f.rig.shadow.sizes) + len(f.rig.bounce.sizes))),
    )  # fmt: skip

    def absent(self, facts: Facts) -> str | None:
        return _no_light(facts)

    def run(self, frame: Frame, planned: Planned) -> None:
        lights, views = planned.facts.rig.direct_sample(frame.subframe, planned.facts.subframes)
        if not planned.facts.settings.use_shadows:
            lights["views"] = 0
        frame.upload("lights", lights)
        frame.upload("lights.views", views)


class ShadowMaps(Pass):
    """Depth of the scene from each light's point."""

    title = "Shadow Maps"
    reads = (Optional("world.guide"),)
    writes = (
        Texture("shadow.depth", "shadow_depth", "depth along each map's axis, world units", "r32f",
                lambda f: f.rig.shadow.size),
        Texture("shadow.z", "shadow_z", "depth buffer", "depth24", lambda f: f.rig.shadow.size, scratch=True),
    )  # fmt: skip
    uniforms = _UNIFORMS
    depends = ("lights", "world", "transforms", "meshes", "materials")
    settings = ("shadows.resolution", "world.resolution", "world.samples")

    def rate(self, facts: Facts) -> str:
        return "subframe" if facts.subframes > 1 and facts.rig.any_moves(facts.rig.shadow, bounce=False) else "static"

    def absent(self, facts: Facts) -> str | None:
        if not facts.settings.use_shadows:
            return "shadows are switched off"
        if not facts.rig.shadow.sizes:
            return _no_light(facts) or "no light casts shadows, or the RSMs serve for them"
        return None if facts.triangles else "the scene has no surfaces"

    def run(self, frame: Frame, planned: Planned) -> None:
        draw_light_maps(frame, planned, SHADOW,
                        "passes/shadow_map_frag.glsl", full=False)


class RSMGeneration(Pass):
    """What each light sees and how much of its light it reflects."""

    title = "RSM Generation"
    figure = "RSM Generation"
    reads = (Optional("brdf.albedo"), Optional("brdf.average"), Optional("brdf.energy"))
    writes = (
        Texture("rsm.depth", "rsm_depth", "depth along each map's axis, world units", "r32f",
                lambda f: f.rig.bounce.size),
        Texture("rsm.normal", "rsm_normal", "shading normal and triangle's normal, world space, octahedral", "rgba16",
                lambda f: f.rig.bounce.size),
        Texture("rsm.albedo", "rsm_albedo", "share of the arriving light that is reflected; alpha 1 where there is a "
                "surface", "rgba16f", lambda f: f.rig.bounce.size),
        Texture("rsm.z", "rsm_z", "depth buffer", "depth24", lambda f: f.rig.bounce.size, scratch=True),
        Buffer("rsm.lights", "rsm_lights", "the lights the maps were made from", "Light", LIGHT,
               lambda f: max(1, len(f.rig.sources))),
        Buffer("rsm.views", "rsm_views", "what the maps show", "LightView", LIGHT_VIEW,
               lambda f: max(1, len(f.rig.bounce.sizes))),
    )  # fmt: skip
    uniforms = (
        *_UNIFORMS, Uniform("light_reaches", "float", "1 where the light shines on what is drawn, 0 where it is only blocked"),
    )  # fmt: skip
    depends = ("lights", "world", "transforms", "meshes", "materials")
    settings = ("rsm.resolution", "world.resolution", "world.samples")

    def rate(self, facts: Facts) -> str:
        return "subframe" if facts.subframes > 1 and facts.rig.any_moves(facts.rig.bounce, bounce=True) else "static"

    def absent(self, facts: Facts) -> str | None:
        if not facts.rig.bounce.sizes:
            return _no_light(facts)
        return None if facts.triangles else "the scene has no surfaces"

    def run(self, frame: Frame, planned: Planned) -> None:
        sample = frame.light_sample(bounce=True)
        frame.upload("rsm.lights", sample.lights)
        frame.upload("rsm.views", sample.views)
        draw_light_maps(frame, planned, DIFFUSE, "passes/rsm_frag.glsl", full=True)


def draw_light_maps(frame: Frame, planned: Planned, visibility: int, fragment: str, *, full: bool) -> None:
    """Draw the views that are due into their tiles of the pass's targets: all of them when the pass is stale, else those
    of lights that move between sub-frames. ``full`` evaluates every material (bounce maps), else only those that let
    light through (shadow maps)."""
    rig = planned.facts.rig
    sample = frame.light_sample(bounce=full)
    moving = planned.facts.subframes > 1
    due = [
        i for i, view in enumerate(sample.views) if planned.stale or (moving and rig.moves(int(view["light"]), bounce=full))
    ]  # fmt: skip
    ctx = frame.gl.ctx
    fbo = frame.targets(planned)
    fbo.use()
    # Where a map shows nothing, a shadow map is far beyond every surface, and a bounce map has albedo (and alpha) 0.
    nothing = 0.0 if full else 1e30
    if planned.stale:
        fbo.scissor = None
        fbo.viewport = (0, 0, *fbo.size)
        fbo.clear(nothing, nothing, nothing, nothing, depth=1.0)
    ctx.enable_only(moderngl.DEPTH_TEST)
    frame.bind(planned)
    options = {
        "full": full, "units": len(planned.texture_reads()), "defines": {
            "SURFACE_TABLES": 2 if planned.has("brdf.average") else 0, "SURFACE_SEE_THROUGH_GLASS": 1,
            "SURFACE_SEEN_BY_CAMERA": 0, "SURFACE_SEEN_BY_SHADOW": int(not full),
        },
    }  # fmt: skip
    stages = {"vertex": _VERTEX, "fragment": fragment}
    programs = frame.gpu.programs(planned, stages, visibility, **options)
    for i in due:
        view = sample.views[i]
        rect = tuple(int(v) for v in view["rect"])
        if not planned.stale:
            fbo.clear(nothing, nothing, nothing, nothing, depth=1.0, viewport=rect)
        fbo.viewport = rect
        for program in programs:
            frame.set(
                program,
                light_origin_ws=tuple(view["origin_ws"]),
                light_axis_ws=tuple(view["axis_z"]),
                light_perspective=float(view["perspective"]),
            )
        clip = np.ascontiguousarray(sample.clip_from_world[i].T, "f4")
        index = int(view["light"])
        beyond = None if full else rig.beyond(i, index)
        for reaches, among in _linked(rig, index, frame.gpu.bits(visibility), full):
            for program in programs if full else ():
                frame.set(program, light_reaches=reaches)
            frame.gpu.draw(planned, stages, visibility, clip, beyond=beyond, among=among, **options)


def _linked(rig: LightRig, index: int, bits: tuple[int, ...], full: bool) -> list[tuple[float, tuple[int, ...] | None]]:
    """(whether source ``index`` lights them, visibility bits) of what its map shows: what shades it and, in a bounce map
    (``full``), what it lights."""
    lit = tuple(b for b in bits if rig.lights_kind(index, receiver_set(b)))
    dark = tuple(b for b in bits if rig.blocked_by(index, blocker_set(b)) and b not in lit)
    if not full:
        shades = tuple(b for b in bits if rig.blocked_by(index, blocker_set(b)))
        return [(1.0, None if shades == bits else shades)]
    return [(1.0, None if lit == bits else lit), *([(0.0, dark)] if dark else [])]
