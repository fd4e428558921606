# SPDX-License-Identifier: GPL-3.0-or-later
"""What a running pass has at hand: its resources, programs, the camera of the sub-frame, draws and dispatches."""

from __future__ import annotations

from collections.abc import Mapping

import moderngl
import numpy as np

from .facts import Facts
from .gl import GL
from .gl.timers import PassTimers
from .gpu_scene import GPUScene
from .gpu_types import GENERATED, VIEW
from .graph import Buffer, Planned, Texture
from .lights import Sample
from .scene import Camera, replace
from .sequence import sobol_2d
from .settings import Settings

FULLSCREEN = "passes/fullscreen_vert.glsl"


class ResourcePool:
    """The graph's textures and buffers, kept between frames as long as their size and format stay."""

    def __init__(self, gl: GL) -> None:
        self.gl = gl
        self._items: dict[str, tuple[tuple, object]] = {}
        self._framebuffers: dict[tuple, moderngl.Framebuffer] = {}

    def prepare(self, resources: Mapping[str, Texture | Buffer], facts: Facts) -> dict[str, object]:
        """Allocate what a plan needs and free what it does not."""
        wanted = {name: self._signature(r, facts) for name, r in resources.items()}
        for name in [n for n, (signature, _) in self._items.items() if wanted.get(n) != signature]:
            self._drop(name)
        for name, resource in resources.items():
            if name not in self._items:
                self._items[name] = (wanted[name], self._allocate(resource, facts))
        return {name: item for name, (_, item) in self._items.items()}

    def framebuffer(self, color: list, depth=None) -> moderngl.Framebuffer:
        """A framebuffer over these textures, made once."""
        key = (*(t.glo for t in color), depth.glo if depth is not None else 0)
        if key not in self._framebuffers:
            self._framebuffers[key] = self.gl.framebuffer(color, depth)
        return self._framebuffers[key]

    def fresh(self, before: dict[str, object]) -> set[str]:
        """Names whose object is not the one in ``before``."""
        return {name for name, (_, item) in self._items.items() if before.get(name) is not item}

    def close(self) -> None:
        for name in list(self._items):
            self._drop(name)

    @staticmethod
    def _signature(resource: Texture | Buffer, facts: Facts) -> tuple:
        if isinstance(resource, Texture):
            mips = resource.mips(facts) if resource.mips else 0
            return (resource.format, resource.size(facts), mips, resource.layers, resource.filter)
        return (resource.struct, resource.dtype.itemsize, resource.count(facts))

    def _allocate(self, resource: Texture | Buffer, facts: Facts):
        if isinstance(resource, Buffer):
            return self.gl.buffer(resource.name, size=resource.nbytes(facts))
        texture = self.gl.texture(
            resource.name, resource.size(facts), resource.format, layers=resource.layers, filter=resource.filter
        )
        if resource.mips and resource.mips(facts):
            texture.build_mipmaps(0, resource.mips(facts))
            texture.filter = (
                (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
                if resource.filter == "linear"
                else (moderngl.NEAREST_MIPMAP_NEAREST, moderngl.NEAREST)
            )
        return texture

    def _drop(self, name: str) -> None:
        _, item = self._items.pop(name)
        glo = getattr(item, "glo", None)
        for key in [k for k in self._framebuffers if glo in k]:
            self.gl.release(self._framebuffers.pop(key))
        self.gl.release(item)


class Frame:
    """One frame in the making, handed to each pass's ``run``."""

    def __init__(
        self,
        gl: GL,
        pool: ResourcePool,
        gpu: GPUScene,
        settings: Settings,
        facts: Facts,
        resources: dict[str, object],
        timers: PassTimers,
        camera: Camera,
        region: tuple[int, int, int, int],
        full: tuple[int, int],
        view_buffer: moderngl.Buffer,
        screen_vao,
    ) -> None:
        self.gl, self.pool, self.gpu = gl, pool, gpu
        self.settings, self.facts, self.resources, self.timers = settings, facts, resources, timers
        self.camera, self.full = camera, full
        margin = facts.margin
        self.region = (region[0] - margin, region[1] - margin, region[2] + 2 * margin, region[3] + 2 * margin)
        self.subframe = 0
        self._view_buffer = view_buffer
        self._screen_vao = screen_vao
        self._samples: dict[bool, Sample] = {}
        self.view = np.zeros((), VIEW)
        self.film_transparent = False
        self.world_origin = np.zeros(3)  # what world coordinates on the GPU leave out

    # -- sub-frames ----------------------------------------------------------------------------------------------

    def begin_subframe(self, subframe: int) -> None:
        """Jitter the camera for ``subframe`` and make it current for all shaders."""
        self.subframe = subframe
        self._samples.clear()
        jitter = pixel_jitter(self.settings, subframe, self.facts.subframes)
        camera = lens_camera(self.camera, subframe, self.facts.subframes)
        self.view = view_uniforms(camera, self.region, self.full, jitter, subframe, self.facts)
        self.view["margin"] = self.facts.margin
        self.view["film_transparent"] = float(self.film_transparent)
        self.view["world_origin"] = self.world_origin
        self._view_buffer.write(self.view.tobytes())
        self._view_buffer.bind_to_uniform_block(0)

    def light_sample(self, *, bounce: bool) -> Sample:
        """The lights of this sub-frame with their views into the shadow or the bounce maps."""
        if bounce not in self._samples:
            self._samples[bounce] = self.facts.rig.sample(self.subframe, self.facts.subframes, bounce=bounce)
        return self._samples[bounce]

    # -- programs and bindings -----------------------------------------------------------------------------------

    def program(self, planned: Planned, key: str = "main", *, virtual: Mapping[str, str] | None = None, **defines: int):
        """The pass's program ``key`` of its ``shaders`` table, compiled once per set of defines."""
        cache_key = (key, tuple(sorted(defines.items())), tuple(sorted((virtual or {}).items())))
        if cache_key not in planned.programs:
            stages = planned.task.shaders[key]
            planned.programs[cache_key] = self.gl.program(
                planned.title,
                stages,
                prelude={stage: planned.prelude(stage) for stage in stages},
                defines={**planned.defines(), **defines},
                virtual={**GENERATED, **(virtual or {})},
            )
        return planned.programs[cache_key]

    def bind(self, planned: Planned) -> None:
        """Bind the pass's textures and buffers where its declarations say."""
        for unit, texture in enumerate(planned.texture_reads()):
            self.resources[texture.name].use(unit)
        for binding, (buffer, _) in enumerate(planned.buffers()):
            self.resources[buffer.name].bind_to_storage_buffer(binding)

    @staticmethod
    def set(program, **values) -> None:
        """Set uniforms by name; those the compiler dropped are skipped."""
        for name, value in values.items():
            if name in program:
                if isinstance(value, np.ndarray):
                    program[name].write(np.ascontiguousarray(value, "f4").tobytes())
                else:
                    program[name].value = value

    def upload(self, name: str, data: np.ndarray) -> None:
        """Write a buffer resource, if the plan has it."""
        buffer = self.resources.get(name)
        if buffer is not None and data.nbytes:
            buffer.write(np.ascontiguousarray(data).tobytes())

    # -- work ----------------------------------------------------------------------------------------------------

    def targets(self, planned: Planned) -> moderngl.Framebuffer:
        """A framebuffer of the pass's writes, in their declared order."""
        color = [self.resources[w.name] for w in planned.texture_writes() if w.format != "depth24"]
        depth = [self.resources[w.name] for w in planned.texture_writes() if w.format == "depth24"]
        return self.pool.framebuffer(color, depth[0] if depth else None)

    def screen(self, planned: Planned, program, *, viewport: tuple[int, int, int, int] | None = None) -> None:
        """Run a fragment program over every texel of the pass's targets."""
        fbo = self.targets(planned)
        fbo.use()
        fbo.viewport = viewport or (0, 0, *fbo.size)
        self.gl.ctx.disable(moderngl.DEPTH_TEST | moderngl.BLEND | moderngl.CULL_FACE)
        self.bind(planned)
        self._screen_vao(program).render(moderngl.TRIANGLES, vertices=3)

    def compute(self, planned: Planned, program, size: tuple[int, ...], local: tuple[int, ...] = (8, 8, 1)) -> None:
        """Dispatch a compute program over ``size`` invocations and make its writes visible."""
        self.bind(planned)
        for slot, texture in enumerate(planned.texture_writes()):
            self.resources[texture.name].bind_to_image(
                slot, read=texture.access != "writeonly", write=texture.access != "readonly"
            )
        size = (*size, 1, 1)[:3]
        local = (*local, 1, 1)[:3]
        program.run(*(-(-s // n) for s, n in zip(size, local, strict=True)))
        self.gl.ctx.memory_barrier(moderngl.ALL_BARRIER_BITS)


def pixel_jitter(settings: Settings, subframe: int, subframes: int) -> np.ndarray:
    """Offset (2,) in pixels of a sub-frame's sample from the pixel's centre, distributed as the pixel filter."""
    if subframes == 1:
        return np.zeros(2)
    u = sobol_2d(subframe, 1)
    width = settings.filter_width
    if settings.pixel_filter == "BLACKMAN_HARRIS":
        return np.array([_blackman_harris_inverse(x) for x in u]) * width
    return (u - 0.5) * width


def lens_camera(camera: Camera, subframe: int, subframes: int) -> Camera:
    """The camera as seen from this sub-frame's point of its lens: the eye moves, what is in focus stays in its pixel."""
    if camera.aperture <= 0.0 or subframes == 1:
        return camera
    x, y = lens_point(camera, sobol_2d(subframe, 2)) * camera.aperture
    moved = np.asarray(camera.world_from_view, "f8").copy()
    moved[:3, 3] += moved[:3, 0] * x + moved[:3, 1] * y
    shear = np.eye(4)
    # At depth −z = focus this takes back exactly the shift of the eye.
    shear[0, 2], shear[1, 2] = -x / camera.focus, -y / camera.focus
    return replace(camera, world_from_view=moved, clip_from_view=np.asarray(camera.clip_from_view, "f8") @ shear)


def lens_point(camera: Camera, u: np.ndarray) -> np.ndarray:
    """A point (2,) of the iris of radius 1 for ``u`` in [0, 1)²: a disc, or the polygon of its blades."""
    if camera.blades < 3:
        radius, angle = np.sqrt(u[0]), 2.0 * np.pi * u[1]
        p = radius * np.array([np.cos(angle), np.sin(angle)])
    else:
        # One triangle about the centre is chosen; the rest of the number is as good as new.
        blade = np.floor(u[0] * camera.blades)
        a = np.sqrt(u[0] * camera.blades - blade)
        half = np.pi / camera.blades
        side = u[1] * a
        corner = np.array([a * np.cos(half), (2.0 * side - a) * np.sin(half)])
        turn = camera.blade_turn + 2.0 * half * blade
        c, s = np.cos(turn), np.sin(turn)
        p = np.array([c * corner[0] - s * corner[1], s * corner[0] + c * corner[1]])
    return p / np.array([camera.blade_ratio, 1.0])


def _blackman_harris_table() -> tuple[np.ndarray, np.ndarray]:
    x = np.linspace(-0.5, 0.5, 1025)
    t = 2.0 * np.pi * (x + 0.5)
    # The 4-term window of F. Harris, Proc. IEEE 66(1), 1978.
    w = 0.35875 - 0.48829 * np.cos(t) + 0.14128 * np.cos(2 * t) - 0.01168 * np.cos(3 * t)
    cdf = np.concatenate([[0.0], np.cumsum((w[1:] + w[:-1]) / 2.0)])
    return cdf / cdf[-1], x


_BLACKMAN_HARRIS = _blackman_harris_table()


def _blackman_harris_inverse(u: float) -> float:
    cdf, x = _BLACKMAN_HARRIS
    return float(np.interp(u, cdf, x))


def view_uniforms(
    camera: Camera,
    region: tuple[int, int, int, int],
    full: tuple[int, int],
    jitter: np.ndarray,
    subframe: int,
    facts: Facts,
) -> np.ndarray:
    """VIEW of a sub-frame. ``region`` (x, y, width, height) in pixels of the ``full`` picture, row 0 at the bottom; it may
    reach beyond it."""
    view = np.zeros((), VIEW)
    x, y, width, height = region
    projection = np.asarray(camera.clip_from_view, "f8").copy()
    # Crop: map the region's part of clip space to [−1, 1], moved by the jitter.
    scale = np.array([full[0] / width, full[1] / height])
    low = np.array([x, y]) + jitter
    offset = scale - 1.0 - 2.0 * low / np.array([width, height])
    crop = np.eye(4)
    crop[0, 0], crop[1, 1] = scale
    crop[0, 3], crop[1, 3] = offset
    projection = _depth_range(crop @ projection, camera, facts)
    world_from_view = np.asarray(camera.world_from_view, "f8")
    view_from_world = np.linalg.inv(world_from_view)
    rotation, eye = world_from_view[:3, :3], world_from_view[:3, 3]
    # Rays by unprojecting the four corners: exact for any projection.
    inverse = np.linalg.inv(crop @ np.asarray(camera.clip_from_view, "f8"))

    def unproject(u: float, v: float, z: float) -> np.ndarray:
        p = inverse @ np.array([2.0 * u - 1.0, 2.0 * v - 1.0, z, 1.0])
        return p[:3] / p[3]

    def ray(u: float, v: float) -> tuple[np.ndarray, np.ndarray]:
        a, b = unproject(u, v, -1.0), unproject(u, v, 1.0)
        direction = (b - a) / -(b[2] - a[2])
        return a - direction * -a[2], direction

    (o00, d00), (o10, d10), (o01, d01) = ray(0, 0), ray(1, 0), ray(0, 1)
    view["clip_from_world"] = (projection @ view_from_world).T
    view["view_from_world"] = view_from_world.T
    view["origin_ws"] = rotation @ o00 + eye
    view["origin_u"], view["origin_v"] = rotation @ (o10 - o00), rotation @ (o01 - o00)
    view["direction_ws"] = rotation @ d00
    view["direction_u"], view["direction_v"] = rotation @ (d10 - d00), rotation @ (d01 - d00)
    orthographic = camera.orthographic
    span = (o10 - o00) if orthographic else (d10 - d00)
    view["pixel_size"] = np.linalg.norm(span) / width
    view["orthographic"] = float(orthographic)
    view["clip_start"], view["clip_end"] = camera.clip_start, camera.clip_end
    view["scene_radius"] = facts.radius
    # Sub-frames average texture lookups: each may be sharper by the square root of their number.
    view["lod_bias"] = -0.5 * np.log2(max(1, facts.subframes))
    view["forward_ws"] = -rotation[:, 2]
    view["resolution"], view["inverse_resolution"] = (width, height), (1.0 / width, 1.0 / height)
    view["pixel_offset"] = (x, y)
    view["subframe"], view["subframes"] = subframe, facts.subframes
    return view


def _depth_range(projection: np.ndarray, camera: Camera, facts: Facts) -> np.ndarray:
    """Replace the projection's clip planes by ones that hug the scene: a 24-bit depth buffer needs it."""
    low, high = facts.rig.bounds
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    view_from_world = np.linalg.inv(np.asarray(camera.world_from_view, "f8"))
    depths = -(corners @ view_from_world[2, :3] + view_from_world[2, 3])
    out = projection.copy()
    far = min(camera.clip_end, float(depths.max()) * 1.001 + 1e-6 * facts.radius)
    if camera.orthographic:
        near = max(camera.clip_start, float(depths.min()) - 1e-3 * facts.radius)
        far = max(far, near + 1e-6 * facts.radius)
        out[2] = [0.0, 0.0, -2.0 / (far - near), -(far + near) / (far - near)]
        return out
    near = max(camera.clip_start, float(depths.min()) * 0.999, 1e-9)
    far = max(far, near * 1.001)
    out[2] = [0.0, 0.0, -(far + near) / (far - near), -2.0 * far * near / (far - near)]
    return out
