# SPDX-License-Identifier: GPL-3.0-or-later
"""The rendered viewport: one :class:`Viewport` per 3D region that shows Quartet.

Blender's thread reads the scene, asks the GL thread for sub-frames and draws the newest picture it has; it never waits for
longer than a blink. A change (scene, view, size, settings) starts afresh, at a lower resolution where a frame would take
too long; while nothing changes sub-frames add up.
"""

from __future__ import annotations

import contextlib
import time
import weakref
from collections import Counter
from concurrent.futures import Future
from concurrent.futures import TimeoutError as NotYet
from dataclasses import dataclass, replace

import bpy
import gpu
import numpy as np
from gpu_extras.presets import draw_texture_2d

from ..gl import Cancelled, CancelToken, GLContextLost, GLError, shared
from ..graph import Plan
from ..renderer import Renderer, RenderError
from ..scene import Camera, Scene
from ..settings import SettingError, Settings, walk
from . import properties, status
from .sync import SceneSync

# A frame slower than this, in seconds, comes at a lower resolution while things change …
SLOW = 0.1
# … by halves, down to one pixel in 4 × 4: below that a picture says little, and shadow maps cost the same anyway.
_COARSEST = 4
# A quarter of the time for a quarter of the pixels: only a frame this fast is worth trying at twice the resolution.
_FAST = SLOW / 4.0
# How long view_draw waits for a picture that should be quick, in seconds: two refreshes of a 60 Hz screen.
_WAIT = 0.033
# Time without a change after which the full resolution starts, in seconds: longer than the gap between mouse events. It counts
# from the picture of the last change too: who drags something waits for that before he goes on, and a full frame's slowest pass
# would then have to be waited for.
_SETTLE = 0.15
# A job shows its picture after this many seconds of sub-frames.
_BATCH = 0.25
_TICK = 0.01
# The largest half float: the picture is stored as half floats.
_HALF_MAX = 65504.0


@dataclass(frozen=True)
class Request:
    """A picture wanted. ``key`` is everything that it depends on; ``size`` (width, height) of the region in pixels,
    ``border`` (x, y, width, height) the part of it to render; ``scale`` pixels per rendered pixel, along a side."""

    key: tuple
    scene: Scene
    settings: Settings
    camera: Camera
    size: tuple[int, int]
    border: tuple[int, int, int, int]
    film_transparent: bool
    scale: int = 1
    timed: bool = False


@dataclass(frozen=True)
class Picture:
    """Sub-frames so far: ``pixels`` (height, width, 4) f4, scene-linear, premultiplied; ``first`` is the time of the first
    one in seconds, 0 where shaders had to be compiled for it."""

    request: Request
    subframes: int
    pixels: np.ndarray
    first: float
    report: status.Report
    sent: frozenset[str] = frozenset()  # kinds of data that went to the GPU for it


class Viewport:
    """The picture of one region. All methods run on Blender's main thread but :meth:`_work`."""

    def __init__(self, engine: bpy.types.RenderEngine) -> None:
        self._engine = weakref.ref(engine)
        self._sync = SceneSync()
        self._scene: Scene | None = None
        self._stamps: dict[str, str] = {}
        self._dirty = True
        self._local: tuple = ()
        self._job: Future | None = None
        self._token = CancelToken()
        self._request: Request | None = None
        self._changed = self._pictured = 0.0
        self._scale = _COARSEST
        self._first: float | None = None
        self._failed: tuple | None = None
        self._lost = False
        self._picture: Picture | None = None
        self._texture: tuple[Picture, gpu.types.GPUTexture] | None = None
        # Of the GL thread: the renderer, its plan, and the request and sub-frame that its film is ready for.
        self._renderer: Renderer | None = None
        self._plan: Plan | None = None
        self._next: tuple | None = None
        # What there was to do, for the tests and the update matrix of the docs.
        self.counts = Counter()
        _live.add(self)

    # -- Blender's calls -----------------------------------------------------------------------------------------

    def update(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Note what has changed; the next draw reads it."""
        self.counts["updates"] += 1
        if self._scene is None or self._sync.invalidate(depsgraph):
            self._dirty = True

    def draw(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Draw the newest picture and ask for the next."""
        self.counts["draws"] += 1
        self._collect()
        try:
            self._read(context, depsgraph)
            wanted = self._wanted(context, depsgraph)
            fresh = self._request is None or wanted.key != self._request.key
            if fresh:
                self._start(wanted)
            self._submit()
            if fresh and self._first is not None and self._first < _WAIT and self._job is not None:
                with contextlib.suppress(NotYet, Cancelled):
                    self._job.exception(timeout=_WAIT)
                self._collect()
                self._submit()
        except (RenderError, SettingError) as error:
            self._fail(str(error), None)
        self._show(depsgraph.scene)
        self._tell()
        _watch()

    def close(self) -> None:
        """Stop, and give the GPU's memory back without waiting for it. Once: Blender may free the engine long after."""
        if self not in _live:
            return
        _live.discard(self)
        if not _live:
            status.resolved("viewport")
        self._token.cancel()
        self._texture = self._picture = self._request = self._scene = None
        self._sync.forget()
        shared().submit(self._close_renderer)

    # -- reading -------------------------------------------------------------------------------------------------

    def _read(self, context, depsgraph) -> None:
        space = context.space_data
        local = (space.local_view is not None, space.use_local_collections)
        if local != self._local:
            self._local, self._dirty = local, True
        if not self._dirty:
            return
        self.counts["reads"] += 1
        scene = self._sync.read(depsgraph, keep=True, space=space if any(local) else None)
        self._dirty = False
        stamps = scene.stamps()
        # The scene's own camera is none of the free view's business.
        stamps.pop("camera")
        if self._scene is None or stamps != self._stamps:
            self._stamps = stamps
            self._scene = scene
        else:
            # Selecting, renaming and the like make Blender say "update" too: the old scene is as good.
            self._scene.camera, self._scene.notes = scene.camera, scene.notes

    def _wanted(self, context, depsgraph) -> Request:
        region, view = context.region, context.region_data
        scene = depsgraph.scene
        settings = properties.read(scene)
        camera = view_camera(view, self._scene, (region.width, region.height))
        size = (region.width, region.height)
        border = border_of(context, scene, size)
        transparent = bool(scene.render.film_transparent)
        key = (id(self._scene), tuple(settings.as_dict().items()), camera.world_from_view.tobytes(),
               camera.clip_from_view.tobytes(), camera.aperture, camera.focus, size, border, transparent)  # fmt: skip
        timed = bool(context.window_manager.quartet.measure)
        return Request(key, self._scene, settings, camera, size, border, transparent, timed=timed)

    # -- asking --------------------------------------------------------------------------------------------------

    def _start(self, wanted: Request) -> None:
        self.counts["restarts"] += 1
        self._request = wanted
        self._changed = time.monotonic()
        self._failed = None
        # Only sub-frames that improve an outdated picture are given up: a first one is always shown.
        self._token.cancel()

    def _submit(self) -> None:
        """Queue the next sub-frames of the request, if there are any to do now."""
        if self._job is not None or not self._due():
            return
        request, first = self._request, 0
        shown = self._picture
        if shown is not None and shown.request.key == request.key:
            if shown.request.scale == 1:
                request, first = shown.request, shown.subframes
        else:
            request = replace(request, scale=self._scale)
        self._token = CancelToken()
        self._job = shared().submit(self._work, request, first, self._token)

    def _due(self) -> bool:
        """Whether there is something to render now."""
        request, shown = self._request, self._picture
        if request is None or self._failed == request.key:
            return False
        if shown is None or shown.request.key != request.key:
            return True
        if shown.request.scale > 1:
            return time.monotonic() - max(self._changed, self._pictured) >= _SETTLE
        return shown.subframes < request.settings.viewport_samples

    def _work(self, gl, request: Request, first: int, token: CancelToken) -> Picture:
        """On the GL thread: some sub-frames more, and the picture so far."""
        start = time.perf_counter()
        compiled = gl.compiled
        if self._renderer is None or self._renderer.gl is not gl:
            # The first time, or the driver has dropped the context.
            self._renderer, self._next = Renderer(gl), None
        renderer = self._renderer
        if self._next != (request.key, request.scale, first):
            first = 0
        self._next = None
        x, y, width, height = (v // request.scale for v in request.border)
        size = tuple(max(1, v // request.scale) for v in request.size)
        region = (x, y, max(1, min(width, size[0] - x)), max(1, min(height, size[1] - y)))
        settings = coarse(request.settings, request.scale)
        samples = settings.viewport_samples
        renderer.timers.enabled = request.timed
        renderer.timers.reset()
        if first == 0:
            self._plan = renderer.begin(
                request.scene, settings, resolution=size, region=region, subframes=samples,
                camera=request.camera, film_transparent=request.film_transparent, moving=request.scale > 1,
            )  # fmt: skip
        # A first picture is shown at once, even an outdated one; what only improves it can be given up at any pass.
        renderer.subframe(first, cancel=token if first or (request.scale == 1 and self._scale > 1) else None)
        gl.ctx.finish()
        first_seconds = 0.0 if gl.compiled != compiled else time.perf_counter() - start
        done = first + 1
        while first and done < samples and time.perf_counter() - start < _BATCH and not token.cancelled:
            renderer.subframe(done, cancel=token)
            gl.ctx.finish()
            done += 1
        pixels = np.clip(renderer.film()["combined"], -_HALF_MAX, _HALF_MAX)
        gl.check("the viewport")
        report = status.summarise(
            "viewport", renderer, self._plan, request.scene, done, time.perf_counter() - start
        )
        self._next = (request.key, request.scale, done)
        return Picture(request, done, np.ascontiguousarray(pixels, np.float32), first_seconds, report,
                       frozenset(renderer.gpu.uploads))  # fmt: skip

    def _close_renderer(self, gl) -> None:
        renderer, self._renderer, self._plan = self._renderer, None, None
        if renderer is not None:
            with contextlib.suppress(GLError):
                renderer.close()

    # -- answers -------------------------------------------------------------------------------------------------

    def _collect(self) -> None:
        """Take the picture of a job that is done."""
        job = self._job
        if job is None or not job.done():
            return
        self._job = None
        try:
            picture = job.result()
        except Cancelled:
            return
        except GLContextLost as error:
            # The driver dropped it; the next job starts a new one. Once: a driver that keeps doing so needs its user.
            if self._lost:
                self._fail(str(error), self._request.key if self._request else None)
            self._lost = not self._lost
            return
        except Exception as error:
            text = str(error) if isinstance(error, (RenderError, GLError)) else f"{type(error).__name__}: {error}"
            self._fail(text, self._request.key if self._request else None)
            return
        old = self._picture
        begun = old is None or old.request.key != picture.request.key or old.request.scale != picture.request.scale
        self.counts["subframes"] += picture.subframes - (0 if begun else old.subframes)
        self._picture, self._pictured = picture, time.monotonic()
        self._lost = False
        if begun:
            if picture.first > 0.0:
                self._first = picture.first
                self._adapt(picture)
            self.counts.update(f"sent {kind}" for kind in picture.sent)
        status.publish(picture.report)

    def _adapt(self, picture: Picture) -> None:
        """Choose the resolution of the next first picture from the time of this one."""
        scale = picture.request.scale
        if picture.first > SLOW:
            self._scale = min(_COARSEST, max(self._scale, 2 * scale))
        elif picture.first < _FAST and scale == self._scale:
            self._scale = max(1, scale // 2)

    def _fail(self, message: str, key: tuple | None) -> None:
        self._failed = key
        status.failed("viewport", message)
        engine = self._engine()
        if engine is not None:
            engine.update_stats("Quartet", message)

    def _tell(self) -> None:
        engine, request, shown = self._engine(), self._request, self._picture
        if engine is None or request is None or "viewport" in status.problems:
            return
        done = shown.subframes if shown is not None and shown.request.key == request.key and shown.request.scale == 1 else 0
        total = request.settings.viewport_samples
        engine.update_stats("", "" if done >= total else f"Quartet: sub-frame {done} of {total}")

    # -- drawing -------------------------------------------------------------------------------------------------

    def _show(self, scene: bpy.types.Scene) -> None:
        """Draw the newest picture, stretched if the region has another size by now."""
        picture, engine, request = self._picture, self._engine(), self._request
        if picture is None or engine is None or request is None:
            return
        if self._texture is None or self._texture[0] is not picture:
            height, width = picture.pixels.shape[:2]
            data = gpu.types.Buffer("FLOAT", width * height * 4, picture.pixels.reshape(-1))
            texture = gpu.types.GPUTexture((width, height), format="RGBA16F", data=data)
            if hasattr(texture, "filter_mode"):
                texture.filter_mode(picture.request.scale > 1)
            self._texture = (picture, texture)
        x, y, width, height = picture.request.border
        stretch = [now / then for now, then in zip(request.size, picture.request.size, strict=True)]
        gpu.state.blend_set("ALPHA_PREMULT")
        # Scene-linear light in, Blender's view transform out.
        engine.bind_display_space_shader(scene)
        draw_texture_2d(
            self._texture[1], (x * stretch[0], y * stretch[1]), width * stretch[0], height * stretch[1]
        )
        engine.unbind_display_space_shader()
        gpu.state.blend_set("NONE")

    def busy(self) -> bool:
        """Whether this viewport will want a redraw without Blender knowing."""
        if self._engine() is None:
            return False
        waiting = self._picture is not None and self._picture.request.scale > 1
        return self._job is not None or waiting or self._due()

    def poke(self) -> None:
        """Ask Blender for a redraw if there is something new to show or to start."""
        ready = self._job.done() if self._job is not None else self._due()
        engine = self._engine()
        if ready and engine is not None:
            with contextlib.suppress(ReferenceError):  # Blender has freed it between two ticks
                engine.tag_redraw()


# Settings that say how many rays, points and directions a sub-frame spends; no map or grid hangs on them.
_EFFORT = ("rsm.samples", "world.rays", "ssdo.samples", "ao.samples")


def coarse(settings: Settings, scale: int) -> Settings:
    """The settings for a picture at 1/``scale`` of the resolution a side, which is shown until nothing changes: as much less
    effort for each of its pixels. The noise differs, the mean does not; maps and grids are those of the full picture."""
    if scale == 1:
        return settings
    out = settings.copy()
    for path, _, meta in walk():
        # Later bounces leave from surface points, which are drawn once for the full picture's samples.
        kept = path == "rsm.samples" and settings.bounces > 1
        if path in _EFFORT and out.get(path) > 0 and not kept:
            out.set(path, max(1, int(meta.low), out.get(path) // scale))
    return out


# --- the view ---------------------------------------------------------------------------------------------------------


def view_camera(view: bpy.types.RegionView3D, scene: Scene, size: tuple[int, int]) -> Camera:
    """The Camera of a 3D view of ``size`` pixels, whether it looks through a camera or freely."""
    world_from_view = np.linalg.inv(np.array(view.view_matrix, "f8"))
    clip_from_view = np.array(view.window_matrix, "f8")
    near, far = _clip_planes(clip_from_view)
    name = "viewport"
    aperture = focus = 0.0
    if view.view_perspective == "CAMERA" and scene.camera is not None:
        aperture, focus, name = scene.camera.aperture, scene.camera.focus, scene.camera.name
    if clip_from_view[3, 3] == 1.0 and near <= 0.0:
        # A free orthographic view also sees what is behind its eye. Step back until nothing is.
        low, high = scene.bounds()
        corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
        depth = (world_from_view[:3, 3] - corners) @ world_from_view[:3, 2]
        radius = float(np.linalg.norm(high - low)) / 2.0
        back = max(0.0, min(-near, 0.01 * radius - float(depth.min())))
        world_from_view[:3, 3] += world_from_view[:3, 2] * back
        clip_from_view[2, 3] -= clip_from_view[2, 2] * -back
        near, far = max(near + back, 1e-3 * radius), far + back
    camera = Camera(world_from_view, clip_from_view, near, far, aperture, focus or 10.0, name)
    if aperture > 0.0:
        lens = scene.camera
        camera.blades, camera.blade_turn, camera.blade_ratio = lens.blades, lens.blade_turn, lens.blade_ratio
    return camera


def _clip_planes(clip_from_view: np.ndarray) -> tuple[float, float]:
    """Distances of the near and the far plane of an OpenGL projection."""
    view_from_clip = np.linalg.inv(clip_from_view)
    points = view_from_clip @ np.array([[0.0, 0.0], [0.0, 0.0], [-1.0, 1.0], [1.0, 1.0]])
    near, far = -points[2] / points[3]
    return float(near), float(far)


def border_of(context, scene: bpy.types.Scene, size: tuple[int, int]) -> tuple[int, int, int, int]:
    """The part (x, y, width, height) of a region of ``size`` that its render border leaves."""
    space, view = context.space_data, context.region_data
    whole = (0, 0, *size)
    if view.view_perspective == "CAMERA":
        render, camera = scene.render, scene.camera
        if not render.use_border or camera is None or camera.type != "CAMERA":
            return whole
        frame = _camera_frame(view, scene, camera)
        low = [render.border_min_x, render.border_min_y]
        high = [render.border_max_x, render.border_max_y]
        low, high = (frame[0] + (frame[1] - frame[0]) * np.array(v) for v in (low, high))
    elif space.use_render_border:
        low = np.array([space.render_border_min_x, space.render_border_min_y])
        high = np.array([space.render_border_max_x, space.render_border_max_y])
    else:
        return whole
    limit = np.array(size)
    first = np.clip(np.floor(low * limit), 0, limit - 1).astype(int)
    last = np.clip(np.ceil(high * limit), first + 1, limit).astype(int)
    return (int(first[0]), int(first[1]), int(last[0] - first[0]), int(last[1] - first[1]))


def _camera_frame(view, scene, camera) -> np.ndarray:
    """Corners (2, 2) of the camera's frame in the region, as shares of its size."""
    corners = [camera.matrix_world.normalized() @ corner for corner in camera.data.view_frame(scene=scene)]
    points = np.array([[*corner, 1.0] for corner in corners]) @ np.array(view.perspective_matrix, "f8").T
    ndc = points[:, :2] / points[:, 3:]
    return np.stack([ndc.min(axis=0), ndc.max(axis=0)]) * 0.5 + 0.5


# --- all viewports ----------------------------------------------------------------------------------------------------

_live: set[Viewport] = set()


def viewports() -> list[Viewport]:
    """Every viewport that shows Quartet."""
    return list(_live)


def _watch() -> None:
    """Keep an eye on running jobs: Blender redraws only when it is told to."""
    if not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=_TICK)


def _tick() -> float | None:
    busy = False
    for viewport in list(_live):
        if viewport._engine() is None:
            viewport.close()  # Blender dropped its engine without a word
        elif viewport.busy():
            busy = True
            viewport.poke()
    return _TICK if busy else None


def close_all() -> None:
    """Close every viewport, on unregister."""
    for viewport in viewports():
        viewport.close()
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
