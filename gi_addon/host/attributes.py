# SPDX-License-Identifier: GPL-3.0-or-later
"""What the Attribute and Geometry nodes ask of objects and meshes: custom properties, RNA properties, pointiness."""

from __future__ import annotations

import bpy
import numpy as np

from ..scene import Node, ShaderGraph

# (attribute_type, attribute_name) of an Attribute node that reads no mesh.
Name = tuple[str, str]
Color = tuple[float, float, float, float]


def asked_of_objects(graph: ShaderGraph) -> tuple[Name, ...]:
    """The attributes of objects, instancers and view layers that a graph reads, in the nodes' order."""
    return tuple(
        (n.params["attribute_type"], n.params.get("attribute_name", ""))
        for n in graph.nodes
        if n.kind == "ATTRIBUTE" and n.params.get("attribute_type", "GEOMETRY") != "GEOMETRY"
    )


def with_values(graph: ShaderGraph, values: tuple[Color, ...]) -> ShaderGraph:
    """The graph with these values for :func:`asked_of_objects`."""
    left = list(values)
    nodes = tuple(
        Node(n.kind, n.name, n.inputs, n.params | {"value": left.pop(0)})
        if n.kind == "ATTRIBUTE" and n.params.get("attribute_type", "GEOMETRY") != "GEOMETRY" else n
        for n in graph.nodes
    )  # fmt: skip
    return ShaderGraph(nodes, graph.surface, graph.volume)


def carried(graph: ShaderGraph) -> Name | None:
    """The one attribute of its instancer that a graph asks for: instances then bring its value in place of their colour,
    which such a graph does not read, and share one material."""
    names = set(asked_of_objects(graph))
    if len(names) != 1 or graph.reads("OBJECT_INFO", "Color") or graph.reads("OBJECT_INFO", "Alpha"):
        return None
    name = names.pop()
    return name if name[0] == "INSTANCER" else None


def with_carried(graph: ShaderGraph) -> ShaderGraph:
    """The graph with the value of :func:`carried` read from the instance."""
    nodes = tuple(
        Node(n.kind, n.name, n.inputs, n.params | {"carried": True})
        if n.kind == "ATTRIBUTE" and n.params.get("attribute_type") == "INSTANCER" else n
        for n in graph.nodes
    )  # fmt: skip
    return ShaderGraph(nodes, graph.surface, graph.volume)


class PlacedAttributes:
    """The attributes that Geometry Nodes give their instances. Geometry is asked for once per instancer."""

    def __init__(self) -> None:
        self._levels: dict[tuple[int, ...], tuple] = {}

    def find(self, instance: bpy.types.DepsgraphObjectInstance, name: str) -> Color | None:
        """The value of ``name``, that of the innermost instances first; None where there is none."""
        path, found = (), None
        # The last of the instance's numbers is its place among its instancer's own instances, the one before that among the
        # instances which that one holds …
        numbers = [int(k) for k in instance.persistent_id if k != _NO_NUMBER][::-1]
        for number in numbers:
            attributes, which, references = self._level(instance.parent, path)
            if number >= len(which):
                break
            values = attributes.get(name)
            found = found if values is None else _color(values[number])
            path = (*path, number)
            if not isinstance(references[which[number]], bpy.types.GeometrySet):
                break
        return found

    def _level(self, parent: bpy.types.Object, path: tuple[int, ...]) -> tuple:
        """(attributes by name, reference of each instance, references) of the instances within those that ``path`` names."""
        key = (parent.original.as_pointer(), *path)
        if key not in self._levels:
            geometry = None
            if not path:
                # Blender 4.5 and later tell what geometry a modifier made.
                geometry = parent.evaluated_geometry() if hasattr(parent, "evaluated_geometry") else None
            else:
                _, which, references = self._level(parent, path[:-1])
                geometry = references[which[path[-1]]]
            cloud = geometry.instances_pointcloud() if geometry is not None else None
            attributes, which, references = {}, [], []
            if cloud is not None and len(cloud.attributes[".reference_index"].data):
                references = geometry.instance_references()
                which = [d.value for d in cloud.attributes[".reference_index"].data]
                attributes = {a.name: [_plain(d) for d in a.data] for a in cloud.attributes if a.data_type in _NUMBERS}
            self._levels[key] = (attributes, which, references)
        return self._levels[key]


_NO_NUMBER = 2**31 - 1  # ends an instance's list of numbers
_NUMBERS = ("FLOAT", "INT", "INT8", "BOOLEAN", "FLOAT_VECTOR", "FLOAT_COLOR", "BYTE_COLOR")


def _plain(datum):
    """An attribute's value as a number or a tuple."""
    for field in ("value", "color", "vector"):
        if hasattr(datum, field):
            value = getattr(datum, field)
            return tuple(value) if hasattr(value, "__len__") else float(value)
    return 0.0


def values_of(
    names: tuple[Name, ...], instance, obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, placed: PlacedAttributes
) -> tuple[Color, ...]:
    """The value of each of ``names`` for one placed object, 0 where nothing has it. Blender looks in the order given: an
    instancer's particle settings, what Geometry Nodes gave the instance, the instancer, then the object and its data; a view
    layer, its scene, the world.
    """
    out = []
    for kind, name in names:
        if kind == "VIEW_LAYER":
            scene = depsgraph.scene
            owners = [depsgraph.view_layer, scene, scene.world]
        else:
            owners = [obj, obj.data]
            if kind == "INSTANCER" and instance.is_instance:
                system = instance.particle_system
                owners = [system.settings if system is not None else None, instance.parent, *owners]
                given = placed.find(instance, name) if system is None else None
                if given is not None:
                    out.append(given)
                    continue
        found = (_lookup(owner, name) for owner in owners if owner is not None)
        out.append(next((v for v in found if v is not None), (0.0, 0.0, 0.0, 0.0)))
    return tuple(out)


def _lookup(owner, name: str) -> Color | None:
    """A custom property, else an RNA path, as a colour; None where it is neither or not made of one to four numbers."""
    value = owner.get(name)
    if value is None:
        try:
            value = owner.path_resolve(name)
        except (ValueError, AttributeError):
            return None
    return _color(value)


def _color(value) -> Color | None:
    """One to four numbers as a colour, None if they are none."""
    if isinstance(value, (bool, int, float)):
        return (float(value),) * 3 + (1.0,)
    if isinstance(value, str) or not hasattr(value, "__len__") or not 3 <= len(value) <= 4:
        return None
    try:
        numbers = tuple(float(v) for v in value)
    except TypeError:
        return None
    return (*numbers, 1.0)[:4]


def pointiness(mesh: bpy.types.Mesh) -> np.ndarray:
    """How convex the mesh is at each vertex (V,), ½ where it is flat, as Cycles defines it: the angle between the normal
    and the mean direction of the edges that leave the vertex, over π, then the mean with the neighbours'. Vertices in one
    place count as one.
    """
    count = len(mesh.vertices)
    place = np.empty(count * 3, np.float32)
    mesh.vertices.foreach_get("co", place)
    normal = np.empty(count * 3, np.float32)
    mesh.vertices.foreach_get("normal", normal)
    ends = np.empty(len(mesh.edges) * 2, np.int32)
    mesh.edges.foreach_get("vertices", ends)
    unique, one = np.unique(place.reshape(-1, 3), axis=0, return_inverse=True)
    one = one.reshape(-1)
    unique, n = unique.astype("f8"), len(unique)
    normals = _sum(one, normal.reshape(-1, 3), n)
    # Edges between the same two places count once.
    a, b = np.unique(np.sort(one[ends.reshape(-1, 2)], axis=1), axis=0).T if len(ends) else np.zeros((2, 0), int)
    along = _unit(unique[b] - unique[a])
    edges = np.bincount(np.concatenate([a, b]), minlength=n)
    direction = _sum(np.concatenate([a, b]), np.concatenate([along, -along]), n) / np.maximum(edges, 1)[:, None]
    cos = np.clip((_unit(normals) * direction).sum(axis=1), -1.0, 1.0)
    raw = np.where(edges > 0, np.arccos(cos) / np.pi, 0.0)
    blurred = raw + np.bincount(a, raw[b], n) + np.bincount(b, raw[a], n)
    return (blurred / (edges + 1))[one].astype("f4")


def _sum(index: np.ndarray, vectors: np.ndarray, count: int) -> np.ndarray:
    return np.stack([np.bincount(index, vectors[:, k], count) for k in range(3)], axis=1)


def _unit(v: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(v, axis=1, keepdims=True)
    return v / np.where(length > 0.0, length, 1.0)
