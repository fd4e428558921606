# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's dependency graph to a plain Scene.

Only in ``update()`` and the like may Blender's data be read; what comes out holds none of it. Nothing evaluated is kept
past the loop. Meshes, materials and images that did not change since the last sync are the same objects as then.
"""

from __future__ import annotations

import math
from dataclasses import fields, replace

import bpy
import numpy as np

from ..materials import mean_emission
from ..scene import (
    CAMERA,
    CATCHER,
    DIFFUSE,
    GLOSSY,
    HOLDOUT,
    POINTINESS,
    SHADOW,
    TRANSMISSION,
    VOLUME,
    Camera,
    Image,
    Instances,
    Light,
    Link,
    Material,
    Mesh,
    Scene,
    ShaderGraph,
    World,
    new_uid,
)
from . import attributes, strands
from .compat import uses_nodes
from .linking import Linking
from .materials import ImageTable, default_material, holdout_material, read_light, read_material, read_world, world_sun

_MESH_LIKE = {"MESH", "CURVE", "SURFACE", "FONT", "META", "CURVES"}
_RAYS = (("visible_camera", CAMERA), ("visible_diffuse", DIFFUSE), ("visible_glossy", GLOSSY),
         ("visible_transmission", TRANSMISSION), ("visible_volume_scatter", VOLUME),
         ("visible_shadow", SHADOW))  # fmt: skip


# Nodes of lights whose mean is their value.
_LIGHT_NUMBERS = {"EMISSION", "RGB", "VALUE", "BLACKBODY", "LIGHT_FALLOFF", "MATH", "ADD_SHADER", "MIX_SHADER", "MIX", "MIX_RGB"}


class SceneSync:
    """Keeps what the next sync can use again. ``counts`` says what the last one really read."""

    def __init__(self) -> None:
        self._meshes: dict[tuple, Mesh] = {}
        self._materials: dict[int, Material] = {}
        self._material_images: dict[int, list[tuple[int, Image]]] = {}
        self._images: dict[int, tuple[tuple, Image]] = {}
        self._world: tuple[World, list[Image]] | None = None
        self._default = default_material()
        self._ball: Mesh | None = None
        self._hairs: dict[tuple, list[tuple[Mesh, int]]] = {}
        self._variants: dict[tuple, tuple[Material, Material]] = {}
        self.counts: dict[str, int] = {}

    def forget(self) -> None:
        """Drop everything kept: after undo, file load, or when in doubt."""
        self.__init__()

    def invalidate(self, depsgraph: bpy.types.Depsgraph) -> bool:
        """Drop what the depsgraph's updates say has changed. Whether anything has that a picture may show: selecting is
        an update too, but one of nothing."""
        changed = False
        for update in depsgraph.updates:
            data = update.id
            if isinstance(data, bpy.types.Object):
                changed |= update.is_updated_geometry or update.is_updated_transform or update.is_updated_shading
                if update.is_updated_geometry:
                    uid = data.original.session_uid
                    self._meshes = {k: v for k, v in self._meshes.items() if k[0] != uid}
                    self._hairs = {k: v for k, v in self._hairs.items() if k[0] != uid}
                continue
            # Node trees are read again anyway and compared. A scene or collection may have lost or hidden objects.
            changed = True
            if isinstance(data, bpy.types.Image):
                self._images.pop(data.original.session_uid, None)
            elif update.is_updated_geometry:  # a mesh, curve … that several objects may use
                self._meshes = {k: v for k, v in self._meshes.items() if k[1] != data.name_full}
        return changed

    def read(
        self,
        depsgraph: bpy.types.Depsgraph,
        *,
        camera: Camera | None = None,
        resolution: tuple[int, int] | None = None,
        keep: bool = False,
        space: bpy.types.SpaceView3D | None = None,
    ) -> Scene:
        """The Scene of ``depsgraph``. ``camera`` overrides the scene's own; ``resolution`` sets its aspect; with
        ``keep`` meshes and materials of the last sync are trusted unless :meth:`invalidate` dropped them. ``space`` is a
        3D view with a local view or collections of its own: only what it shows counts."""
        if not keep:
            self._meshes.clear()
            self._hairs.clear()
            self._materials.clear()
            self._world = None
        self.counts = {"meshes": 0, "materials": 0}
        source = depsgraph.scene_eval
        scene = Scene(name=source.name, frame=source.frame_current)
        images = ImageTable(self._images, scene.notes)
        layer = depsgraph.view_layer
        materials = _MaterialIndex(self, images, scene, depsgraph)
        placed = _Placed(Linking(depsgraph, scene.notes), depsgraph.view_layer)
        lamps: list[tuple[Light, bpy.types.Object]] = []
        meshes: dict[tuple, int] = {}
        by_pointer: dict[int, int] = {}
        used_keys: set[tuple] = set()
        for instance in depsgraph.object_instances:
            obj = instance.object
            if not (instance.show_self or instance.is_instance):
                continue
            if space is not None and not _shown_in(instance, space):
                continue
            if obj.type == "LIGHT":
                light = _read_light(instance, obj, scene.notes, images)
                if light is not None:
                    scene.lights.append(light)
                    lamps.append((light, obj.original))
                continue
            if obj.type not in _MESH_LIKE:
                if obj.type == "POINTCLOUD":
                    self._points(instance, obj, scene, materials, placed)
                elif obj.type in ("VOLUME", "GREASEPENCIL"):
                    _note(scene, f"{obj.type.capitalize()} objects are not rendered yet ({obj.name})")
                continue
            if obj.particle_systems and not instance.is_instance:
                self._hair(obj, scene, materials, placed, depsgraph)
            matrix = np.array(instance.matrix_world, dtype="f8")
            if not np.isfinite(matrix).all():
                _note(scene, f"object {obj.name} is left out: its transform is not a number")
                continue
            slots = [slot.material for slot in obj.material_slots] or list(getattr(obj.data, "materials", [])) or [None]
            pointy = any(materials.asks(m)[1] for m in slots)
            index = self._mesh_index(obj, scene, meshes, by_pointer, used_keys, pointy)
            if index is None:
                continue
            visibility = placed.visibility(obj, instance)
            carried = materials.carried(slots) if instance.is_instance else None
            color = tuple(obj.color) if carried is None else materials.values((carried,), instance, obj)[0]
            held = bool(visibility & HOLDOUT)
            placed.add(index, matrix, tuple(materials.placed(m, instance, obj, held, carried) for m in slots),
                       visibility, _random(instance, obj), obj.pass_index, color)  # fmt: skip
        self._meshes = {k: v for k, v in self._meshes.items() if k in used_keys}
        for light, obj in lamps:
            light.receivers, light.blockers = placed.linking.masks(obj)
        scene.instances = placed.instances()
        sky = (getattr(layer, "world_override", None) or source.world) if layer.use_sky else None
        scene.world = self._read_world(sky, images)
        sun = world_sun(scene.world.graph)
        if sun is not None and (sun.emission > 0.0).any():
            scene.lights.append(sun)
        scene.images = images.images
        scene.camera = camera or _read_camera(source, depsgraph, resolution, scene.notes)
        return scene

    def _read_world(self, source: bpy.types.World | None, images: ImageTable) -> World:
        """The world; the same object as last time if it looks the same."""
        world = read_world(source, images)
        used = [images.images[n.params["image"]] for n in world.graph.nodes if n.params.get("image") is not None]
        if self._world is not None:
            old, old_images = self._world
            if used == old_images and all(
                getattr(old, f.name) == getattr(world, f.name) for f in fields(world) if f.name != "uid"
            ):
                return old
        self._world = (world, used)
        return world

    def _points(self, instance, obj, scene: Scene, materials, placed) -> None:
        """A point cloud: one ball, placed at every point."""
        at, radii = strands.points_of(obj)
        if not len(at):
            return
        if self._ball is None:
            self._ball = strands.ball()
        if self._ball not in scene.meshes:
            scene.meshes.append(self._ball)
        index = scene.meshes.index(self._ball)
        slots = [slot.material for slot in obj.material_slots] or [None]
        used, visibility = tuple(materials.index(m) for m in slots), placed.visibility(obj, instance)
        world = np.array(instance.matrix_world, "f8")
        for place, radius in zip(at, radii, strict=True):
            matrix = np.eye(4)
            matrix[:3, :3] *= radius
            matrix[:3, 3] = place
            placed.add(index, world @ matrix, used, visibility, _random(instance, obj), obj.pass_index, tuple(obj.color))

    def _hair(self, obj, scene: Scene, materials, placed, depsgraph) -> None:
        """The hair of an object's particle systems, each a mesh of its own in world space."""
        key = (obj.original.session_uid, "", "HAIR")
        found = self._hairs.get(key)
        if found is None:
            try:
                found = strands.particle_meshes(obj, depsgraph.mode == "RENDER")
            except RuntimeError as error:
                _note(scene, f"the hair of {obj.name} is left out: {error}")
                return
            self._hairs[key] = found
        for mesh, slot in found:
            scene.meshes.append(mesh)
            slots = [s.material for s in obj.material_slots] or [None]
            material = materials.index(slots[min(slot, len(slots) - 1)])
            placed.add(len(scene.meshes) - 1, np.eye(4), (material,), placed.visibility(obj), 0.0,
                       obj.pass_index, tuple(obj.color))  # fmt: skip

    # -- meshes --------------------------------------------------------------------------------------------------

    def _mesh_index(self, obj, scene: Scene, meshes, by_pointer, used_keys, pointy: bool) -> int | None:
        """Index of the object's evaluated mesh among the scene's, ``pointy`` with pointiness; None if it has no triangles."""
        data = obj.data
        pointer = (data.as_pointer() if data is not None else 0, pointy)
        if obj.type == "MESH" and pointer in by_pointer:
            return by_pointer[pointer]
        # One object can bring several meshes (Geometry Nodes instances): the data's name tells them apart.
        key = (obj.original.session_uid, data.name_full if data is not None else "", obj.type, pointy)
        if key in meshes and obj.type != "MESH":
            return meshes[key]
        mesh = self._meshes.get(key)
        if mesh is None:
            try:
                mesh = _read_object_mesh(obj, scene, pointy)
            except Exception as error:  # one damaged mesh must not cost the picture
                _note(scene, f"object {obj.name} is left out: its mesh can't be read ({type(error).__name__}: {error})")
                return None
            self.counts["meshes"] += 1
            if mesh is None:
                return None
            self._meshes[key] = mesh
        used_keys.add(key)
        if mesh.empty:
            return None
        if mesh not in scene.meshes[-1:]:
            scene.meshes.append(mesh)
        index = len(scene.meshes) - 1
        meshes[key] = index
        if obj.type == "MESH":
            by_pointer[pointer] = index
        return index


class _MaterialIndex:
    """Indices of Blender's materials in the scene's list, filled as they are met. A variant is a material of its own, but
    has the program of the one it comes from where only numbers differ. The view layer may put one on every surface."""

    def __init__(self, sync: SceneSync, images: ImageTable, scene: Scene, depsgraph: bpy.types.Depsgraph) -> None:
        self.sync, self.images, self.scene, self.depsgraph = sync, images, scene, depsgraph
        self.override = depsgraph.view_layer.material_override
        self._index: dict[tuple, int] = {}
        self._read: dict[int, Material] = {}
        self._asked: dict[int, tuple] = {}
        self._given = attributes.PlacedAttributes()

    def index(self, material: bpy.types.Material | None) -> int:
        """Index of a material, attributes of objects being 0."""
        return self._variant(self.override or material, False, ())

    def placed(
        self, material: bpy.types.Material | None, instance, obj: bpy.types.Object, held: bool,
        carried: attributes.Name | None = None,
    ) -> int:  # fmt: skip
        """Index of a material as ``obj`` wears it; ``held``: of its variant that the camera sees as a hole; ``carried``: the
        attribute that the instance brings itself."""
        material = self.override or material
        names = self.asks(material)[0]
        if carried is not None and self.asks(material)[2] == carried:
            return self._variant(material, held, (), carried=True)
        return self._variant(material, held, self.values(names, instance, obj) if names else ())

    def values(self, names: tuple[attributes.Name, ...], instance, obj: bpy.types.Object) -> tuple[attributes.Color, ...]:
        """What the attributes ``names`` are for a placed object."""
        return attributes.values_of(names, instance, obj, self.depsgraph, self._given)

    def carried(self, slots: list) -> attributes.Name | None:
        """The attribute that an instance with these materials brings itself, in place of its colour."""
        asked = [self.asks(m) for m in slots]
        return None if any(a[3] for a in asked) else next((a[2] for a in asked if a[2] is not None), None)

    def asks(self, material: bpy.types.Material | None) -> tuple[tuple[attributes.Name, ...], bool, attributes.Name | None, bool]:
        """What a material wants to know of the object that wears it: attributes, whether pointiness, the attribute that
        instances can carry, and whether the object's colour."""
        material = self.override or material
        key = _uid(material)
        if key not in self._asked:
            graph = self._get(material).graph
            coloured = graph.reads("OBJECT_INFO", "Color") or graph.reads("OBJECT_INFO", "Alpha")
            self._asked[key] = (attributes.asked_of_objects(graph), graph.reads("NEW_GEOMETRY", "Pointiness"),
                                attributes.carried(graph), coloured)  # fmt: skip
        return self._asked[key]

    def _variant(self, material, held: bool, values: tuple, carried: bool = False) -> int:
        key = (_uid(material), held, values, carried)
        if key not in self._index:
            found = self._get(material)
            if held or values or carried:
                old = self.sync._variants.get(key)
                if old is None or old[0] is not found:
                    old = self.sync._variants[key] = (found, _made_variant(found, held, values, carried))
                found = old[1]
            self._index[key] = len(self.scene.materials)
            self.scene.materials.append(found)
        return self._index[key]

    def _get(self, material) -> Material:
        key = _uid(material)
        if key not in self._read:
            self._read[key] = self._fetch(material, key)
        return self._read[key]

    def _fetch(self, material, key: int) -> Material:
        if material is None:
            return self.sync._default
        # Graphs refer to images by index, so a kept material is good only while its images keep theirs; reading a
        # graph is cheap beside reading pixels, which the image cache spares.
        fresh = read_material(material, self.images)
        old = self.sync._materials.get(key)
        if old is not None and old.graph == fresh.graph and self._same_images(old, key):
            return old
        self.sync.counts["materials"] += 1
        self.sync._materials[key] = fresh
        self.sync._material_images[key] = self._images_of(fresh)
        return fresh

    def _images_of(self, material: Material) -> list:
        indices = [n.params["image"] for n in material.graph.nodes if n.params.get("image") is not None]
        return [(i, self.images.images[i]) for i in indices]

    def _same_images(self, material: Material, key: int) -> bool:
        return self._images_of(material) == self.sync._material_images.get(key)


def _uid(material: bpy.types.Material | None) -> int:
    return material.original.session_uid if material is not None else 0


def _made_variant(material: Material, held: bool, values: tuple, carried: bool) -> Material:
    if carried:
        material = replace(material, graph=attributes.with_carried(material.graph), uid=new_uid())
    if values:
        material = replace(material, graph=attributes.with_values(material.graph, values), uid=new_uid())
    return holdout_material(material) if held else material


class _Placed:
    """Instances being collected."""

    def __init__(self, linking: Linking, layer: bpy.types.ViewLayer) -> None:
        self.rows: list[tuple] = []
        self.linking, self.layer = linking, layer

    def visibility(self, obj: bpy.types.Object, instance: bpy.types.DepsgraphObjectInstance | None = None) -> int:
        """Visibility bits of an object; what an instancer places is lit as that is."""
        placed_by = instance.parent if instance is not None and instance.is_instance else None
        return _visibility(obj, self.layer) | self.linking.bits(placed_by or obj)

    def add(self, *row) -> None:
        self.rows.append(row)

    def instances(self) -> Instances:
        if not self.rows:
            return Instances.make([], np.zeros((0, 4, 4)), [])
        mesh, matrix, materials, visibility, random, index, color = zip(*self.rows, strict=True)
        return Instances.make(mesh, np.array(matrix), materials, visibility=visibility, random=random, index=index,
                              color=color)  # fmt: skip


def _shown_in(instance, space: bpy.types.SpaceView3D) -> bool:
    """Whether a 3D view's local view and collections show an instance; its instancer decides for it."""
    obj = instance.parent if instance.is_instance and instance.parent is not None else instance.object
    return bool(obj.original.visible_in_viewport_get(space))


def share_meshes(scene: Scene, before: Scene | None) -> None:
    """Take over the meshes of ``before`` that look the same in ``scene``, which then are not sent to the GPU again."""
    if before is None:
        return
    old = {mesh.name: mesh for mesh in before.meshes}
    for i, mesh in enumerate(scene.meshes):
        same = old.get(mesh.name)
        if same is not None and _same_mesh(mesh, same):
            scene.meshes[i] = same


def _same_mesh(a: Mesh, b: Mesh) -> bool:
    arrays = [(a.positions, b.positions), (a.triangles, b.triangles), (a.slots, b.slots), (a.normals, b.normals)]
    if a.attributes.keys() != b.attributes.keys():
        return False
    arrays += [(a.attributes[k], b.attributes[k]) for k in a.attributes]
    return all(x.shape == y.shape and np.array_equal(x, y) for x, y in arrays)


def _note(scene: Scene, text: str) -> None:
    if text not in scene.notes:
        scene.notes.append(text)


def _random(instance: bpy.types.DepsgraphObjectInstance, obj: bpy.types.Object) -> float:
    """Object Info's Random in [0, 1]: Blender's own number for instances, for others Cycles' hash of the name."""
    if instance.is_instance:
        return (instance.random_id & 0xFFFFFFFF) / 0xFFFFFFFF  # Blender shows 32 bits as a number with a sign
    key = 0
    for byte in obj.name.encode():
        key = (key * 37 + byte) & 0xFFFFFFFF
    return _lookup3(key, 0) / 0xFFFFFFFF


def _lookup3(x: int, y: int) -> int:
    """R. Jenkins' lookup3 of two 32-bit words, as in ``glsl/nodes/hash.glsl``."""
    mask = 0xFFFFFFFF

    def rotated(v: int, k: int) -> int:
        return (v << k | v >> (32 - k)) & mask

    c = 0xDEADBEEF + (2 << 2) + 13
    v = [(c + x) & mask, (c + y) & mask, c & mask]
    for target, source, k in ((2, 1, 14), (0, 2, 11), (1, 0, 25), (2, 1, 16), (0, 2, 4), (1, 0, 14), (2, 1, 24)):
        v[target] = ((v[target] ^ v[source]) - rotated(v[source], k)) & mask
    return v[2]


def _visibility(obj: bpy.types.Object, layer: bpy.types.ViewLayer) -> int:
    """Bits of the rays that see an object, by itself and by its collections in the view layer."""
    bits = sum(bit for name, bit in _RAYS if getattr(obj, name, True))
    original = obj.original
    if original.indirect_only_get(view_layer=layer):
        bits &= ~CAMERA
    if obj.is_holdout or original.holdout_get(view_layer=layer):
        bits |= HOLDOUT
    if obj.is_shadow_catcher:
        bits |= CATCHER
    return bits


def _read_object_mesh(obj: bpy.types.Object, scene: Scene, pointy: bool) -> Mesh | None:
    """The evaluated mesh of an object, whatever it is made from; ``pointy`` with pointiness."""
    # In edit mode the evaluated mesh is still the editor's, without arrays: to_mesh() makes them.
    if obj.type == "MESH" and obj.mode != "EDIT":
        return read_mesh(obj.data, obj.name, pointy)
    if obj.type == "CURVES":
        return strands.curves_mesh(obj)
    try:
        mesh = obj.to_mesh()
    except RuntimeError as error:
        _note(scene, f"object {obj.name} is left out: {error}")
        return None
    if mesh is None:
        return None
    try:
        return read_mesh(mesh, obj.name, pointy)
    finally:
        obj.to_mesh_clear()


def _get(attribute, kind: str, dtype: str, width: int) -> np.ndarray:
    out = np.empty(len(attribute.data) * width, dtype)
    attribute.data.foreach_get(kind, out)
    return out.reshape(-1, width) if width > 1 else out


def read_mesh(mesh: bpy.types.Mesh, name: str, pointy: bool = False) -> Mesh:
    """Triangles with split vertices from a Blender mesh, by the bulk accessors with matching types; ``pointy`` with
    pointiness as an attribute."""
    triangle_count = len(mesh.loop_triangles)
    if triangle_count == 0 and len(mesh.polygons):
        mesh.calc_loop_triangles()
        triangle_count = len(mesh.loop_triangles)
    if triangle_count == 0:
        return Mesh(name, np.zeros((0, 3), "f4"), np.zeros((0, 3), "f4"), np.zeros((0, 3), "u4"), np.zeros((0, 3), "i8"))
    positions = _positions(mesh)
    corner_vertex = _corner_vertices(mesh)
    triangles = np.empty(triangle_count * 3, np.uint32)
    mesh.loop_triangles.foreach_get("loops", triangles)
    triangles = triangles.reshape(-1, 3)
    normals = np.empty(len(corner_vertex) * 3, np.float32)
    mesh.corner_normals.foreach_get("vector", normals)
    normals = normals.reshape(-1, 3)

    corner: dict[str, np.ndarray] = {}
    for layer in mesh.uv_layers:
        attribute = mesh.attributes.get(layer.name)
        if attribute is not None and attribute.domain == "CORNER":
            corner[f"uv:{layer.name}"] = _get(attribute, "vector", "f4", 2)
    for attribute in mesh.attributes:
        if attribute.name.startswith(".") or attribute.name == "position" or attribute.name in mesh.uv_layers:
            continue
        values = _read_attribute(attribute)
        if values is None:
            continue
        if attribute.domain == "POINT":
            values = values[corner_vertex]
        elif attribute.domain == "FACE":
            per_face = np.empty(triangle_count, np.int32)
            mesh.loop_triangle_polygons.foreach_get("value", per_face)
            faces = np.zeros(len(corner_vertex), np.int32)
            faces[triangles.reshape(-1)] = np.repeat(per_face, 3)
            values = values[faces]
        elif attribute.domain != "CORNER":
            continue
        color = attribute.data_type in ("FLOAT_COLOR", "BYTE_COLOR")
        corner[f"{'color' if color else 'attr'}:{attribute.name}"] = values

    if pointy:
        corner[f"attr:{POINTINESS}"] = np.repeat(attributes.pointiness(mesh)[corner_vertex][:, None], 3, axis=1)
    positions, normals, corner, triangles = _weld(positions, corner_vertex, normals, corner, triangles)
    slots, triangles = _by_material(mesh, triangles, triangle_count)
    render_uv = next((layer.name for layer in mesh.uv_layers if layer.active_render), "")
    colors = mesh.color_attributes
    index = colors.render_color_index if len(colors) else -1
    render_color = colors[index].name if 0 <= index < len(colors) else ""
    return Mesh(name, positions, normals, triangles, slots, corner, render_uv, render_color)


def _positions(mesh: bpy.types.Mesh) -> np.ndarray:
    """Vertex positions (V, 3): by attribute, which is 17 times faster, where the mesh has it under its name."""
    attribute = mesh.attributes.get("position")
    if attribute is not None and attribute.data_type == "FLOAT_VECTOR" and len(attribute.data) == len(mesh.vertices):
        return _get(attribute, "vector", "f4", 3)
    out = np.empty(len(mesh.vertices) * 3, np.float32)
    mesh.vertices.foreach_get("co", out)
    return out.reshape(-1, 3)


def _corner_vertices(mesh: bpy.types.Mesh) -> np.ndarray:
    attribute = mesh.attributes.get(".corner_vert")
    if attribute is not None and len(attribute.data) == len(mesh.loops):
        return _get(attribute, "value", "i4", 1)
    out = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", out)
    return out


def _read_attribute(attribute: bpy.types.Attribute) -> np.ndarray | None:
    kinds = {"FLOAT": ("value", "f4", 1), "FLOAT_VECTOR": ("vector", "f4", 3), "FLOAT_COLOR": ("color", "f4", 4),
             "BYTE_COLOR": ("color", "f4", 4), "FLOAT2": ("vector", "f4", 2), "INT": ("value", "i4", 1),
             "BOOLEAN": ("value", "?", 1)}  # fmt: skip
    kind = kinds.get(attribute.data_type)
    if kind is None or attribute.name in ("material_index", "sharp_face", "sharp_edge"):
        return None
    values = _get(attribute, *kind)
    if values.ndim == 1:
        values = np.repeat(values[:, None], 3, axis=1)
    return np.ascontiguousarray(values, np.float32)


def _weld(positions, corner_vertex, normals, corner, triangles):
    """Corners to vertices: all corners of a vertex that agree with its first one share it, the others get their own.

    Linear in time, which a sort of all corners is not; on smooth meshes nearly all agree.
    """
    count = len(corner_vertex)
    first = np.zeros(len(positions), np.int64)
    first[corner_vertex[::-1]] = np.arange(count - 1, -1, -1)
    lead = first[corner_vertex]
    same = np.ones(count, bool)
    # Normals of one smooth vertex differ by rounding only.
    same &= (np.abs(normals - normals[lead]) < 1e-5).all(axis=1)
    for values in corner.values():
        same &= (values == values[lead]).all(axis=1)
    used = np.zeros(count, bool)
    used[triangles.reshape(-1)] = True
    used[lead[used]] = True
    keep = np.flatnonzero(used & (~same | (np.arange(count) == lead)))
    slot = np.full(count, -1, np.int64)
    slot[keep] = np.arange(len(keep))
    slot = np.where(same, slot[lead], slot)
    return (
        np.ascontiguousarray(positions[corner_vertex[keep]]),
        np.ascontiguousarray(normals[keep]),
        {name: np.ascontiguousarray(values[keep]) for name, values in corner.items()},
        slot[triangles].astype(np.uint32),
    )


def _by_material(mesh, triangles: np.ndarray, triangle_count: int) -> tuple[np.ndarray, np.ndarray]:
    """Sort triangles by material slot: (slot, first, count) rows and the sorted triangles."""
    attribute = mesh.attributes.get("material_index")
    if attribute is None:
        return np.array([[0, 0, triangle_count]]), triangles
    per_polygon = _get(attribute, "value", "i4", 1)
    polygon = np.empty(triangle_count, np.int32)
    mesh.loop_triangle_polygons.foreach_get("value", polygon)
    index = np.maximum(per_polygon[polygon], 0)
    if (index == index[0]).all():
        return np.array([[int(index[0]), 0, triangle_count]]), triangles
    order = np.argsort(index, kind="stable")
    slots, first, counts = np.unique(index[order], return_index=True, return_counts=True)
    return np.stack([slots, first, counts], axis=1), np.ascontiguousarray(triangles[order])


# --- lights and cameras -----------------------------------------------------------------------------------------------


def _read_light(instance, obj: bpy.types.Object, notes: list[str], images: ImageTable) -> Light | None:
    """A Light from Blender's, in Cycles' units; None of a portal, which shows Cycles where the sky is and gives no light."""
    data = obj.data
    if data.type == "AREA" and getattr(data.cycles, "is_portal", False):
        return None
    strength = float(data.energy) * 2.0 ** float(getattr(data, "exposure", 0.0))
    color = np.array(data.color, "f8")
    if getattr(data, "use_temperature", False):
        color = color * np.array(data.temperature_color, "f8")
    falloff = (0.0, 0.0)
    if uses_nodes(data):
        graph = read_light(data, images)
        color = color * _light_nodes(data.name, graph, notes, images)
        falloff = _light_falloff(graph)
    matrix = np.array(instance.matrix_world, "f8")
    scale = [float(np.linalg.norm(matrix[:3, k])) for k in range(3)]
    light = Light(
        obj.name, data.type, color * strength, matrix,
        use_shadow=bool(getattr(data, "use_shadow", True)) and bool(getattr(data.cycles, "cast_shadow", True)),
        visible_camera=bool(obj.visible_camera), visible_diffuse=bool(obj.visible_diffuse),
        visible_glossy=bool(obj.visible_glossy),
    )  # fmt: skip
    if data.type != "SUN":  # from infinitely far away there is none
        light.falloff, light.falloff_smooth = falloff
    if data.type in ("POINT", "SPOT"):
        light.radius = float(data.shadow_soft_size)
        light.soft_falloff = bool(getattr(data, "use_soft_falloff", False))
    if data.type == "SPOT":
        light.spot_size, light.spot_blend = float(data.spot_size), float(data.spot_blend)
    if data.type == "SUN":
        light.angle = float(data.angle)
    if data.type == "AREA":
        light.shape = data.shape
        light.size = (float(data.size), float(data.size_y if data.shape in ("RECTANGLE", "ELLIPSE") else data.size))
        light.spread = float(getattr(data, "spread", math.pi))
    if not getattr(data, "normalize", True):
        light.emission = light.emission * _light_area(light, scale)
    return light


def _light_area(light: Light, scale: list[float]) -> float:
    """What Cycles would have divided by: power per area (area, point, spot) or per solid-angle disc (sun)."""
    if light.kind == "SUN":
        return math.pi * math.sin(0.5 * light.angle) ** 2 if light.angle > 0 else 1.0
    if light.kind == "AREA":
        area = light.size[0] * scale[0] * light.size[1] * scale[1]
        return area * (math.pi / 4.0 if light.shape in ("DISK", "ELLIPSE") else 1.0)
    return math.pi * light.radius**2 * 4.0 if light.radius > 0 else 1.0


def _light_nodes(name: str, graph: ShaderGraph, notes: list[str], images: ImageTable) -> np.ndarray:
    """Colour × strength (3,) of a light's nodes, textures by their mean; a note where they are more than numbers."""
    kinds = {node.kind for node in graph.nodes}
    if kinds - _LIGHT_NUMBERS:
        notes.append(f"light {name}: {', '.join(sorted(kinds - _LIGHT_NUMBERS))} count by their mean")
    return mean_emission(graph, images.images)


def _light_falloff(graph: ShaderGraph) -> tuple[float, float]:
    """(power of the distance, m² that smooth it) by which a light's nodes change its falloff; the first of several counts."""
    for node in graph.nodes:
        for link in node.inputs.values():
            if isinstance(link, Link) and graph.nodes[link.node].kind == "LIGHT_FALLOFF":
                smooth = graph.nodes[link.node].inputs.get("Smooth", 0.0)
                power = {"Linear": 1.0, "Constant": 2.0}.get(link.output, 0.0)
                return power, max(smooth, 0.0) if isinstance(smooth, float) else 0.0
    return 0.0, 0.0


def _read_camera(
    scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph, resolution: tuple[int, int] | None, notes: list[str]
) -> Camera | None:
    obj = scene.camera
    if obj is None or obj.type != "CAMERA":
        return None
    render = scene.render
    width, height = resolution or (render.resolution_x, render.resolution_y)
    projection = obj.calc_matrix_camera(
        depsgraph, x=width, y=height, scale_x=render.pixel_aspect_x, scale_y=render.pixel_aspect_y
    )
    # The camera's own scale does not zoom: only its place and turn count.
    location, rotation, _ = obj.matrix_world.decompose()
    matrix = np.eye(4)
    matrix[:3, :3] = np.array(rotation.to_matrix())
    matrix[:3, 3] = location
    data = obj.data
    if data.type == "PANO":
        notes.append(f"camera {obj.name} is panoramic, which a rasteriser has no projection for; it renders as its "
                     "perspective lens")  # fmt: skip
    result = Camera(matrix, np.array(projection, "f8"), float(data.clip_start), float(data.clip_end), name=obj.name)
    if data.dof.use_dof:
        _read_lens(result, obj, matrix)
    return result


def _read_lens(camera: Camera, obj: bpy.types.Object, matrix: np.ndarray) -> None:
    """Depth of field as Cycles has it: the lens is focal length / f-number wide; for orthographic cameras a metre is that
    length. A focus object counts by its depth along the view."""
    data, dof = obj.data, obj.data.dof
    length = 1.0 if data.type == "ORTHO" else 1e-3 * data.lens
    camera.aperture = 0.5 * length / max(dof.aperture_fstop, 1e-5)
    camera.focus = float(dof.focus_distance)
    if dof.focus_object is not None:
        target = dof.focus_object.matrix_world
        if dof.focus_subtarget and dof.focus_object.pose and dof.focus_subtarget in dof.focus_object.pose.bones:
            target = target @ dof.focus_object.pose.bones[dof.focus_subtarget].matrix
        camera.focus = abs(float((np.array(target.translation) - matrix[:3, 3]) @ matrix[:3, 2]))
    camera.focus = max(camera.focus, 1e-5)
    camera.blades = int(dof.aperture_blades)
    camera.blade_turn = float(dof.aperture_rotation)
    camera.blade_ratio = max(float(dof.aperture_ratio), 1e-5)
