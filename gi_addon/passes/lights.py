# SPDX-License-Identifier: GPL-3.0-or-later
"""The lights of a sub-frame and their maps: shadow maps for direct light, reflective shadow maps for bounces."""

from __future__ import annotations

import moderngl
import numpy as np

from ..facts import Facts
from ..frame import Frame
from ..gpu_types import LIGHT, LIGHT_VIEW
from ..graph import Buffer, Optional, Pass, Planned, Texture, Uniform
from ..lights import Sample
from ..scene import DIFFUSE, SHADOW

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
    writes = (
        Buffer("lights", "lights", "the lights' points of this sub-frame", "Light", LIGHT,
               lambda f: max(1, len(f.rig.sources))),
        Buffer("lights.views", "light_views", "what their shadow maps show", "LightView", LIGHT_VIEW,
               lambda f: max(1, len(f.rig.shadow.sizes))),
    )  # fmt: skip
    depends = ("lights", "world", "transforms", "meshes")

    def absent(self, facts: Facts) -> str | None:
        return _no_light(facts)

    def run(self, frame: Frame, planned: Planned) -> None:
        sample = frame.light_sample(bounce=False)
        lights = sample.lights.copy()
        if not planned.facts.settings.use_shadows:
            lights["views"] = 0
        frame.upload("lights", lights)
        frame.upload("lights.views", sample.views)


class ShadowMaps(Pass):
    """Depth of the scene from each light's point."""

    title = "Shadow Maps"
    writes = (
        Texture("shadow.depth", "shadow_depth", "depth along each map's axis, world units", "r32f",
                lambda f: f.rig.shadow.size),
        Texture("shadow.z", "shadow_z", "depth buffer", "depth24", lambda f: f.rig.shadow.size, scratch=True),
    )  # fmt: skip
    uniforms = _UNIFORMS
    depends = ("lights", "world", "transforms", "meshes", "materials")
    settings = ("shadows.resolution", "world.resolution", "world.samples")

    def rate(self, facts: Facts) -> str:
        return "subframe" if facts.rig.soft and facts.subframes > 1 else "static"

    def absent(self, facts: Facts) -> str | None:
        if not facts.settings.use_shadows:
            return "shadows are switched off"
        if not facts.rig.shadow.sizes:
            return _no_light(facts) or "no light casts shadows"
        return None if facts.triangles else "the scene has no surfaces"

    def run(self, frame: Frame, planned: Planned) -> None:
        draw_light_maps(frame, planned, frame.light_sample(bounce=False), SHADOW,
                        "passes/shadow_map_frag.glsl", full=False)


class RSMGeneration(Pass):
    """What each light sees and how much of its light it reflects."""

    title = "RSM Generation"
    figure = "RSM Generation"
    reads = (Optional("brdf.albedo"), Optional("brdf.average"))
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
    uniforms = _UNIFORMS
    depends = ("lights", "world", "transforms", "meshes", "materials")
    settings = ("rsm.resolution", "world.resolution", "world.samples")

    def rate(self, facts: Facts) -> str:
        return "subframe" if facts.rig.bounce_soft and facts.subframes > 1 else "static"

    def absent(self, facts: Facts) -> str | None:
        if not facts.rig.bounce.sizes:
            return _no_light(facts)
        return None if facts.triangles else "the scene has no surfaces"

    def run(self, frame: Frame, planned: Planned) -> None:
        sample = frame.light_sample(bounce=True)
        frame.upload("rsm.lights", sample.lights)
        frame.upload("rsm.views", sample.views)
        draw_light_maps(frame, planned, sample, DIFFUSE, "passes/rsm_frag.glsl", full=True)


def draw_light_maps(
    frame: Frame, planned: Planned, sample: Sample, visibility: int, fragment: str, *, full: bool
) -> None:
    """Draw every view of ``sample`` into its tile of the pass's targets; ``full`` evaluates every material, else only
    those that let light through."""
    ctx = frame.gl.ctx
    fbo = frame.targets(planned)
    fbo.use()
    fbo.scissor = None
    fbo.viewport = (0, 0, *fbo.size)
    # Where a map shows nothing, a shadow map is far beyond every surface, and a bounce map has albedo (and alpha) 0.
    nothing = 0.0 if full else 1e30
    fbo.clear(nothing, nothing, nothing, nothing, depth=1.0)
    ctx.enable_only(moderngl.DEPTH_TEST)
    frame.bind(planned)
    frame.gpu.bind_params()
    units = len(planned.texture_reads())
    options = dict(
        full=full, units=units, defines={
            "SURFACE_TABLES": 2 if planned.has("brdf.average") else 0, "SURFACE_SEE_THROUGH_GLASS": 1, "SURFACE_SEEN_BY_CAMERA": 0,
            "SURFACE_SEEN_BY_SHADOW": int(not full),
        },
    )  # fmt: skip
    stages = {"vertex": _VERTEX, "fragment": fragment}
    programs = frame.gpu.programs(planned, stages, visibility, **options)
    for view, clip in zip(sample.views, sample.clip_from_world, strict=True):
        fbo.viewport = tuple(int(v) for v in view["rect"])
        for program in programs:
            frame.set(
                program,
                light_origin_ws=tuple(view["origin_ws"]),
                light_axis_ws=tuple(view["axis_z"]),
                light_perspective=float(view["perspective"]),
            )
        frame.gpu.draw(planned, stages, visibility, np.ascontiguousarray(clip.T, "f4"), **options)
