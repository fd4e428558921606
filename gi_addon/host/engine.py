# SPDX-License-Identifier: GPL-3.0-or-later
"""The render engine ``QUARTET``.

``update()`` reads Blender's data into a plain Scene while Blender holds still; ``render()`` may run on another thread and
uses nothing of Blender's but the result and the progress bar. All OpenGL happens on Quartet's own GL thread.
"""

from __future__ import annotations

import concurrent.futures
import contextlib
import traceback
from dataclasses import dataclass

import bpy
import numpy as np

from ..gl import Cancelled, CancelToken, GLError, shared
from ..outputs import LONG_NAMES, OUTPUTS
from ..renderer import Renderer, RenderError
from ..scene import Scene
from ..settings import SettingError, Settings
from . import properties, status
from .compat import pass_name
from .sync import SceneSync, share_meshes
from .viewport import Viewport, close_all

_POLL_SECONDS = 0.05
# How long a cancelled render waits for its sub-frame to end, in seconds.
_PATIENCE = 0.5
# Sub-frames of a material's or a light's thumbnail: it is shown at 32 to 256 pixels.
_PREVIEW_SAMPLES = 8
# Told of every render's progress (0 … 1, text) and of its notes: the command line shows them.
listeners: list = []


@dataclass
class Job:
    """One view layer to render: plain data, safe on any thread."""

    scene: Scene
    settings: Settings
    outputs: tuple[str, ...]
    resolution: tuple[int, int]
    region: tuple[int, int, int, int]
    layer: str
    film_transparent: bool
    persistent: bool
    motion: tuple[Scene, ...] = ()
    preview: bool = False
    timed: bool = False


class QuartetEngine(bpy.types.RenderEngine):
    """Four real-time global illumination techniques, next to Cycles."""

    bl_idname = "QUARTET"
    bl_label = "Quartet GI"
    bl_use_preview = True
    bl_use_postprocess = True
    bl_use_eevee_viewport = True
    bl_use_shading_nodes_custom = False

    # Blender may run __init__ twice on one object, so nothing is made there; class attributes are the empty state.
    _job: Job | None = None
    _sync: SceneSync | None = None
    _renderer: Renderer | None = None
    _failure: str = ""
    _viewport: Viewport | None = None

    # -- final render --------------------------------------------------------------------------------------------

    def update(self, data, depsgraph) -> None:
        """Read the view layer's scene. Errors are kept for render(), which Blender always calls next."""
        self._job, self._failure = None, ""
        try:
            self._job = self._read(depsgraph)
        except (RenderError, SettingError) as error:
            self._failure = str(error)
        except Exception as error:
            traceback.print_exc()
            self._failure = f"the scene could not be read: {type(error).__name__}: {error}"

    def _read(self, depsgraph) -> Job:
        scene = depsgraph.scene
        render = scene.render
        resolution, region = picture(render)
        if min(region[2:]) < 1:
            raise RenderError(
                f"at {render.resolution_percentage} % the picture has {resolution[0]} × {resolution[1]} pixels; "
                "nothing to render"
            )
        persistent = bool(render.use_persistent_data)
        if self._sync is None:
            self._sync = SceneSync()
        elif persistent:
            self._sync.invalidate(depsgraph)
        plain = self._sync.read(depsgraph, resolution=resolution, keep=persistent)
        layer = depsgraph.view_layer
        wanted = ("Combined", *(o.name for o in OUTPUTS.values() if o.name != "Combined" and pass_enabled(layer, o)))
        settings = properties.read(scene)
        if self.is_preview:
            settings.samples = _PREVIEW_SAMPLES
        motion = self._read_motion(depsgraph, resolution, min(settings.motion_steps, settings.samples))
        measure = not self.is_preview and any(wm.quartet.measure for wm in bpy.data.window_managers)
        return Job(
            plain, settings, wanted, resolution, region, layer.name, bool(render.film_transparent), persistent, motion,
            preview=self.is_preview, timed=measure,
        )  # fmt: skip

    def _read_motion(self, depsgraph, resolution: tuple[int, int], steps: int) -> tuple[Scene, ...]:
        """The scene at ``steps`` times while the shutter is open, in order; nothing without motion blur. Meshes that are
        the same at all times are one object."""
        scene = depsgraph.scene
        if not scene.render.use_motion_blur or steps < 2:
            return ()
        shutter = scene.render.motion_blur_shutter
        start = {"START": 0.0, "CENTER": -0.5, "END": -1.0}[scene.render.motion_blur_position] * shutter
        frame, sub = scene.frame_current, scene.frame_subframe
        states: list[Scene] = []
        try:
            for k in range(steps):
                time = frame + sub + start + shutter * (k + 0.5) / steps
                whole = int(np.floor(time))
                self.frame_set(whole, time - whole)
                state = self._sync.read(depsgraph, resolution=resolution)
                share_meshes(state, states[-1] if states else None)
                states.append(state)
        finally:
            self.frame_set(frame, sub)
        return tuple(states)

    def render(self, depsgraph) -> None:
        """Render the job and write the result. Never raises: Blender would show a black picture and call it done."""
        job, self._job = self._job, None
        try:
            if job is None:
                raise RenderError(self._failure or "nothing was read to render")
            self._render(job)
        except Cancelled:
            pass
        except (RenderError, GLError, SettingError) as error:
            self._fail(str(error))
        except Exception as error:
            traceback.print_exc()
            self._fail(f"{type(error).__name__}: {error}")
        finally:
            if job is None or not job.persistent:
                self._free()

    def _fail(self, message: str) -> None:
        status.failed("final", message)
        self.error_set(f"Quartet: {message}")
        self.report({"ERROR"}, f"Quartet: {message}")

    def _render(self, job: Job) -> None:
        cancel = CancelToken()
        state = {"progress": 0.0, "text": ""}

        def progress(share: float, text: str) -> None:
            state["progress"], state["text"] = share, text

        def work(gl):
            if self._renderer is None:
                self._renderer = Renderer(gl)
            renderer = self._renderer
            result = renderer.render(
                job.scene, job.settings, job.outputs, resolution=job.resolution, region=job.region,
                film_transparent=job.film_transparent, progress=progress, cancel=cancel, timed=job.timed,
                motion=job.motion,
            )  # fmt: skip
            if not job.preview:
                report = status.summarise("final", renderer, result.plan, job.scene, result.subframes, result.seconds)
                status.publish(report)
            return result

        self.update_stats("", "Quartet: preparing")
        future = shared().submit(work, cancel=cancel)
        while True:
            done, _ = concurrent.futures.wait([future], timeout=_POLL_SECONDS)
            self.update_progress(state["progress"])
            for listener in listeners:
                listener(state["progress"], state["text"])
            if state["text"]:
                self.update_stats("", f"Quartet: {state['text']}")
            if done:
                break
            if self.test_break():
                cancel.cancel()
                # A sub-frame that takes long ends by itself on the GL thread; nobody has to watch it.
                concurrent.futures.wait([future], timeout=_PATIENCE)
                if not future.done():
                    raise Cancelled
        result = future.result()
        for note in result.notes:
            self.report({"INFO"}, f"Quartet: {note}")
        self._write(job, result.passes)

    def _write(self, job: Job, passes: dict[str, np.ndarray]) -> None:
        width, height = job.region[2:]
        result = self.begin_result(0, 0, width, height, layer=job.layer)
        try:
            for target in result.layers[0].passes:
                array = passes.get(LONG_NAMES.get(target.name, target.name))
                if array is None:
                    continue
                rows, columns = height, width
                array = array[:rows, :columns]
                if array.shape[-1] != target.channels:
                    array = np.repeat(array[..., :1], target.channels, axis=-1)
                target.rect.foreach_set(np.ascontiguousarray(array, np.float32).ravel())
        finally:
            self.end_result(result)

    def _free(self) -> None:
        """Give GPU memory back."""
        renderer, self._renderer, self._sync = self._renderer, None, None
        if renderer is not None:
            # Not waited for: a cancelled sub-frame may still be in the making.
            shared().submit(_close, renderer)

    # -- viewport ------------------------------------------------------------------------------------------------

    def view_update(self, context, depsgraph) -> None:
        """Something has changed; view_draw follows."""
        if self._viewport is None:
            self._viewport = Viewport(self)
        self._viewport.update(depsgraph)

    def view_draw(self, context, depsgraph) -> None:
        """Draw the viewport's picture."""
        if self._viewport is None:
            self._viewport = Viewport(self)
        self._viewport.draw(context, depsgraph)

    def __del__(self) -> None:
        try:
            viewport = self._viewport
        except ReferenceError:  # Blender's side is gone already, as after a final render, which has none
            return
        if viewport is not None:
            viewport.close()

    # -- passes --------------------------------------------------------------------------------------------------

    def update_render_passes(self, scene=None, renderlayer=None) -> None:
        """Tell the compositor which passes there will be."""
        for output in OUTPUTS.values():
            if output.name == "Combined" or pass_enabled(renderlayer, output):
                self.register_pass(
                    scene, renderlayer, pass_name(output), len(output.channels), output.channels, output.kind
                )


def _close(gl, renderer: Renderer) -> None:
    with contextlib.suppress(GLError):  # the context is gone, and the memory with it
        renderer.close()


def pass_enabled(layer: bpy.types.ViewLayer, output) -> bool:
    """Whether the view layer asks for a pass."""
    owner, _, flag = output.flag.rpartition(".")
    target = getattr(layer, owner, None) if owner else layer
    return bool(getattr(target, flag, False))


def picture(render: bpy.types.RenderSettings) -> tuple[tuple[int, int], tuple[int, int, int, int]]:
    """Size of the whole picture and the region (x, y, width, height) to render, row 0 at the bottom."""
    width = render.resolution_x * render.resolution_percentage // 100
    height = render.resolution_y * render.resolution_percentage // 100
    if not render.use_border:
        return (width, height), (0, 0, width, height)
    # In 32 bits, as Blender does: 0.9 × 50 is 45 there, and just below it in 64.
    x0, x1 = (int(np.float32(v) * np.float32(width)) for v in (render.border_min_x, render.border_max_x))
    y0, y1 = (int(np.float32(v) * np.float32(height)) for v in (render.border_min_y, render.border_max_y))
    return (width, height), (x0, y0, max(0, x1 - x0), max(0, y1 - y0))


# Panels of Blender's own that any engine may use but that say nothing here …
_NOT_OURS = {
    "VIEWLAYER_PT_filter", "VIEWLAYER_PT_layer_passes", "RENDER_PT_eevee", "RENDER_PT_simplify_greasepencil",
    "DATA_PT_light", "NODE_DATA_PT_light",
}  # fmt: skip
# … and EEVEE's that hold what Quartet reads too. Their names have been the same since 4.5.
_BORROWED = {
    "DATA_PT_EEVEE_light", "NODE_DATA_PT_EEVEE_light", "DATA_PT_camera_dof", "DATA_PT_camera_dof_aperture",
    "EEVEE_MATERIAL_PT_context_material", "EEVEE_MATERIAL_PT_surface", "EEVEE_MATERIAL_PT_volume", "MATERIAL_PT_preview",
    "EEVEE_WORLD_PT_surface", "EEVEE_WORLD_PT_volume",
}  # fmt: skip


def standard_panels() -> list[type]:
    """Blender's own panels that work for this engine."""
    out = []
    for panel in bpy.types.Panel.__subclasses__():
        engines = getattr(panel, "COMPAT_ENGINES", None)
        if engines and (
            ("BLENDER_RENDER" in engines and panel.__name__ not in _NOT_OURS) or panel.__name__ in _BORROWED
        ):
            out.append(panel)
    return out


@bpy.app.handlers.persistent
def _another_file(*_) -> None:
    status.forget()


def register() -> None:
    bpy.utils.register_class(QuartetEngine)
    bpy.app.handlers.load_post.append(_another_file)
    for panel in standard_panels():
        panel.COMPAT_ENGINES.add("QUARTET")


def unregister() -> None:
    bpy.app.handlers.load_post.remove(_another_file)
    for panel in bpy.types.Panel.__subclasses__():
        engines = getattr(panel, "COMPAT_ENGINES", None)
        if engines and "QUARTET" in engines:
            engines.discard("QUARTET")
    close_all()
    bpy.utils.unregister_class(QuartetEngine)
