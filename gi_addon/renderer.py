# SPDX-License-Identifier: GPL-3.0-or-later
"""The frame loop: a Scene in, passes as arrays out.

A Renderer lives on the GL thread and keeps what the next frame can use again: programs, the scene on the GPU, textures,
shadow maps whose lights and objects did not move. :func:`render` is the door for everyone else.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from .emitters import Emitters
from .engines import TECHNIQUES
from .facts import Facts, gather_facts
from .focus import Focus, find_focus
from .frame import Frame, ResourcePool
from .gl import GL, Cancelled, CancelToken, GLThread, shared
from .gl.timers import PassTimers
from .gpu_scene import GPUScene, world_source
from .gpu_types import GENERATED, VIEW
from .graph import Plan, plan
from .materials import CompiledGraph, compile_surface, compile_world, mean_emission
from .outputs import OUTPUTS, develop
from .passes.surface_points import surface_points
from .scene import Camera, Scene
from .settings import Settings
from .world_map import WorldMap

# For debugging: ask OpenGL for errors after every pass, not only at the frame's end.
_CHECK_EACH_PASS = bool(os.environ.get("QUARTET_CHECK_GL"))
# The world's map to draw directions from; 256 × 128 resolves a sun of 1.4°, smaller ones are spread over that.
_WORLD_MAP = (256, 128)
# Points of the scene's surfaces that emissive triangles are drawn to serve.
_RECEIVERS = 128


class RenderError(RuntimeError):
    """A frame can't be rendered; the message says why and what to do."""


@dataclass
class Result:
    """Passes of one frame: name -> (height, width, channels) f4, row 0 at the bottom. ``plan`` is what ran,
    ``milliseconds`` per pass if timers were on, ``notes`` messages to the user."""

    passes: dict[str, np.ndarray]
    plan: Plan
    subframes: int
    seconds: float
    milliseconds: dict[str, list[float]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


Progress = Callable[[float, str], None]


class Renderer:
    """Renders frames of scenes. Make, use and close it on the GL thread only."""

    def __init__(self, gl: GL) -> None:
        self.gl = gl
        self.gpu = GPUScene(gl)
        self.pool = ResourcePool(gl)
        self.timers = PassTimers(gl)
        self._view_buffer = gl.buffer("view", size=VIEW.itemsize)
        self._screen_vaos: dict[int, object] = {}
        self._static: dict[str, tuple] = {}
        self._planned_key: tuple | None = None
        self._plan: Plan | None = None
        self._world_maps: tuple[tuple, WorldMap | None] | None = None
        self._focus: tuple[tuple, Focus] | None = None
        self._emitter_cache: tuple[tuple, Emitters] | None = None
        self.frame: Frame | None = None

    # -- one frame -----------------------------------------------------------------------------------------------

    def begin(
        self,
        scene: Scene,
        settings: Settings,
        outputs: Iterable[str] = ("Combined",),
        *,
        resolution: tuple[int, int],
        region: tuple[int, int, int, int] | None = None,
        subframes: int | None = None,
        camera: Camera | None = None,
        film_transparent: bool = False,
        moving: bool = False,
    ) -> Plan:
        """Sync the scene and plan a frame. While the view is ``moving`` what only suits the sampling to it stays as it is.

        ``resolution`` (width, height) of the whole picture; ``region`` (x, y, width, height) the part to render, row 0
        at the bottom. Raises RenderError when there is nothing to render with.
        """
        camera = camera or scene.camera
        outputs = tuple(outputs)
        unknown = [name for name in outputs if name not in OUTPUTS]
        if unknown:
            raise RenderError(f"no such pass: {', '.join(unknown)}; there are {', '.join(OUTPUTS)}")
        if settings.technique not in TECHNIQUES:
            raise RenderError(f"technique {settings.technique} is none of {', '.join(TECHNIQUES)}")
        if camera is None:
            raise RenderError("the scene has no camera: add one, or make one active (Ctrl+Numpad 0)")
        if not np.isfinite(camera.world_from_view).all() or not np.isfinite(camera.clip_from_view).all():
            raise RenderError(f"camera {camera.name}: its transform or lens is not a number")
        if abs(np.linalg.det(camera.world_from_view[:3, :3])) < 1e-30:
            raise RenderError(f"camera {camera.name}: its scale is zero, it has no view")
        region = region or (0, 0, *resolution)
        if min(resolution) < 1 or min(region[2:]) < 1:
            raise RenderError(f"a picture of {region[2]} × {region[3]} pixels has nothing to render")

        # What is drawn lies near the origin: 32-bit coordinates are too coarse far from it.
        origin = scene.far_origin()
        if origin.any():
            scene, camera = scene.moved(-origin), camera.moved(-origin)
        # The view that is drawn counts, which need not be the scene's camera.
        stamps = replace(scene, camera=camera).stamps()
        if moving and self.frame is not None:
            stamps["camera"] = self.frame.facts.stamps["camera"]
        self.gpu.sync(scene, stamps)
        size = (int(region[2]), int(region[3]))
        subframes = subframes or settings.samples
        facts = gather_facts(
            scene, self.gpu.compiled, settings, size, outputs, subframes, self._world_map(scene),
            self._emitters(scene, stamps), self._find_focus(scene, stamps),
            np.asarray(camera.world_from_view, "f8")[:3, 3],
        )
        facts.stamps = stamps
        key = (
            tuple(settings.as_dict().items()), size, outputs, subframes,
            {k: v for k, v in stamps.items() if k != "camera"}.__repr__(),
        )  # fmt: skip
        if key != self._planned_key or self._plan is None:
            tasks = TECHNIQUES[settings.technique](settings, facts.layers)
            old = {p.title: p for p in self._plan.run} if self._plan else {}
            self._plan = plan(tasks, facts, {"film": ", ".join(outputs)})
            for planned in self._plan.run:
                self._inherit(planned, old.get(planned.title))
            self._planned_key = key
        before = dict(self.frame.resources) if self.frame else {}
        resources = self.pool.prepare(self._plan.resources, facts)
        fresh = self.pool.fresh(before)
        self._static = {
            title: entry for title, entry in self._static.items() if not fresh & set(entry[1])
        }
        self.frame = Frame(
            self.gl, self.pool, self.gpu, settings, facts, resources, self.timers, camera, region, resolution,
            self._view_buffer, self._screen_vao,
        )  # fmt: skip
        self.frame.film_transparent = film_transparent
        self.frame.world_origin = origin
        return self._plan

    @staticmethod
    def _inherit(planned, old) -> None:
        """Keep the programs of the same pass in the previous plan where its declarations are the same."""
        if old is None or old.defines() != planned.defines():
            return
        if [r.name for r in old.reads] == [r.name for r in planned.reads] and [w.name for w in old.writes] == [
            w.name for w in planned.writes
        ]:
            planned.programs, planned.memory = dict(old.programs), old.memory

    def subframe(self, index: int, cancel: CancelToken | None = None) -> None:
        """Render sub-frame ``index`` into the film. Static passes run if what they depend on has changed.

        Raises Cancelled between two passes if ``cancel`` is set; the film then needs :meth:`begin` and sub-frame 0.
        """
        frame = self.frame
        frame.begin_subframe(index)
        rerun: set[str] = set()
        written: set[str] = set()
        for position, planned in enumerate(self._plan.run):
            if cancel is not None and cancel.cancelled:
                # What would have read the maps made so far has not: it must run next time, whatever its key says.
                for missed in self._plan.run[position:]:
                    self._static.pop(missed.title, None)
                raise Cancelled
            task, facts = planned.task, frame.facts
            planned.facts = facts
            key = (
                tuple(facts.stamps[kind] for kind in task.depends),
                tuple(frame.settings.get(path) for path in task.settings),
                tuple(w.name for w in planned.writes),
                facts.rig.shadow.size, facts.rig.bounce.size, task.place(facts),
            )  # fmt: skip
            last = self._static.get(task.title)
            planned.stale = last is None or last[0] != key or bool(rerun & {r.name for r in planned.reads})
            static = task.rate(facts) == "static"
            number = (index, facts.subframes)
            same = task.repeats and not planned.stale and last[2] == number and not written & {r.name for r in planned.reads}
            if (static and not planned.stale) or same:
                continue
            names = {w.name for w in planned.writes}
            self._static[task.title] = (key, tuple(names), number)
            if static:
                rerun |= names
            with self.timers.measure(task.title):
                if task.run(frame, planned) is not False:
                    written |= names
            if _CHECK_EACH_PASS:
                self.gl.check(task.title)

    def film(self) -> dict[str, np.ndarray]:
        """The film's layers so far, averaged: name -> (H, W, 4) f4."""
        texture = self.frame.resources["film"]
        width, height = self.frame.facts.picture
        layers = self.frame.facts.layers
        data = np.frombuffer(texture.read(), np.float32).reshape(len(layers), height, width, 4)
        count = self.frame.subframe + 1
        return {
            name: data[i] if name == "depth" else data[i] / np.float32(count) for i, name in enumerate(layers)
        }

    def render(
        self,
        scene: Scene,
        settings: Settings,
        outputs: Iterable[str] = ("Combined",),
        *,
        progress: Progress | None = None,
        cancel: CancelToken | None = None,
        timed: bool = False,
        motion: Sequence[Scene] = (),
        **options,
    ) -> Result:
        """A whole frame. ``options`` as in :meth:`begin`; raises Cancelled if ``cancel`` is set on the way.

        ``motion`` are the scene's states while the shutter is open, evenly spread: each takes its share of the
        sub-frames, one block after the other, so that what moved is sent to the GPU once per state.
        """
        start = time.perf_counter()
        outputs = tuple(outputs)
        self.timers.enabled = timed
        self.timers.reset()
        states = list(motion) or [scene]
        planned = self.begin(states[0], settings, outputs, **options)
        subframes = self.frame.facts.subframes
        shown = 0
        for index in range(subframes):
            if cancel is not None:
                cancel.check()
            state = index * len(states) // subframes
            if state != shown:
                self.begin(states[state], settings, outputs, **options)
                shown = state
            self.subframe(index)
            # Software drivers run the queue when they like; without this a cancel would wait for all of it.
            if self.gl.software or index % 8 == 7:
                self.gl.ctx.finish()
            if progress is not None:
                progress((index + 1) / subframes, f"Sub-frame {index + 1} of {subframes}")
        passes = develop(self.film(), outputs)
        self.gl.check("the frame")
        return Result(
            passes, planned, subframes, time.perf_counter() - start, self.timers.collect(),
            self.notes(scene),
        )  # fmt: skip

    def notes(self, scene: Scene) -> list[str]:
        """What the user should know of the frame that has begun."""
        facts = self.frame.facts
        notes = [*scene.notes, *facts.rig.notes]
        if not facts.visible:
            notes.append("the camera sees no surface: there is none, or all are hidden from it")
        if not facts.lit and not facts.emissive and facts.world_black:
            notes.append("nothing gives light: there is no light that shines, no emissive surface, and the world is black")
        return notes

    # -- helpers -------------------------------------------------------------------------------------------------

    def _screen_vao(self, program):
        if program.glo not in self._screen_vaos:
            self._screen_vaos[program.glo] = self.gl.ctx.vertex_array(program, [])
        return self._screen_vaos[program.glo]

    def _emitters(self, scene: Scene, stamps: dict[str, str]) -> Emitters:
        key = (stamps["meshes"], stamps["transforms"], stamps["materials"])
        if self._emitter_cache is None or self._emitter_cache[0] != key:
            self._emitter_cache = (key, find_emitters(scene, self.gpu.compiled))
        return self._emitter_cache[1]

    def _find_focus(self, scene: Scene, stamps: dict[str, str]) -> Focus:
        key = (stamps["meshes"], stamps["transforms"])
        if self._focus is None or self._focus[0] != key:
            self._focus = (key, find_focus(scene))
        return self._focus[1]

    def _world_map(self, scene: Scene) -> WorldMap | None:
        """The world as a map, evaluated on the GPU unless it is one colour."""
        key = (scene.world.uid,)
        if self._world_maps is None or self._world_maps[0] != key:
            self._world_maps = (key, self._make_world_map())
        return self._world_maps[1]

    def _make_world_map(self) -> WorldMap | None:
        world = self.gpu.world
        width, height = _WORLD_MAP
        if world.constant is not None:
            if not any(world.constant):
                return None
            # One colour needs no finer map than one that integrates the sphere exactly.
            return WorldMap(np.broadcast_to(np.array(world.constant), (16, 32, 3)))
        program = self.gl.program(
            "World Map",
            {"compute": "passes/world_map_comp.glsl"},
            prelude={"compute": "layout(binding = 0, rgba32f) writeonly uniform image2D world_map;"},
            virtual={**GENERATED, "generated/world.glsl": world_source(world, 0, camera=False, sun_disc=False)},
        )
        texture = self.gl.texture("world map", _WORLD_MAP, "rgba32f")
        # Image look-ups take their level of detail from the view.
        self._view_buffer.write(np.zeros((), VIEW).tobytes())
        self._view_buffer.bind_to_uniform_block(0)
        self.gpu.bind_world_params()
        self.gpu.bind_images(world, 0)
        texture.bind_to_image(0, read=False, write=True)
        program.run(width // 8, height // 8)
        self.gl.ctx.memory_barrier()
        self.gpu.unbind_images(0, len(world.images))
        data = np.frombuffer(texture.read(), np.float32).reshape(height, width, 4)[..., :3]
        self.gl.release(texture)
        result = WorldMap(data)
        return None if result.black else result

    def close(self) -> None:
        """Free all GPU memory."""
        for vao in self._screen_vaos.values():
            vao.release()
        self._screen_vaos.clear()
        self.pool.close()
        self.gpu.close()
        self.gl.release(self._view_buffer)
        self.frame = self._plan = None


def find_emitters(scene: Scene, compiled: list[CompiledGraph]) -> Emitters:
    """The scene's emissive triangles."""
    emission = [
        mean_emission(m.graph, scene.images) if c.emissive else np.zeros(3)
        for m, c in zip(scene.materials, compiled, strict=True)
    ]
    if not any((e > 0.0).any() for e in emission):
        return Emitters.none()
    points = surface_points(scene, _RECEIVERS, 1)
    return Emitters.of(scene, emission, points["position_ws"][points["area"] > 0.0].astype("f8"))


def render(
    scene: Scene,
    settings: Settings | None = None,
    outputs: Iterable[str] = ("Combined",),
    *,
    resolution: tuple[int, int],
    thread: GLThread | None = None,
    cancel: CancelToken | None = None,
    **options,
) -> Result:
    """Render one frame from any thread, with a renderer of its own. See :meth:`Renderer.render`."""
    settings = settings or Settings()

    def job(gl: GL) -> Result:
        renderer = Renderer(gl)
        try:
            return renderer.render(scene, settings, outputs, resolution=resolution, cancel=cancel, **options)
        finally:
            renderer.close()

    return (thread or shared()).call(job, cancel=cancel)


def inspect(
    scene: Scene,
    settings: Settings | None = None,
    outputs: Iterable[str] = ("Combined",),
    *,
    resolution: tuple[int, int],
) -> Plan:
    """The plan of a frame without rendering it, and without a GPU: worlds that are not one colour count as lit."""
    settings = settings or Settings()
    compiled = [compile_surface(m.graph, scene.images) for m in scene.materials]
    world = compile_world(scene.world.graph)
    black = world.constant is not None and not any(world.constant)
    world_map = None if black else WorldMap(np.ones((16, 32, 3)))
    outputs = tuple(outputs)
    facts: Facts = gather_facts(
        scene, compiled, settings, resolution, outputs, settings.samples, world_map, find_emitters(scene, compiled)
    )
    return plan(TECHNIQUES[settings.technique](settings, facts.layers), facts, {"film": ", ".join(outputs)})
