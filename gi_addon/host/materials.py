# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's node trees to ShaderGraphs: groups opened, reroutes and muted nodes passed through, images collected."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ..materials import ies, sky
from ..scene import Image, Light, Link, Material, Node, ShaderGraph, World
from .compat import SUBSURFACE_PATH, uses_nodes

_SRGB = ("sRGB", "sRGB - Texture", "Filmic sRGB", "AgX Base sRGB")
_DATA = ("Non-Color", "Raw", "Generic Data", "Utility - Raw")

# Settings of nodes that decide what they compute.
_PARAMS: dict[str, tuple[str, ...]] = {
    "BSDF_PRINCIPLED": ("distribution", "subsurface_method"), "BSDF_GLOSSY": ("distribution",),
    "BSDF_SHEEN": ("distribution",), "BSDF_METALLIC": ("distribution", "fresnel_type"), "BSDF_GLASS": ("distribution",),
    "MATH": ("operation", "use_clamp"), "VECT_MATH": ("operation",),
    "MIX": ("data_type", "blend_type", "factor_mode", "clamp_factor", "clamp_result"),
    "MIX_RGB": ("blend_type", "use_clamp"), "MAPPING": ("vector_type",), "SEPARATE_COLOR": ("mode",),
    "COMBINE_COLOR": ("mode",), "CLAMP": ("clamp_type",),
    "MAP_RANGE": ("data_type", "interpolation_type", "clamp"), "NORMAL_MAP": ("space", "uv_map"), "UVMAP": ("uv_map",),
    "ATTRIBUTE": ("attribute_name", "attribute_type"), "VERTEX_COLOR": ("layer_name",), "BUMP": ("invert",),
    "TEX_IMAGE": ("interpolation", "extension", "projection", "projection_blend"),
    "TEX_ENVIRONMENT": ("interpolation", "projection"), "TEX_NOISE": ("noise_dimensions", "noise_type", "normalize"),
    "TEX_VORONOI": ("voronoi_dimensions", "feature", "distance", "normalize"),
    "TEX_WAVE": ("wave_type", "bands_direction", "rings_direction", "wave_profile"),
    "TEX_GRADIENT": ("gradient_type",), "TEX_WHITE_NOISE": ("noise_dimensions",), "TEX_MAGIC": ("turbulence_depth",),
    "TEX_BRICK": ("offset", "offset_frequency", "squash", "squash_frequency"),
    "TEX_SKY": ("sky_type", "sun_direction", "turbidity", "ground_albedo", "sun_disc", "sun_size", "sun_intensity",
                "sun_elevation", "sun_rotation", "altitude", "air_density", "dust_density", "aerosol_density",
                "ozone_density"),
    "VECTOR_ROTATE": ("rotation_type", "invert"), "VECT_TRANSFORM": ("vector_type", "convert_from", "convert_to"),
    "SUBSURFACE_SCATTERING": ("falloff",), "TANGENT": ("direction_type", "axis", "uv_map"),
}  # fmt: skip

_CURVE_ENTRIES = 256  # rows of a sampled ramp or curve, as many as Cycles takes
_ATLAS_LIMIT = 8192  # texels a side of all tiles of an image together
_PCG = bpy.app.version >= (5, 0, 0)  # how this Blender hashes Voronoi cells


_skies: dict[str, tuple] = {}  # settings -> (Sky, Image): computed once, half a second each


class ImageTable:
    """The scene's images, each read once. ``notes`` gets a line for each that can't be read."""

    def __init__(self, cache: dict[int, tuple[tuple, Image]], notes: list[str]) -> None:
        self._cache = cache
        self._notes = notes
        self._index: dict[int, int] = {}
        self.images: list[Image] = []

    def index(self, image: bpy.types.Image | None, owner: str) -> int | None:
        """Index of ``image`` among :attr:`images`; None for a node without one."""
        if image is None:
            return None
        key = image.original.session_uid
        if key not in self._index:
            self._index[key] = len(self.images)
            self.images.append(self._read(image, key, owner))
        return self._index[key]

    def sky(self, params: dict[str, Any]) -> dict[str, Any]:
        """What a Sky Texture's settings come to: its image among :attr:`images`, and its sun's colours."""
        key = repr(sorted(params.items()))
        if key not in _skies:
            found = sky.sky(params)
            if len(_skies) > 8:
                _skies.clear()
            _skies[key] = (found, found and Image("Sky", found.pixels, "linear"))
        found, image = _skies[key]
        if found is None:
            return {}
        if image not in self.images:
            self.images.append(image)
        return {
            "image": self.images.index(image), "sun_low": tuple(found.sun_low.tolist()),
            "sun_high": tuple(found.sun_high.tolist()),
        }  # fmt: skip

    def _read(self, image: bpy.types.Image, key: int, owner: str) -> Image:
        stamp = (image.filepath, tuple(image.size), image.colorspace_settings.name, image.is_dirty, image.source)
        cached = self._cache.get(key)
        if cached and cached[0] == stamp and not image.is_dirty and image.source != "SEQUENCE":
            return cached[1]
        pixels = self._tiles(image) if image.source == "TILED" else self._pixels(image)
        if pixels is None:
            where = bpy.path.abspath(image.filepath) or "no file"
            self._notes.append(f"image {image.name} of {owner} can't be read ({where}); it shows magenta")
            return Image.placeholder(image.name)
        name = image.colorspace_settings.name
        space = "data" if name in _DATA else "srgb" if name in _SRGB else "linear"
        if not image.is_float:
            pixels = (pixels * 255.0 + 0.5).astype(np.uint8)
            if space == "linear" and not name.startswith("Linear"):
                self._notes.append(f"image {image.name}: colour space {name} is taken as sRGB")
                space = "srgb"
        elif space == "srgb":
            space = "linear"  # Blender decodes float pixels when it loads them
        result = Image(image.name, pixels, space)
        self._cache[key] = (stamp, result)
        return result


    @staticmethod
    def _pixels(image: bpy.types.Image) -> np.ndarray | None:
        """Pixels (H, W, 4) f4, None where there are none."""
        width, height = image.size
        if width * height == 0 or image.channels == 0:
            return None
        pixels = np.empty(width * height * 4, np.float32)
        image.pixels.foreach_get(pixels)
        return pixels.reshape(height, width, 4)

    def _tiles(self, image: bpy.types.Image) -> np.ndarray | None:
        """All UDIM tiles in one picture, laid out as in UV space; see :func:`tile_grid`. Blender shows scripts the first
        tile alone, so the others are loaded from their files; a missing one is magenta."""
        column, row, columns, rows = tile_grid(image)
        parts = {tile.number: self._tile(image, tile) for tile in image.tiles}
        sizes = [p.shape[:2] for p in parts.values() if p is not None]
        if not sizes:
            return None
        height, width = np.max(sizes, axis=0)
        step = max(1, -(-max(width * columns, height * rows) // _ATLAS_LIMIT))
        height, width = -(-height // step), -(-width // step)
        atlas = np.empty((rows * height, columns * width, 4), np.float32)
        atlas[:] = (1.0, 0.0, 1.0, 1.0)
        for number, part in parts.items():
            if part is None:
                self._notes.append(f"tile {number} of image {image.name} can't be read; it shows magenta")
                continue
            y, x = (np.arange(n) * m // n for n, m in zip((height, width), part.shape[:2], strict=True))
            at_x, at_y = (number - 1001) % 10 - column, (number - 1001) // 10 - row
            atlas[at_y * height : (at_y + 1) * height, at_x * width : (at_x + 1) * width] = part[np.ix_(y, x)]
        return atlas

    def _tile(self, image: bpy.types.Image, tile) -> np.ndarray | None:
        if tile.number == image.tiles[0].number and image.size[0]:
            return self._pixels(image)
        x, y = (tile.number - 1001) % 10 + 1, (tile.number - 1001) // 10 + 1
        path = bpy.path.abspath(image.filepath_raw, library=image.library)
        path = path.replace("<UDIM>", str(tile.number)).replace("<UVTILE>", f"u{x}_v{y}")
        with tempfile.TemporaryDirectory(prefix="quartet-") as folder:
            packed = next((p for p in image.packed_files if p.tile_number == tile.number), None)
            if packed is not None:
                path = os.path.join(folder, os.path.basename(path))
                with open(path, "wb") as file:
                    file.write(packed.data)
            if not os.path.isfile(path):
                return None
            try:
                loaded = bpy.data.images.load(path)
            except RuntimeError:
                return None
            try:
                loaded.colorspace_settings.name = image.colorspace_settings.name
                return self._pixels(loaded)
            finally:
                bpy.data.images.remove(loaded)


def tile_grid(image: bpy.types.Image) -> tuple[int, int, int, int]:
    """(first column, first row, columns, rows) that a tiled image's UDIM numbers span."""
    at = [((tile.number - 1001) % 10, (tile.number - 1001) // 10) for tile in image.tiles]
    low, high = np.min(at, axis=0), np.max(at, axis=0)
    return (int(low[0]), int(low[1]), *(int(v) for v in high - low + 1))


class GraphReader:
    """Reads one node tree."""

    def __init__(self, images: ImageTable, owner: str) -> None:
        self.images = images
        self.owner = owner
        self.nodes: list[Node] = []
        self._made: dict[tuple, int] = {}

    def read(self, tree: bpy.types.NodeTree, output_type: str, target: str = "CYCLES") -> ShaderGraph:
        """The graph that feeds the tree's active output."""
        output = _active_output(tree, output_type, target)
        if output is None:
            return ShaderGraph()
        surface = self._source(output.inputs["Surface"], ())
        volume = self._source(output.inputs["Volume"], ()) if "Volume" in output.inputs else None
        return ShaderGraph(
            tuple(self.nodes),
            surface if isinstance(surface, Link) else None,
            volume if isinstance(volume, Link) else None,
        )

    def _source(self, socket: bpy.types.NodeSocket, path: tuple) -> Link | Any:
        """What feeds an input: a Link, or the socket's own value (None for closures and unset vectors)."""
        for _ in range(1000):  # a chain of reroutes and groups ends; a damaged file's may not
            if not socket.is_linked or not socket.links or socket.links[0].is_muted:
                return _value(socket)
            link = socket.links[0]
            node, out = link.from_node, link.from_socket
            if node.type == "REROUTE":
                socket = node.inputs[0]
            elif node.mute:
                inner = next((i.from_socket for i in node.internal_links if i.to_socket == out), None)
                if inner is None:
                    return _value(socket)
                socket = inner
            elif node.type == "GROUP_INPUT":
                if not path:
                    return _value(socket)
                owner = path[-1]
                outer = next((s for s in owner.inputs if s.identifier == out.identifier), None)
                if outer is None:
                    return _value(socket)
                socket, path = outer, path[:-1]
            elif node.type == "GROUP" and node.node_tree is not None:
                inside = next(
                    (n for n in node.node_tree.nodes if n.type == "GROUP_OUTPUT" and n.is_active_output), None
                )
                inner = inside and next((s for s in inside.inputs if s.identifier == out.identifier), None)
                if inner is None:
                    return _value(socket)
                socket, path = inner, (*path, node)
            else:
                return Link(self._node(node, path), out.identifier)
        return _value(socket)

    def _node(self, node: bpy.types.Node, path: tuple) -> int:
        key = (*(n.as_pointer() for n in path), node.as_pointer())
        if key in self._made:
            return self._made[key]
        # The slot is taken first: a cycle then refers to it instead of recursing for ever.
        index = self._made[key] = len(self.nodes)
        self.nodes.append(Node("NONE"))
        inputs: dict[str, Any] = {}
        for socket in node.inputs:
            if socket.enabled or socket.is_linked:
                value = self._source(socket, path)
                if value is not None:
                    inputs[socket.identifier] = value
        self.nodes[index] = Node(node.type, node.label or node.name, inputs, self._params(node))
        return index

    def _params(self, node: bpy.types.Node) -> dict[str, Any]:
        params = {
            name: _plain(getattr(node, name)) for name in _PARAMS.get(node.type, ()) if hasattr(node, name)
        }
        if node.type in ("BSDF_PRINCIPLED", "SUBSURFACE_SCATTERING") and SUBSURFACE_PATH != 1.0:
            params["mean_free_path"] = SUBSURFACE_PATH
        if node.type in ("TEX_IMAGE", "TEX_ENVIRONMENT"):
            params["image"] = self.images.index(node.image, self.owner)
            if node.image is not None:
                if node.image.source == "TILED":
                    params["tiles"] = tile_grid(node.image)
                params["alpha_mode"] = {"PREMUL": "PREMUL", "NONE": "NONE"}.get(node.image.alpha_mode, "STRAIGHT")
        if node.type == "RGB":
            params["value"] = tuple(node.outputs[0].default_value[:3])
        elif node.type == "VALUE":
            params["value"] = float(node.outputs[0].default_value)
        elif node.type == "NORMAL":
            params["normal"] = tuple(node.outputs[0].default_value)
        elif node.type == "TEX_COORD":
            if node.object is not None:
                matrix = node.object.matrix_world.inverted_safe()
                params["object_matrix"] = [tuple(float(v) for v in matrix[r]) for r in range(3)]
        elif node.type == "TEX_IES":
            mean = ies.mean_strength(_ies_text(node))
            params |= {} if mean is None else {"mean": mean}
        elif node.type == "TEX_SKY":
            params |= self.images.sky(params)
        elif node.type == "TEX_VORONOI":
            params["pcg"] = _PCG
        elif node.type == "VALTORGB":
            ramp = node.color_ramp
            params["table"] = [tuple(ramp.evaluate(i / (_CURVE_ENTRIES - 1))) for i in range(_CURVE_ENTRIES)]
            params["constant"] = ramp.interpolation == "CONSTANT"
        elif node.type in ("CURVE_RGB", "CURVE_VEC", "CURVE_FLOAT"):
            params.update(_curves(node))
        mapping = getattr(node, "texture_mapping", None)
        if mapping is not None:
            matrix = _texture_mapping(mapping)
            if matrix is not None:
                params["texture_mapping"] = matrix
        return params


def _ies_text(node: bpy.types.ShaderNodeTexIES) -> str:
    """The file of an IES Texture; empty where it can't be read."""
    if node.mode == "INTERNAL":
        return node.ies.as_string() if node.ies is not None else ""
    try:
        return Path(bpy.path.abspath(node.filepath)).read_text(errors="replace")
    except OSError:
        return ""


def _active_output(tree: bpy.types.NodeTree, kind: str, target: str):
    outputs = [n for n in tree.nodes if n.type == kind and not n.mute]
    for wanted in (target, "ALL", None):
        found = [n for n in outputs if wanted is None or getattr(n, "target", "ALL") == wanted]
        active = [n for n in found if n.is_active_output]
        if active or found:
            return (active or found)[0]
    return None


def _value(socket: bpy.types.NodeSocket) -> Any:
    """An unlinked socket's value; None where the node decides (closures, hidden vectors such as Normal)."""
    if socket.type == "SHADER" or getattr(socket, "hide_value", False):
        return None
    value = getattr(socket, "default_value", None)
    return None if value is None else _plain(value, color=socket.type == "RGBA")


def _plain(value: Any, *, color: bool = False) -> Any:
    if isinstance(value, (bool, int, float, str)):
        return value
    if hasattr(value, "__len__"):
        numbers = tuple(float(v) for v in value)
        return numbers[:3] if color else numbers
    return str(value)


def _curves(node: bpy.types.Node) -> dict[str, Any]:
    """Samples between the first and the last point of all curves; ``extend``: they go on straight beyond."""
    mapping = node.mapping
    mapping.initialize()
    curves = mapping.curves[:1] if node.type == "CURVE_FLOAT" else mapping.curves[:]
    low = min(curve.points[0].location[0] for curve in curves)
    high = max(curve.points[-1].location[0] for curve in curves)
    rows = []
    for i in range(_CURVE_ENTRIES):
        x = low + (high - low) * i / (_CURVE_ENTRIES - 1)
        if node.type == "CURVE_RGB":  # the combined curve comes first
            x = mapping.evaluate(curves[3], x)
        rows.append(tuple(mapping.evaluate(curve, x) for curve in curves[:3]))
    return {"table": rows, "range": (low, high), "extend": mapping.extend == "EXTRAPOLATED"}


def _texture_mapping(mapping) -> list[tuple[float, ...]] | None:
    """Rows (3 × 4) of a texture node's own mapping; None for the identity."""
    from mathutils import Euler, Matrix

    axes = {"NONE": None, "X": 0, "Y": 1, "Z": 2}
    used = [axes[mapping.mapping_x], axes[mapping.mapping_y], axes[mapping.mapping_z]]
    scale = tuple(mapping.scale)
    if mapping.vector_type == "TEXTURE":
        scale = tuple(1.0 / s if s else 0.0 for s in scale)
    rotation = Euler(mapping.rotation).to_matrix().to_4x4()
    matrix = Matrix.Translation(mapping.translation) @ rotation @ Matrix.Diagonal((*scale, 1.0))
    if mapping.vector_type == "TEXTURE":
        matrix = Matrix.Diagonal((*scale, 1.0)) @ rotation.inverted() @ Matrix.Translation(-mapping.translation)
    elif mapping.vector_type in ("VECTOR", "NORMAL"):
        matrix = rotation @ Matrix.Diagonal((*scale, 1.0))
    pick = Matrix.Diagonal((0.0, 0.0, 0.0, 1.0))
    for row, column in enumerate(used):
        if column is not None:
            pick[row][column] = 1.0
    matrix = matrix @ pick
    rows = [tuple(float(v) for v in matrix[r]) for r in range(3)]
    identity = all(abs(matrix[r][k] - (1.0 if r == k else 0.0)) < 1e-6 for r in range(3) for k in range(4))
    return None if identity else rows


def _trees(data) -> Iterator[bpy.types.NodeTree]:
    """The tree to read: with closures, bundles and zones resolved where Blender offers that."""
    if hasattr(data, "inline_shader_nodes"):
        try:
            inlined = data.inline_shader_nodes()
        except RuntimeError:
            inlined = None
        if inlined is not None:
            yield inlined.node_tree  # `inlined` stays referenced while the tree is in use
            return
    yield data.node_tree


def read_material(material: bpy.types.Material, images: ImageTable) -> Material:
    """A Material from Blender's."""
    graph = ShaderGraph()
    if uses_nodes(material):
        for tree in _trees(material):
            graph = GraphReader(images, f"material {material.name}").read(tree, "OUTPUT_MATERIAL")
    else:
        graph = ShaderGraph(
            (Node("BSDF_PRINCIPLED", material.name, {
                "Base Color": tuple(material.diffuse_color[:3]), "Metallic": material.metallic,
                "Roughness": material.roughness,
            }),), Link(0, "BSDF"),
        )  # fmt: skip
    return Material(material.name, graph, pass_index=material.pass_index)


def read_light(data: bpy.types.Light, images: ImageTable) -> ShaderGraph:
    """The graph of a light's nodes."""
    graph = ShaderGraph()
    for tree in _trees(data):
        graph = GraphReader(images, f"light {data.name}").read(tree, "OUTPUT_LIGHT")
    return graph


def default_material() -> Material:
    """What Cycles shows where a surface has no material: grey, Principled as it is added since Blender 5, diffuse before."""
    if bpy.app.version < (5, 0, 0):
        return Material("No Material", ShaderGraph((Node("BSDF_DIFFUSE", "", {"Color": (0.8, 0.8, 0.8)}),), Link(0, "BSDF")))
    node = Node("BSDF_PRINCIPLED", "", {"Base Color": (0.8, 0.8, 0.8), "Roughness": 0.5, "IOR": 1.5})
    return Material("No Material", ShaderGraph((node,), Link(0, "BSDF")))


def holdout_material(material: Material) -> Material:
    """The material as an object has it that is held out: a hole to the camera, itself to light."""
    nodes = [*material.graph.nodes]
    n = len(nodes)
    nodes += [
        Node("LIGHT_PATH"), Node("HOLDOUT"),
        Node("MIX_SHADER", "", {
            "Fac": Link(n, "Is Camera Ray"), "Shader": material.graph.surface, "Shader_001": Link(n + 1, "Holdout"),
        }),
    ]  # fmt: skip
    if material.graph.surface is None:
        del nodes[-1].inputs["Shader"]
    return Material(f"{material.name} held out", ShaderGraph(tuple(nodes), Link(n + 2, "Shader"), material.graph.volume))


def read_world(world: bpy.types.World | None, images: ImageTable) -> World:
    """A World from Blender's; black where the scene has none."""
    if world is None:
        return World()
    graph = ShaderGraph()
    if uses_nodes(world):
        for tree in _trees(world):
            graph = GraphReader(images, f"world {world.name}").read(tree, "OUTPUT_WORLD")
    else:
        node = Node("BACKGROUND", world.name, {"Color": tuple(world.color), "Strength": 1.0})
        graph = ShaderGraph((node,), Link(0, "Background"))
    graph = _sun_apart(graph)
    visible = getattr(getattr(world, "cycles_visibility", None), "camera", True)
    return World(graph, world.light_settings.distance, bool(visible))


def _sky_background(graph: ShaderGraph) -> tuple[Node, int, float] | None:
    """(sky node, its index, strength) where the world is one Sky Texture with a sun at a constant strength."""
    if graph.surface is None:
        return None
    background = graph.nodes[graph.surface.node]
    color, strength = background.inputs.get("Color"), background.inputs.get("Strength", 1.0)
    if background.kind != "BACKGROUND" or not isinstance(color, Link) or isinstance(strength, Link):
        return None
    node = graph.nodes[color.node]
    scattered = node.params.get("sky_type") not in ("PREETHAM", "HOSEK_WILKIE")  # they have no disc
    if node.kind != "TEX_SKY" or not scattered or not node.params.get("sun_disc") or "sun_high" not in node.params:
        return None
    return None if isinstance(node.inputs.get("Vector"), Link) else (node, color.node, float(strength))


def _sun_apart(graph: ShaderGraph) -> ShaderGraph:
    """Mark a sky's sun as a light of its own: half a degree is too small for a map of the whole sky."""
    found = _sky_background(graph)
    if found is None:
        return graph
    node, index, _ = found
    marked = Node(node.kind, node.name, node.inputs, node.params | {"sun_light": True})
    return ShaderGraph((*graph.nodes[:index], marked, *graph.nodes[index + 1 :]), graph.surface, graph.volume)


def world_sun(graph: ShaderGraph) -> Light | None:
    """The sun of a world that is a Sky Texture."""
    found = _sky_background(graph)
    if found is None:
        return None
    node, _, strength = found
    z = sky.sun_direction(node.params)
    x = np.cross([0.0, 1.0, 0.0] if abs(z[1]) < 0.9 else [1.0, 0.0, 0.0], z)
    x /= np.linalg.norm(x)
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2] = x, np.cross(z, x), z
    ends = sky.Sky(np.zeros((0, 0, 4)), np.array(node.params["sun_low"]), np.array(node.params["sun_high"]))
    size = float(node.params.get("sun_size", 0.0))
    return Light("Sky's sun", "SUN", strength * sky.sun_irradiance(ends, node.params), matrix, angle=size, visible_camera=False)
