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

    def run(self, frame: Frame, planned: Planned) -> bool:
        return draw_light_maps(frame, planned, SHADOW, "passes/shadow_map_frag.glsl", full=False)


class ShadowTint(Pass):
    """The colour of what coloured see-through surfaces let through to each map's first solid one."""

    title = "Shadow Tint"
    reads = ("shadow.depth",)
    writes = (
        Texture("shadow.tint", "shadow_tint", "share of the light that they leave, by channel, over that of the brightest; "
                "alpha: depth of the nearest of them", "rgba16f", lambda f: f.rig.shadow.size),
    )  # fmt: skip
    uniforms = _UNIFORMS
    depends = ShadowMaps.depends
    settings = ShadowMaps.settings
    repeats = True

    def rate(self, facts: Facts) -> str:
        return ShadowMaps().rate(facts)

    def absent(self, facts: Facts) -> str | None:
        return ShadowMaps().absent(facts) or (None if facts.tinted else "nothing see-through has a colour")

    def run(self, frame: Frame, planned: Planned) -> None:
        rig = planned.facts.rig
        fbo = frame.targets(planned)
        fbo.use()
        fbo.scissor = None
        fbo.viewport = (0, 0, *fbo.size)
        fbo.clear(1.0, 1.0, 1.0, 65504.0)
        ctx = frame.gl.ctx
        ctx.enable_only(moderngl.BLEND)
        # Colours are multiplied, of depths the least is kept.
        ctx.blend_func = moderngl.ZERO, moderngl.SRC_COLOR, moderngl.ONE, moderngl.ONE
        ctx.blend_equation = moderngl.FUNC_ADD, moderngl.MIN
        frame.bind(planned)
        sample = frame.light_sample(bounce=False)
        for view, clip in zip(sample.views, sample.clip_from_world, strict=True):
            if rig.casts_shadow(int(view["light"])):
                fbo.viewport = tuple(int(v) for v in view["rect"])
                _draw_tints(frame, planned, SHADOW, view, np.ascontiguousarray(clip.T, "f4"))
        ctx.blend_equation = moderngl.FUNC_ADD
        ctx.blend_func = moderngl.DEFAULT_BLENDING


def _draw_tints(frame: Frame, planned: Planned, visibility: int, view, clip_from_world: np.ndarray) -> None:
    """Draw what tints the light of ``view`` into its tile of the bound targets."""
    options = {
        "full": True, "only": "tinted", "units": len(planned.texture_reads()), "defines": {
            "SURFACE_TABLES": 0, "SURFACE_SEE_THROUGH_GLASS": 2, "SURFACE_SEEN_BY_CAMERA": 0, "SURFACE_SEEN_BY_SHADOW": 1,
            "HAS_SHADOW_DEPTH": int(planned.has("shadow.depth")), "HAS_SHADOW_TINT": int(planned.has("shadow.tint")),
        },
    }  # fmt: skip
    stages = {"vertex": _VERTEX, "fragment": "passes/light_tint_frag.glsl"}
    for program in frame.gpu.programs(planned, stages, visibility, **options):
        _set_view(frame, program, view)
    frame.gpu.draw(planned, stages, visibility, clip_from_world, **options)


def _set_view(frame: Frame, program, view) -> None:
    frame.set(
        program,
        light_origin_ws=tuple(view["origin_ws"]),
        light_axis_ws=tuple(view["axis_z"]),
        light_perspective=float(view["perspective"]),
    )


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

    def run(self, frame: Frame, planned: Planned) -> bool:
        sample = frame.light_sample(bounce=True)
        lights = (sample.lights.tobytes(), sample.views.tobytes())
        same = planned.memory.get("lights") == lights and not planned.stale
        if not same:
            frame.upload("rsm.lights", sample.lights)
            frame.upload("rsm.views", sample.views)
            planned.memory["lights"] = lights
        return draw_light_maps(frame, planned, DIFFUSE, "passes/rsm_frag.glsl", full=True) or not same


def draw_light_maps(frame: Frame, planned: Planned, visibility: int, fragment: str, *, full: bool) -> bool:
    """Draw the views that are due into their tiles of the pass's targets: all of them when surfaces have changed, else those
    that look from elsewhere than the last time, which a light's power or the camera does not make them. False if none was.
    ``full`` evaluates every material (bounce maps), else only those that let light through (shadow maps)."""
    facts = planned.facts
    maps = facts.rig.bounce if full else facts.rig.shadow
    sample = frame.light_sample(bounce=full)
    clips = [np.ascontiguousarray(clip.T, "f4") for clip in sample.clip_from_world]
    boxes = [None if full else facts.rig.beyond(i, int(view["light"])) for i, view in enumerate(sample.views)]
    bits = frame.gpu.bits(visibility)
    links = [_linked(facts.rig, int(view["light"]), bits, full) for view in sample.views]
    looks = [
        (view.tobytes(), clip.tobytes(), None if box is None else box.tobytes(), link)
        for view, clip, box, link in zip(sample.views, clips, boxes, links, strict=True)
    ]
    geometry = (facts.stamps[kind] for kind in ("transforms", "meshes", "materials"))
    surfaces = (frame.targets(planned), tuple(maps.sizes), tuple(maps.corners), *geometry)
    memory = planned.memory
    clear = memory.pop("surfaces", None) != surfaces
    old = [] if clear else memory["looks"]
    due = [i for i, look in enumerate(looks) if i >= len(old) or old[i] != look]
    if due or clear:
        tiles = [(sample.views[i], clips[i], boxes[i], links[i]) for i in due]
        _draw_tiles(frame, planned, visibility, fragment, full=full, clear=clear, tiles=tiles)
    memory["surfaces"], memory["looks"] = surfaces, looks
    return bool(due) or clear


def _draw_tiles(frame: Frame, planned: Planned, visibility: int, fragment: str, *, full: bool, clear: bool, tiles: list) -> None:
    """Draw ``tiles`` (view, clip from world, box left out, what of the scene) of a light map; ``clear`` wipes it before."""
    ctx = frame.gl.ctx
    fbo = frame.targets(planned)
    fbo.use()
    # Where a map shows nothing, a shadow map is far beyond every surface, and a bounce map has albedo (and alpha) 0.
    nothing = 0.0 if full else 1e30
    if clear:
        fbo.scissor = None
        fbo.viewport = (0, 0, *fbo.size)
        fbo.clear(nothing, nothing, nothing, nothing, depth=1.0)
    ctx.enable_only(moderngl.DEPTH_TEST)
    frame.bind(planned)
    options = {
        "full": full, "units": len(planned.texture_reads()), "defines": {
            "SURFACE_TABLES": 2 if planned.has("brdf.average") else 0, "SURFACE_SEE_THROUGH_GLASS": 1 + int(planned.facts.tinted),
            "SURFACE_SEEN_BY_CAMERA": 0, "SURFACE_SEEN_BY_SHADOW": int(not full),
        },
    }  # fmt: skip
    stages = {"vertex": _VERTEX, "fragment": fragment}
    programs = frame.gpu.programs(planned, stages, visibility, **options)
    for view, clip_from_world, beyond, linked in tiles:
        rect = tuple(int(v) for v in view["rect"])
        if not clear:
            fbo.clear(nothing, nothing, nothing, nothing, depth=1.0, viewport=rect)
        fbo.viewport = rect
        for program in programs:
            _set_view(frame, program, view)
        for reaches, among in linked:
            for program in programs if full else ():
                frame.set(program, light_reaches=reaches)
            frame.gpu.draw(planned, stages, visibility, clip_from_world, beyond=beyond, among=among, **options)
    if planned.has("rsm.albedo") and planned.facts.tinted:
        # What reflects here was lit through them.
        albedo = [w.name for w in planned.texture_writes() if w.format != "depth24"].index("rsm.albedo")
        fbo.color_mask = tuple((k == albedo,) * 4 for k in range(len(fbo.color_attachments)))
        fbo.depth_mask = False
        ctx.enable_only(moderngl.DEPTH_TEST | moderngl.BLEND)
        ctx.blend_func = moderngl.ZERO, moderngl.SRC_COLOR
        for view, clip_from_world, _, _ in tiles:
            fbo.viewport = tuple(int(v) for v in view["rect"])
            _draw_tints(frame, planned, visibility, view, clip_from_world)
        ctx.blend_func = moderngl.DEFAULT_BLENDING
        fbo.depth_mask = True
        fbo.color_mask = ((True,) * 4,) * len(fbo.color_attachments)


def _linked(rig: LightRig, index: int, bits: tuple[int, ...], full: bool) -> list[tuple[float, tuple[int, ...] | None]]:
    """(whether source ``index`` lights them, visibility bits) of what its map shows: what shades it and, in a bounce map
    (``full``), what it lights."""
    lit = tuple(b for b in bits if rig.lights_kind(index, receiver_set(b)))
    dark = tuple(b for b in bits if rig.blocked_by(index, blocker_set(b)) and b not in lit)
    if not full:
        shades = tuple(b for b in bits if rig.blocked_by(index, blocker_set(b)))
        return [(1.0, None if shades == bits else shades)]
    return [(1.0, None if lit == bits else lit), *([(0.0, dark)] if dark else [])]
