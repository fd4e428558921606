# SPDX-License-Identifier: GPL-3.0-or-later
"""A plain Scene put into Blender: the way back from ``sync``. Tests and comparisons use it, so that Cycles renders the
very scene that Quartet does."""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Matrix

from ..scene import CAMERA, DIFFUSE, GLOSSY, SHADOW, TRANSMISSION, VOLUME, Camera, Link, Mesh, Scene, ShaderGraph
from .compat import SUBSURFACE_PATH, node_tree

_NODES = {
    "BSDF_DIFFUSE": "ShaderNodeBsdfDiffuse", "BSDF_PRINCIPLED": "ShaderNodeBsdfPrincipled",
    "BSDF_GLOSSY": "ShaderNodeBsdfAnisotropic", "BSDF_GLASS": "ShaderNodeBsdfGlass", "EMISSION": "ShaderNodeEmission",
    "BACKGROUND": "ShaderNodeBackground", "BSDF_TRANSPARENT": "ShaderNodeBsdfTransparent",
    "BSDF_TRANSLUCENT": "ShaderNodeBsdfTranslucent", "MIX_SHADER": "ShaderNodeMixShader",
    "ADD_SHADER": "ShaderNodeAddShader", "TEX_CHECKER": "ShaderNodeTexChecker", "RGB": "ShaderNodeRGB",
    "VALUE": "ShaderNodeValue", "TEX_COORD": "ShaderNodeTexCoord", "MAPPING": "ShaderNodeMapping",
    "SUBSURFACE_SCATTERING": "ShaderNodeSubsurfaceScattering", "VOLUME_SCATTER": "ShaderNodeVolumeScatter",
    "VOLUME_ABSORPTION": "ShaderNodeVolumeAbsorption", "PRINCIPLED_VOLUME": "ShaderNodeVolumePrincipled",
}  # fmt: skip


def build(source: Scene, *, clear: bool = True) -> bpy.types.Scene:
    """Make ``source`` the content of the current Blender scene and return it.

    With ``clear`` (default) the file is emptied first. Raises KeyError for a node kind that no bundled scene uses.
    """
    if clear:
        bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    meshes = [_mesh(mesh) for mesh in source.meshes]
    materials = [_material(m.name, m.graph) for m in source.materials]
    inst = source.instances
    for i in range(len(inst)):
        data = meshes[inst.mesh[i]]
        used = inst.materials[i]
        while len(data.materials) < len(used):
            data.materials.append(None)
        obj = bpy.data.objects.new(f"{data.name}.{i}", data)
        scene.collection.objects.link(obj)
        obj.matrix_world = Matrix(inst.matrix[i].tolist())
        for slot, index in enumerate(used):
            obj.material_slots[slot].link = "OBJECT"
            obj.material_slots[slot].material = materials[index]
        bits = int(inst.visibility[i])
        for name, bit in (("camera", CAMERA), ("diffuse", DIFFUSE), ("glossy", GLOSSY), ("transmission", TRANSMISSION),
                          ("volume_scatter", VOLUME), ("shadow", SHADOW)):  # fmt: skip
            setattr(obj, f"visible_{name}", bool(bits & bit))
    for light in source.lights:
        _light(scene, light)
    if source.camera is not None:
        _camera(scene, source.camera)
    world = bpy.data.worlds.new("World")
    scene.world = world
    _graph(node_tree(world), source.world.graph, "ShaderNodeOutputWorld")
    world.light_settings.distance = source.world.ao_distance
    return scene


def _mesh(mesh: Mesh) -> bpy.types.Mesh:
    data = bpy.data.meshes.new(mesh.name)
    data.from_pydata(mesh.positions.tolist(), [], mesh.triangles.tolist())
    for slot, first, count in mesh.slots:
        index = np.full(count, slot, "i4")
        data.attributes.new("material_index", "INT", "FACE") if "material_index" not in data.attributes else None
        values = np.zeros(len(data.polygons), "i4")
        data.attributes["material_index"].data.foreach_get("value", values)
        values[first : first + count] = index
        data.attributes["material_index"].data.foreach_set("value", values)
    corners = mesh.triangles.reshape(-1)
    for name, values in mesh.attributes.items():
        kind, _, layer = name.partition(":")
        if kind == "uv":
            data.uv_layers.new(name=layer)
            data.uv_layers[layer].data.foreach_set("uv", np.ascontiguousarray(values[corners]).ravel())
    data.polygons.foreach_set("use_smooth", np.ones(len(data.polygons), bool))
    data.normals_split_custom_set(mesh.normals[corners].tolist())
    data.update()
    return data


def _material(name: str, graph: ShaderGraph) -> bpy.types.Material:
    material = bpy.data.materials.new(name)
    _graph(node_tree(material), graph, "ShaderNodeOutputMaterial")
    return material


def _graph(tree: bpy.types.NodeTree, graph: ShaderGraph, output: str) -> None:
    tree.nodes.clear()
    made = []
    for node in graph.nodes:
        new = tree.nodes.new(_NODES[node.kind])
        made.append(new)
        for key, value in node.params.items():
            if key == "value":
                new.outputs[0].default_value = value
            elif hasattr(new, key):
                setattr(new, key, value)
    for node, new in zip(graph.nodes, made, strict=True):
        sockets = {s.identifier: s for s in new.inputs}
        for key, value in node.inputs.items():
            socket = sockets[key]
            if key in ("Subsurface Radius", "Radius") and isinstance(value, tuple):
                # A radius that means the same free path in this Blender.
                value = tuple(v * node.params.get("mean_free_path", 1.0) / SUBSURFACE_PATH for v in value)
            if isinstance(value, Link):
                outputs = {s.identifier: s for s in made[value.node].outputs}
                tree.links.new(outputs[value.output], socket)
            elif isinstance(value, tuple):
                socket.default_value = (*value, 1.0)[: len(socket.default_value)]
            else:
                socket.default_value = value
    end = tree.nodes.new(output)
    if graph.surface is not None:
        outputs = {s.identifier: s for s in made[graph.surface.node].outputs}
        tree.links.new(outputs[graph.surface.output], end.inputs["Surface"])
    if graph.volume is not None:
        outputs = {s.identifier: s for s in made[graph.volume.node].outputs}
        tree.links.new(outputs[graph.volume.output], end.inputs["Volume"])


def _light(scene: bpy.types.Scene, light) -> None:
    data = bpy.data.lights.new(light.name, light.kind)
    strength = float(np.max(light.emission))
    data.energy = strength
    data.color = (np.asarray(light.emission) / strength if strength > 0 else np.ones(3)).tolist()
    data.use_shadow = light.use_shadow
    if light.kind in ("POINT", "SPOT"):
        data.shadow_soft_size = light.radius
        data.use_soft_falloff = light.soft_falloff
    if light.kind == "SPOT":
        data.spot_size, data.spot_blend = light.spot_size, light.spot_blend
    if light.kind == "SUN":
        data.angle = light.angle
    if light.kind == "AREA":
        data.shape = light.shape
        data.size, data.size_y = light.size
        data.spread = light.spread
    obj = bpy.data.objects.new(light.name, data)
    obj.matrix_world = Matrix(np.asarray(light.matrix).tolist())
    scene.collection.objects.link(obj)


def _camera(scene: bpy.types.Scene, camera: Camera) -> None:
    data = bpy.data.cameras.new(camera.name)
    projection = camera.clip_from_view
    data.clip_start, data.clip_end = camera.clip_start, camera.clip_end
    data.sensor_fit = "HORIZONTAL"
    if camera.orthographic:
        data.type = "ORTHO"
        data.ortho_scale = 2.0 / projection[0, 0]
    else:
        data.angle = 2.0 * float(np.arctan(1.0 / projection[0, 0]))
    obj = bpy.data.objects.new(camera.name, data)
    obj.matrix_world = Matrix(camera.world_from_view.tolist())
    scene.collection.objects.link(obj)
    scene.camera = obj
