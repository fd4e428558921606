# SPDX-License-Identifier: GPL-3.0-or-later
"""A Scene in GPU memory, and the draws of its surfaces.

All meshes share one vertex and one index buffer and all instances one instance buffer, so that a pass draws each
material with one indirect call, however many objects wear it.
"""

from __future__ import annotations

from dataclasses import dataclass

import moderngl
import numpy as np

from .gl import GL
from .gpu_types import GENERATED
from .graph import Planned
from .materials import CompiledGraph, compile_surface, compile_world
from .scene import Image, Material, Mesh, Scene, ShaderGraph

# One instance's attributes, in the order of the vertex shader's inputs.
_INSTANCE = np.dtype([
    ("row_0", "f4", 3), ("row_1", "f4", 3), ("row_2", "f4", 3), ("translation", "f4", 3),
    ("texspace_min", "f4", 3), ("texspace_scale", "f4", 3), ("color", "f4", 4), ("info", "f4", 2),
])  # fmt: skip
_INSTANCE_FORMAT = "3f 3f 3f 3f 3f 3f 4f 2f/i"
_INSTANCE_NAMES = tuple(f"instance_{name}" for name in _INSTANCE.names)

# Uniform block of a graph's parameters. Not a storage buffer: software drivers read zeros from those in the helper
# pixels at a triangle's edge, and then texture coordinates have wrong derivatives there.
_PARAMS_BINDING = 1
_PARAMS_ALIGNMENT = 256  # bytes, the strictest GL_UNIFORM_BUFFER_OFFSET_ALIGNMENT that drivers ask for
_MAX_ATTRIBUTES = 4
# Meshes above this many triangles are drawn in spatial chunks, so that a view skips those it can't see. A mesh that is
# placed many times is not: its copies are skipped one by one already.
_CHUNK_TRIANGLES = 1024
_CHUNKED_PLACES = 8
_ANISOTROPY = 1.0
# What a material's text has where it looks at its object: then vertices carry that along.
_OBJECT_SPACE = ("_os", "generated", "object_", "point.object", "world_from_object", "map_object", "tangent_radial")


@dataclass
class DrawList:
    """Indirect commands (N, 5) u4 sorted by material, which range of them each material has, and the world box of each:
    ``materials`` lists the material of every batch (−1: all opaque ones together), ``batch`` (N,) the batch of every
    command, ``center`` and ``half`` (N, 3), ``bits`` (N,) the visibility bits of its instances."""

    commands: np.ndarray
    materials: list[int]
    batch: np.ndarray
    center: np.ndarray
    half: np.ndarray
    bits: np.ndarray
    buffer: moderngl.Buffer

    def visible(
        self, clip_from_world: np.ndarray, beyond: np.ndarray | None = None, among: tuple[int, ...] | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """The commands whose boxes touch the view volume of ``clip_from_world`` (column-major as for GLSL), and how
        many of them each batch has. What lies wholly in the box ``beyond`` (2, 3) is left out, and what has none of the
        bits ``among`` exactly."""
        m = clip_from_world.reshape(4, 4).T.astype("f8")
        planes = np.concatenate([m[3] + m[:3], m[3] - m[:3]])
        distance = self.center @ planes[:, :3].T + planes[:, 3] + self.half @ np.abs(planes[:, :3]).T
        seen = (distance >= 0.0).all(axis=1)
        if beyond is not None:
            middle, reach = beyond.mean(axis=0), (beyond[1] - beyond[0]) / 2.0
            # Boxes that make up ``beyond`` touch its sides, by rounding from without.
            seen &= (np.abs(self.center - middle) + self.half > reach + 1e-6 * (reach.max() + np.abs(middle).max())).any(axis=1)
        if among is not None:
            seen &= np.isin(self.bits, among)
        return self.commands[seen], np.bincount(self.batch[seen], minlength=len(self.materials))


class MaterialSet:
    """Compiled materials and their parameters in one buffer. Compilation is cached by material."""

    def __init__(self) -> None:
        self._cache: dict[int, CompiledGraph] = {}

    def compile(self, materials: list[Material], images: list[Image]) -> list[CompiledGraph]:
        """Compile what is new, forget what is gone."""
        self._cache = {m.uid: self._cache.get(m.uid) or compile_surface(m.graph, images) for m in materials}
        return [self._cache[m.uid] for m in materials]


class GPUScene:
    """Uploads what changed of a scene and draws it. Lives on the GL thread."""

    def __init__(self, gl: GL) -> None:
        self.gl = gl
        self.materials = MaterialSet()
        self.compiled: list[CompiledGraph] = []
        self._mesh_key: tuple | None = None
        self._transform_key: tuple | None = None
        self._material_key: tuple | None = None
        self._world_key: int | None = None
        self.world: CompiledGraph = compile_world(ShaderGraph())
        self._buffers: dict[str, moderngl.Buffer] = {}
        self._streams: dict[str, moderngl.Buffer] = {}
        self._textures: dict[int, moderngl.Texture] = {}
        self._samplers: dict[tuple, moderngl.Sampler] = {}
        self._vaos: dict[tuple, moderngl.VertexArray] = {}
        self._draws: dict[tuple, DrawList] = {}
        self._chunks: list[list[tuple[int, int, int, np.ndarray]]] = []
        self._scene: Scene | None = None
        self.uploads: dict[str, int] = {}

    # -- upload --------------------------------------------------------------------------------------------------

    def sync(self, scene: Scene, stamps: dict[str, str]) -> None:
        """Make the GPU's copy equal ``scene``; only what its stamps say has changed is sent."""
        self._scene = scene
        self.uploads = {}
        material_key = (stamps["materials"],)
        if material_key != self._material_key:
            self.compiled = self.materials.compile(scene.materials, scene.images)
            self._upload_params()
            self._material_key = material_key
            self._drop_vaos()
            self._drop_draws()
            self.uploads["materials"] = len(self.compiled)
        if self._world_key != scene.world.uid:
            self.world = compile_world(scene.world.graph, scene.images)
            self._world_key = scene.world.uid
            self._buffer("world_params", np.frombuffer(_param_block(self.world), "u1"))
        self._sync_textures(scene)
        wanted = sorted({name for c in self.compiled for name in c.attributes[:_MAX_ATTRIBUTES]})
        mesh_key = (stamps["meshes"], tuple(wanted))
        if mesh_key != self._mesh_key:
            self._upload_meshes(scene, wanted)
            self._mesh_key = mesh_key
            self._transform_key = None
            self.uploads["meshes"] = len(scene.meshes)
        transform_key = (stamps["transforms"],)
        if transform_key != self._transform_key:
            self._upload_instances(scene)
            self._drop_draws()
            self._transform_key = transform_key
            self.uploads["transforms"] = len(scene.instances)

    def _buffer(self, name: str, data: np.ndarray) -> moderngl.Buffer:
        """(Re)fill a named buffer, keeping the GL object where the size allows."""
        old = self._buffers.get(name)
        if old is not None and old.size == max(16, data.nbytes):
            if data.nbytes:
                old.write(np.ascontiguousarray(data))
            return old
        self.gl.release(old)
        self._drop_vaos()
        self._buffers[name] = self.gl.buffer(f"scene {name}", np.ascontiguousarray(data))
        return self._buffers[name]

    def _upload_params(self) -> None:
        self._param_ranges: list[tuple[int, int]] = []
        data = b""
        for compiled in self.compiled:
            block = _param_block(compiled)
            self._param_ranges.append((len(data), len(block)))
            data += block + b"\0" * (-len(block) % _PARAMS_ALIGNMENT)
        self._buffer("params", np.frombuffer(data or b"\0" * 16, "u1"))

    def _upload_meshes(self, scene: Scene, wanted: list[str]) -> None:
        meshes = scene.meshes
        counts = [len(m.positions) for m in meshes]
        self._base_vertex = np.concatenate([[0], np.cumsum(counts)]).astype("i8")
        index_counts = [3 * len(m.triangles) for m in meshes]
        self._first_index = np.concatenate([[0], np.cumsum(index_counts)]).astype("i8")
        total = int(self._base_vertex[-1])
        positions = np.concatenate([m.positions for m in meshes]) if total else np.zeros((1, 3), "f4")
        self._buffer("positions", np.asarray(positions, "f4"))
        normals = np.zeros((max(total, 1), 4), "i2")
        if total:
            normals[:, :3] = np.rint(np.concatenate([m.normals for m in meshes]) * 32767.0)
        self._buffer("normals", normals)
        places = np.bincount(scene.instances.mesh, minlength=len(meshes)) if len(meshes) else []
        chunked = [_chunks(m, places[i] <= _CHUNKED_PLACES) for i, m in enumerate(meshes)]
        self._chunks = [chunks for _, chunks in chunked]
        indices = [triangles.reshape(-1) for triangles, _ in chunked]
        self._buffer("indices", np.concatenate(indices).astype("u4") if indices else np.zeros(3, "u4"))
        for name in [n for n in self._streams if n not in wanted]:
            self.gl.release(self._streams.pop(name), self._buffers.pop(f"attribute {name}", None))
        for name in wanted:
            parts = [_attribute(m, name) for m in meshes]
            width = max((p.shape[1] for p in parts if p is not None), default=2)
            data = np.zeros((max(total, 1), width), "f4")
            for part, start in zip(parts, self._base_vertex[:-1], strict=True):
                if part is not None:
                    data[start : start + len(part), : part.shape[1]] = part
                    if part.shape[1] < width == 4:
                        data[start : start + len(part), 3] = 1.0
            self._streams[name] = self._buffer(f"attribute {name}", data)
        self._drop_vaos()
        self._build_groups(scene)

    def _build_groups(self, scene: Scene) -> None:
        """Sort instances so that those alike in mesh, materials and visibility lie together."""
        inst = scene.instances
        keys: dict[tuple, list[int]] = {}
        for i in range(len(inst)):
            if not scene.meshes[inst.mesh[i]].empty:
                keys.setdefault((int(inst.mesh[i]), inst.materials[i], int(inst.visibility[i])), []).append(i)
        self._order = np.array([i for group in keys.values() for i in group], "i8")
        self._groups: list[tuple[int, tuple[int, ...], int, int, int]] = []
        start = 0
        for (mesh, materials, visibility), members in keys.items():
            self._groups.append((mesh, materials, visibility, start, len(members)))
            start += len(members)
        self._drop_draws()

    def _drop_draws(self) -> None:
        self.gl.release(*(draws.buffer for draws in self._draws.values()))
        self._draws.clear()

    def _drop_vaos(self) -> None:
        # Released by hand: moderngl leaves what Python forgets to the driver for as long as the context lives.
        self.gl.release(*self._vaos.values())
        self._vaos.clear()

    def _upload_instances(self, scene: Scene) -> None:
        inst = scene.instances
        data = np.zeros(max(1, len(self._order)), _INSTANCE)
        if len(self._order):
            matrix = inst.matrix[self._order]
            # A transform that is not a number places nothing: all its vertices fall together and draw nothing.
            matrix = np.where(np.isfinite(matrix).all(axis=(1, 2))[:, None, None], matrix, 0.0)
            data["row_0"], data["row_1"], data["row_2"] = (matrix[:, k, :3] for k in range(3))
            data["translation"] = matrix[:, :3, 3]
            bounds = np.stack([scene.meshes[m].bounds for m in inst.mesh[self._order]])
            size = bounds[:, 1] - bounds[:, 0]
            data["texspace_min"] = bounds[:, 0]
            data["texspace_scale"] = np.where(size > 0.0, 1.0 / np.where(size > 0.0, size, 1.0), 0.0)
            data["color"] = inst.color[self._order]
            data["info"][:, 0] = inst.index[self._order]
            data["info"][:, 1] = inst.random[self._order]
        self._buffer("instances", data)

    def _sync_textures(self, scene: Scene) -> None:
        used = {i for c in (*self.compiled, self.world) for i in c.images}
        wanted = {scene.images[i].uid: scene.images[i] for i in used if i < len(scene.images)}
        for uid in [u for u in self._textures if u not in wanted]:
            self.gl.release(self._textures.pop(uid))
        for uid, image in wanted.items():
            if uid not in self._textures:
                self._textures[uid] = self._upload_image(image)
                self.uploads["images"] = self.uploads.get("images", 0) + 1

    def _upload_image(self, image: Image) -> moderngl.Texture:
        pixels = np.ascontiguousarray(image.pixels)
        height, width = pixels.shape[:2]
        limit = self.gl.max_texture_size
        if max(width, height) > limit:
            step = -(-max(width, height) // limit)
            pixels = np.ascontiguousarray(pixels[::step, ::step])
            height, width = pixels.shape[:2]
        if pixels.dtype == np.uint8:
            fmt = "rgba8"
        else:
            finite = np.nan_to_num(pixels, nan=0.0, posinf=65504.0, neginf=0.0)
            pixels = np.clip(finite, -65504.0, 65504.0).astype("f2")
            fmt = "rgba16f"
        texture = self.gl.texture(f"image {image.name}", (width, height), fmt, pixels)
        texture.build_mipmaps()
        return texture

    # -- drawing -------------------------------------------------------------------------------------------------

    @property
    def scene(self) -> Scene | None:
        """What was synced last."""
        return self._scene

    def bits(self, visibility: int) -> tuple[int, ...]:
        """The different visibility bits of instances that ``visibility`` rays see."""
        return tuple(sorted({seen for _, _, seen, _, _ in self._groups if seen & visibility}))

    def draw(
        self, planned: Planned, stages, visibility: int, clip_from_world: np.ndarray, *, beyond: np.ndarray | None = None,
        among: tuple[int, ...] | None = None, **options,
    ) -> None:
        """Draw surfaces that ``visibility`` rays see, each with its material's function.

        ``stages`` are the pass's shader files. Options: ``full`` evaluates every material, else only those that let light
        through; ``units`` is the first texture unit free for materials; ``defines``; ``only`` draws materials with that
        flag of CompiledGraph alone. Nothing is drawn that lies wholly in the box ``beyond``; of
        instances, only those whose visibility bits are ``among`` the given.
        """
        draws, prepared = self._prepared(planned, stages, visibility, options)
        commands, counts = draws.visible(clip_from_world, beyond, among)
        if len(commands):
            draws.buffer.write(np.ascontiguousarray(commands))
        first = 0
        for (material, program, vao), count in zip(prepared, counts, strict=True):
            if count:
                if "clip_from_world" in program:  # a driver may drop it where a geometry shader places the vertices
                    program["clip_from_world"].write(clip_from_world)
                if material >= 0:
                    self._bind_material(material, options["units"])
                vao.render_indirect(draws.buffer, moderngl.TRIANGLES, int(count), first)
                first += int(count)
        self.unbind_images(options["units"], max((len(c.images) for c in self.compiled), default=0))

    def programs(self, planned: Planned, stages, visibility: int, **options) -> list:
        """The programs that :meth:`draw` will use, so that their uniforms can be set once."""
        _, prepared = self._prepared(planned, stages, visibility, options)
        return list({id(program): program for _, program, _ in prepared}.values())

    def _prepared(self, planned: Planned, stages, visibility: int, options) -> tuple[DrawList, list[tuple]]:
        """The draw list, and (material, program, vertex array) of each of its batches; kept with the pass."""
        full, units, only = options["full"], options["units"], options.get("only", "")
        draws = self._draw_list(visibility, opaque_together=not full, only=only)
        key = ("draws", visibility, full, only, tuple(sorted(options.get("defines", {}).items())))
        cached = planned.programs.get(key)
        if cached is not None and cached[0] is draws and all(self._vaos.get(k) is v for k, v in cached[2]):
            return draws, cached[1]
        out, vaos = [], []
        for material in draws.materials:
            compiled = self.compiled[material] if material >= 0 else None
            program = self._program(planned, stages, compiled, units, options.get("defines", {}))
            attributes = tuple(compiled.attributes[:_MAX_ATTRIBUTES]) if compiled else ()
            vkey, vao = self._vao(program, attributes)
            out.append((material, program, vao))
            vaos.append((vkey, vao))
        planned.programs[key] = (draws, out, vaos)
        return draws, out

    def _program(self, planned, stages, compiled: CompiledGraph | None, units: int, defines):
        with_material = compiled is not None
        glsl = compiled.glsl if compiled else ""
        object_space = any(word in glsl for word in _OBJECT_SPACE)
        defines = {
            **planned.defines(),
            **defines,
            "SURFACE_FULL": int(with_material),
            "SURFACE_DEPTH": int(not with_material),
            "SURFACE_OBJECT_SPACE": int(object_space),
            "SURFACE_ATTRIBUTES": min(len(compiled.attributes), _MAX_ATTRIBUTES) if compiled else 0,
            "SURFACE_TRANSPARENT": int(bool(compiled and (compiled.transparent or compiled.transmissive))),
        }
        virtual = {**GENERATED, "generated/material.glsl": ""}
        if with_material:
            virtual["generated/material.glsl"] = material_source(compiled, units)
        return self.gl.program(
            planned.title,
            stages,
            prelude={"vertex": "", "fragment": planned.prelude("fragment")},
            defines=defines,
            virtual=virtual,
        )

    def _draw_list(self, visibility: int, *, opaque_together: bool, only: str = "") -> DrawList:
        """Indirect commands of what ``visibility`` rays see; ``only`` names a flag that a material must have."""
        key = (visibility, opaque_together, only)
        if key in self._draws:
            return self._draws[key]
        rows: list[tuple] = []
        boxes: list[np.ndarray] = []
        bits: list[int] = []
        materials: dict[int, None] = {}
        for mesh_index, used, seen, first_instance, count in self._groups:
            if not seen & visibility or not used:
                continue
            base, start = int(self._base_vertex[mesh_index]), int(self._first_index[mesh_index])
            for slot, first, triangles, box in self._chunks[mesh_index]:
                material = used[min(slot, len(used) - 1)]
                compiled = self.compiled[material]
                if only and not getattr(compiled, only):
                    continue
                if opaque_together and not (compiled.transparent or compiled.transmissive):
                    material = -1
                materials[material] = None
                rows.append((material, 3 * triangles, count, start + 3 * first, base, first_instance))
                boxes.append(self._group_box(box, first_instance, count))
                bits.append(seen)
        order = sorted(materials)
        table = np.array(rows, "i8").reshape(-1, 6)
        batch = np.searchsorted(order, table[:, 0]) if order else np.zeros(0, "i8")
        sort = np.argsort(batch, kind="stable")
        box = np.array(boxes, "f8").reshape(-1, 2, 3)[sort]
        commands = table[sort, 1:].astype("u4")
        buffer = self.gl.buffer("scene draw commands", size=max(1, len(commands)) * 20)
        self._draws[key] = DrawList(
            commands, order, batch[sort], box.mean(axis=1), (box[:, 1] - box[:, 0]) / 2.0, np.array(bits, "i8")[sort], buffer
        )
        return self._draws[key]

    def _group_box(self, box: np.ndarray, first: int, count: int) -> np.ndarray:
        """World box (2, 3) of a mesh part placed by ``count`` instances."""
        matrix = self._scene.instances.matrix[self._order[first : first + count]]
        center, half = box.mean(axis=0), (box[1] - box[0]) / 2.0
        world_center = matrix[:, :3, :3] @ center + matrix[:, :3, 3]
        world_half = np.abs(matrix[:, :3, :3]) @ half
        return np.stack([(world_center - world_half).min(axis=0), (world_center + world_half).max(axis=0)])

    def _vao(self, program, attributes: tuple[str, ...]):
        key = (program.glo, attributes)
        if key not in self._vaos:
            content = [(self._buffers["positions"], "3f", "in_position")]
            if "in_normal" in program:
                content.append((self._buffers["normals"], "4i2", "in_normal"))
            for slot, name in enumerate(attributes):
                if f"in_attribute_{slot}" in program:
                    width = self._streams[name].size // 4 // max(1, self._buffers["positions"].size // 12)
                    content.append((self._streams[name], f"{width}f", f"in_attribute_{slot}"))
            formats, names = [], []
            for part, name in zip(_INSTANCE_FORMAT.removesuffix("/i").split(), _INSTANCE_NAMES, strict=True):
                if name in program:
                    formats.append(part)
                    names.append(name)
                else:
                    formats.append(f"{4 * int(part[0])}x")
            content.append((self._buffers["instances"], " ".join(formats) + "/i", *names))
            self._vaos[key] = self.gl.ctx.vertex_array(program, content, self._buffers["indices"])
        return key, self._vaos[key]

    def _bind_material(self, material: int, units: int) -> None:
        offset, size = self._param_ranges[material]
        self._buffers["params"].bind_to_uniform_block(_PARAMS_BINDING, offset=offset, size=size)
        self.bind_images(self.compiled[material], units)

    def bind_images(self, compiled: CompiledGraph, units: int) -> None:
        """Bind a graph's images from texture unit ``units`` on."""
        for slot, (index, (interpolation, extension)) in enumerate(
            zip(compiled.images, compiled.samplers, strict=True)
        ):
            texture = self._textures[self._scene.images[index].uid]
            self._sampler(interpolation, extension).use(units + slot)
            texture.use(units + slot)

    def unbind_images(self, units: int, count: int) -> None:
        """Take sampler objects off the units again: they would override later textures' own modes."""
        if count:
            self.gl.ctx.clear_samplers(units, units + count)

    def bind_world_params(self) -> None:
        """Bind the world's parameters in place of a material's."""
        self._buffers["world_params"].bind_to_uniform_block(_PARAMS_BINDING)

    def _sampler(self, interpolation: str, extension: str) -> moderngl.Sampler:
        key = (interpolation == "Closest", extension)
        if key not in self._samplers:
            sampler = self.gl.ctx.sampler()
            sampler.filter = (
                (moderngl.NEAREST, moderngl.NEAREST)
                if key[0]
                else (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
            )
            if not key[0]:
                sampler.anisotropy = _ANISOTROPY
            sampler.repeat_x = sampler.repeat_y = extension == "REPEAT"
            self._samplers[key] = sampler
        return self._samplers[key]

    def close(self) -> None:
        """Free all GPU memory of this scene."""
        self.gl.release(*self._buffers.values(), *self._textures.values(), *(d.buffer for d in self._draws.values()))
        self._drop_vaos()
        self.__init__(self.gl)


def _chunks(mesh: Mesh, split: bool) -> tuple[np.ndarray, list[tuple[int, int, int, np.ndarray]]]:
    """A mesh's triangles in drawing order, and its parts: (slot, first triangle, count, box (2, 3) in object space)."""
    parts: list[tuple[int, int, int, np.ndarray]] = []
    triangles = mesh.triangles
    split = split and len(triangles) > 2 * _CHUNK_TRIANGLES
    if split:
        triangles = triangles.copy()
    for slot, first, count in mesh.slots.tolist():
        if not split or count <= _CHUNK_TRIANGLES:
            parts.append((slot, first, count, mesh.bounds))
            continue
        chunk = triangles[first : first + count]
        centroid = mesh.positions[chunk].mean(axis=1)
        order = np.argsort(_morton(centroid, mesh.bounds), kind="stable")
        triangles[first : first + count] = chunk = chunk[order]
        for start in range(0, count, _CHUNK_TRIANGLES):
            points = mesh.positions[chunk[start : start + _CHUNK_TRIANGLES].reshape(-1)]
            box = np.stack([points.min(axis=0), points.max(axis=0)]).astype("f8")
            parts.append((slot, first + start, min(_CHUNK_TRIANGLES, count - start), box))
    return triangles, parts


def _morton(points: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """Z-order codes of points in a box, 10 bits an axis."""
    size = np.where(bounds[1] > bounds[0], bounds[1] - bounds[0], 1.0)
    cell = np.clip((points - bounds[0]) / size * 1023.0, 0, 1023).astype(np.uint32)
    for shift, mask in ((16, 0x030000FF), (8, 0x0300F00F), (4, 0x030C30C3), (2, 0x09249249)):
        cell = (cell | (cell << np.uint32(shift))) & np.uint32(mask)
    return cell[:, 0] | (cell[:, 1] << np.uint32(1)) | (cell[:, 2] << np.uint32(2))


def material_source(compiled: CompiledGraph, units: int) -> str:
    """``generated/material.glsl`` of a surface: its images, parameters, attributes and function."""
    lines = ["#define WORLD_SUN_DISC 1", "#define SURFACE_IMPLICIT_LOD 1", *_param_lines(compiled)]
    lines += _image_lines(compiled, units)
    for slot in range(len(compiled.attributes)):
        if slot < _MAX_ATTRIBUTES:
            lines.append(f"in vec4 vary_attribute_{slot};")
            lines.append(f"#define attribute_value_{slot} vary_attribute_{slot}")
        else:
            lines.append(f"const vec4 attribute_value_{slot} = vec4(0.0);")
    lines += ['#include "nodes/closures.glsl"', '#include "nodes/math.glsl"', '#include "nodes/color.glsl"',
              '#include "nodes/texture.glsl"', '#include "nodes/normal.glsl"', *_includes(compiled), compiled.glsl]  # fmt: skip
    return "\n".join(lines)


def world_source(compiled: CompiledGraph, units: int, *, camera: bool, sun_disc: bool = True) -> str:
    """``generated/world.glsl``: ``vec3 world_radiance(vec3 direction_ws)``, as the ``camera`` sees it or as what it lights
    does; without ``sun_disc`` it leaves out suns that are lights of their own."""
    # Worlds are evaluated in compute shaders.
    lines = [f"#define WORLD_SUN_DISC {int(sun_disc)}", "#define SURFACE_IMPLICIT_LOD 0",
             f"#define SURFACE_SEEN_BY_CAMERA {int(camera)}", "#define SURFACE_SEEN_BY_SHADOW 0",
             *_param_lines(compiled)]  # fmt: skip
    lines += _image_lines(compiled, units)
    lines += ['#include "lib/surface_lib.glsl"', '#include "nodes/math.glsl"', '#include "nodes/color.glsl"',
              '#include "nodes/texture.glsl"', *_includes(compiled), compiled.glsl]  # fmt: skip
    return "\n".join(lines)


def _includes(compiled: CompiledGraph) -> list[str]:
    macros = [f"#define {name} {value}" for name, value in sorted(compiled.macros.items())]
    return macros + [f'#include "{path}"' for path in compiled.includes]


def _param_block(compiled: CompiledGraph) -> bytes:
    """A graph's parameters as the contents of its uniform block: whole vec4s, at least one."""
    values = np.array(compiled.params, "f4")
    return np.concatenate([values, np.zeros(-len(values) % 4 if len(values) else 4, "f4")]).tobytes()


def _param_lines(compiled: CompiledGraph) -> list[str]:
    count = max(1, -(-len(compiled.params) // 4))
    return [
        f"layout(std140, binding = {_PARAMS_BINDING}) uniform material_block {{ vec4 material_params[{count}]; }};",
        "float material_param(int i) { return material_params[i >> 2][i & 3]; }",
    ]


def _image_lines(compiled: CompiledGraph, units: int) -> list[str]:
    return [
        f"layout(binding = {units + slot}) uniform sampler2D material_image_{slot};"
        for slot in range(len(compiled.images))
    ]


def _attribute(mesh: Mesh, name: str) -> np.ndarray | None:
    """A mesh's data for an attribute name of the compiler; None where it has none."""
    kind, _, layer = name.partition(":")
    attributes = mesh.attributes
    if kind == "uv":
        return attributes.get(f"uv:{layer or mesh.active_uv}")
    if kind == "color":
        return attributes.get(f"color:{layer or mesh.active_color}")
    for prefix in ("attr", "color", "uv"):
        if f"{prefix}:{layer}" in attributes:
            return attributes[f"{prefix}:{layer}"]
    return None


