# SPDX-License-Identifier: GPL-3.0-or-later
"""Scene files into the embedded Blender: .blend, glTF, OBJ, PLY and friends."""

from __future__ import annotations

import math
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

from ..renderer import RenderError
from . import cycles
from .compat import node_tree

_IMPORTERS = {
    ".glb": ("import_scene", "gltf"), ".gltf": ("import_scene", "gltf"), ".obj": ("wm", "obj_import"),
    ".ply": ("wm", "ply_import"), ".stl": ("wm", "stl_import"), ".fbx": ("wm", "fbx_import"),
    ".usd": ("wm", "usd_import"), ".usda": ("wm", "usd_import"), ".usdc": ("wm", "usd_import"),
    ".usdz": ("wm", "usd_import"), ".abc": ("wm", "alembic_import"),
}  # fmt: skip
SUFFIXES = (".blend", *_IMPORTERS)


def load(path: str | Path) -> tuple[bpy.types.Scene, list[str]]:
    """Open a scene file and return its scene with notes on what had to be added.

    A file without a camera gets one that frames everything; an imported file without any light gets a sun and a grey
    sky. Raises RenderError for a file that can't be read.
    """
    path = Path(path)
    if not path.is_file():
        raise RenderError(f"{path}: no such file")
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise RenderError(f"{path}: {suffix or 'no'} files are not scenes; Quartet reads {', '.join(SUFFIXES)}")
    with cycles.quiet():
        try:
            if suffix == ".blend":
                bpy.ops.wm.open_mainfile(filepath=str(path.resolve()))
            else:
                bpy.ops.wm.read_factory_settings(use_empty=True)
                group, name = _IMPORTERS[suffix]
                getattr(getattr(bpy.ops, group), name)(filepath=str(path.resolve()))
        except (RuntimeError, AttributeError) as error:
            raise RenderError(f"{path} can't be read: {str(error).strip()}") from error
    scene = bpy.context.scene
    notes: list[str] = []
    if scene.camera is None:
        cameras = [o for o in scene.objects if o.type == "CAMERA"]
        if cameras:
            scene.camera = cameras[0]
            notes.append(f"no active camera: {cameras[0].name} is used")
        else:
            _add_camera(scene)
            notes.append("no camera: one that frames the scene was added")
    if suffix != ".blend" and not _has_light(scene):
        _add_light(scene)
        notes.append("no light: a sun and a grey sky were added")
    return scene, notes


def _has_light(scene: bpy.types.Scene) -> bool:
    if any(o.type == "LIGHT" for o in scene.objects):
        return True
    for material in bpy.data.materials:
        for node in material.node_tree.nodes if material.node_tree else ():
            strength = node.inputs.get("Emission Strength") or (node.inputs.get("Strength") if node.type == "EMISSION"
                                                                else None)  # fmt: skip
            color = node.inputs.get("Emission Color") or node.inputs.get("Color")
            if strength is not None and strength.default_value > 0 and color is not None and (
                color.is_linked or any(v > 0 for v in color.default_value[:3])
            ):  # fmt: skip
                return True
    return False


def bounds(scene: bpy.types.Scene) -> tuple[np.ndarray, np.ndarray]:
    """World box of all mesh-like objects; a unit box if there are none."""
    points = []
    depsgraph = bpy.context.evaluated_depsgraph_get()
    for instance in depsgraph.object_instances:
        if instance.object.type in {"MESH", "CURVE", "SURFACE", "FONT", "META"}:
            points += [instance.matrix_world @ Vector(c) for c in instance.object.bound_box]
    if not points:
        return np.full(3, -0.5), np.full(3, 0.5)
    array = np.array(points)
    return array.min(axis=0), array.max(axis=0)


def _add_camera(scene: bpy.types.Scene) -> None:
    low, high = bounds(scene)
    center, radius = (low + high) / 2.0, float(np.linalg.norm(high - low)) / 2.0 or 1.0
    data = bpy.data.cameras.new("Quartet Camera")
    data.clip_start, data.clip_end = radius * 1e-3, radius * 10.0
    obj = bpy.data.objects.new("Quartet Camera", data)
    scene.collection.objects.link(obj)
    direction = Vector((0.55, -0.75, 0.35)).normalized()
    aspect = scene.render.resolution_x / max(1, scene.render.resolution_y)
    half = data.angle / 2.0 if aspect <= 1.0 else math.atan(math.tan(data.angle / 2.0) / aspect)
    obj.location = Vector(center) + direction * radius / math.sin(half)
    obj.rotation_euler = (-direction).to_track_quat("-Z", "Y").to_euler()
    scene.camera = obj


def _add_light(scene: bpy.types.Scene) -> None:
    data = bpy.data.lights.new("Quartet Sun", "SUN")
    data.energy, data.angle = 3.0, math.radians(2.0)
    obj = bpy.data.objects.new("Quartet Sun", data)
    obj.rotation_euler = (math.radians(40.0), 0.0, math.radians(35.0))
    scene.collection.objects.link(obj)
    if scene.world is None:
        scene.world = bpy.data.worlds.new("Quartet World")
    background = node_tree(scene.world).nodes.get("Background")
    if background is not None:
        background.inputs["Color"].default_value = (0.5, 0.55, 0.6, 1.0)
        background.inputs["Strength"].default_value = 0.5
