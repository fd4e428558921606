# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene as plain data: numpy arrays and dataclasses in Blender's units, no bpy, no OpenGL.

``host/`` makes it from Blender's dependency graph, ``Scene.load`` from a snapshot. Everything here is treated as
immutable: a changed mesh is a new :class:`Mesh`, so that identity (``uid``) tells the renderer what to keep.

Units: metres (Blender units), scene-linear Rec.709, radiance W/(m²·sr), power W, sun strength W/m².
"""

from __future__ import annotations

import hashlib
import io
import itertools
import json
import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

SNAPSHOT_VERSION = 1
_uids = itertools.count(1)


def new_uid() -> int:
    """An identity that nothing else in this process has."""
    return next(_uids)


class SnapshotError(ValueError):
    """A snapshot file is missing, damaged, or of another version."""


# --- shader graphs ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Link:
    """A socket fed by output ``output`` of node ``node`` (an index into ``ShaderGraph.nodes``)."""

    node: int
    output: str


@dataclass(frozen=True)
class Node:
    """One node of a flattened shader graph.

    ``kind`` is Blender's node type (``BSDF_PRINCIPLED``, ``TEX_IMAGE`` …); ``inputs`` maps socket identifiers to a
    Link, a float, or a tuple of floats; ``params`` holds enum and flag settings (JSON values).
    """

    kind: str
    name: str = ""
    inputs: dict[str, Link | float | tuple[float, ...]] = field(default_factory=dict)
    params: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class ShaderGraph:
    """A material's or world's nodes, flattened (no groups, no reroutes, no muted nodes)."""

    nodes: tuple[Node, ...] = ()
    surface: Link | None = None
    volume: Link | None = None

    def reads(self, kind: str, output: str) -> bool:
        """Whether a node reads ``output`` of one of ``kind``."""
        links = (v for n in self.nodes for v in n.inputs.values() if isinstance(v, Link))
        return any(v.output == output and self.nodes[v.node].kind == kind for v in links)


# --- parts of a scene -------------------------------------------------------------------------------------------------


@dataclass(eq=False)
class Image:
    """Pixels ``(height, width, 4)``, row 0 at the bottom, uint8 or float32.

    ``colorspace``: ``srgb`` (encoded, decode on lookup), ``linear`` (scene-linear) or ``data`` (not a colour).
    """

    name: str
    pixels: np.ndarray
    colorspace: str = "srgb"
    missing: bool = False
    uid: int = field(default_factory=lambda: next(_uids))

    @property
    def encoded(self) -> bool:
        """Whether the pixels are sRGB bytes to be decoded after filtering, as Cycles does."""
        return self.colorspace == "srgb" and self.pixels.dtype == np.uint8

    @cached_property
    def opaque(self) -> bool:
        """Whether alpha is 1 everywhere."""
        alpha = self.pixels[..., 3]
        return bool((alpha == (255 if alpha.dtype == np.uint8 else 1.0)).all())

    @staticmethod
    def placeholder(name: str) -> Image:
        """Blender's magenta for an image that can't be read."""
        return Image(name, np.full((1, 1, 4), (1.0, 0.0, 1.0, 1.0), "f4"), "linear", missing=True)


@dataclass(eq=False)
class Mesh:
    """Triangles with split vertices, so that every attribute is per vertex.

    ``positions`` (V, 3) f4 in object space; ``normals`` (V, 3) f4 unit shading normals; ``triangles`` (T, 3) u4, sorted
    by material slot; ``slots`` rows (slot, first triangle, triangle count); ``attributes`` name -> (V, k) f4, where UV
    maps are ``uv:NAME`` (k = 2) and colour attributes ``color:NAME`` (k = 4).
    """

    name: str
    positions: np.ndarray
    normals: np.ndarray
    triangles: np.ndarray
    slots: np.ndarray
    attributes: dict[str, np.ndarray] = field(default_factory=dict)
    active_uv: str = ""
    active_color: str = ""
    uid: int = field(default_factory=lambda: next(_uids))

    def __post_init__(self) -> None:
        finite = np.isfinite(self.positions).all(axis=1)
        if not finite.all():
            # A vertex that is nowhere makes its triangles nothing; it must not make the bounds infinite.
            self.positions = np.where(finite[:, None], self.positions, 0.0).astype("f4")
            bad = ~finite[self.triangles].all(axis=1)
            self.triangles = np.where(bad[:, None], self.triangles[:, :1], self.triangles).astype("u4")
        reached = np.zeros(len(self.positions), bool)
        reached[self.triangles.reshape(-1)] = True
        used = self.positions[reached]
        self.bounds = (
            np.stack([used.min(axis=0), used.max(axis=0)]).astype("f8") if len(used) else np.zeros((2, 3), "f8")
        )

    @property
    def empty(self) -> bool:
        return len(self.triangles) == 0


@dataclass(eq=False)
class Material:
    """A surface: its node graph and the settings that Blender keeps outside it."""

    name: str
    graph: ShaderGraph
    backface_culling: bool = False
    pass_index: int = 0
    uid: int = field(default_factory=lambda: next(_uids))


@dataclass
class Light:
    """A Blender light with Cycles' units.

    ``emission`` (3,): power Φ in W for POINT, SPOT and AREA, irradiance in W/m² for SUN, after colour, temperature and
    exposure. ``visible_…``: whether the camera and which lobes of surfaces see it. ``matrix`` (4, 4): world from light; light
    shines along -Z. ``radius``: soft size in m (POINT, SPOT);
    ``angle``: full angular diameter (SUN), rad; ``spot_size`` full cone angle, rad; ``size`` (2,): width and height in
    object units; ``spread``: rad.
    ``falloff``: the irradiance is that of the distance's square × distance^falloff, × d²/(d² + ``falloff_smooth``), m².
    ``receivers``, ``blockers``: bit k says whether objects of set k are lit, and shade (``receiver_set``, ``blocker_set``).
    """

    name: str
    kind: str
    emission: np.ndarray
    matrix: np.ndarray
    radius: float = 0.0
    angle: float = 0.0
    spot_size: float = np.pi
    spot_blend: float = 0.0
    shape: str = "SQUARE"
    size: tuple[float, float] = (1.0, 1.0)
    spread: float = np.pi
    soft_falloff: bool = True
    use_shadow: bool = True
    visible_camera: bool = True
    visible_diffuse: bool = True
    visible_glossy: bool = True
    receivers: int = (1 << 32) - 1
    blockers: int = (1 << 32) - 1
    falloff: float = 0.0
    falloff_smooth: float = 0.0


@dataclass
class Camera:
    """``world_from_view`` (4, 4), looking along -Z; ``clip_from_view`` (4, 4), OpenGL clip space, without jitter.

    Depth of field: ``aperture`` radius of the lens in m (0 = pinhole), focused at ``focus`` m along the view; ``blades`` of
    its iris (below 3: round), turned by ``blade_turn`` rad; ``blade_ratio`` is how much higher than wide it is.
    """

    world_from_view: np.ndarray
    clip_from_view: np.ndarray
    clip_start: float = 0.1
    clip_end: float = 1000.0
    aperture: float = 0.0
    focus: float = 10.0
    name: str = "Camera"
    blades: int = 0
    blade_turn: float = 0.0
    blade_ratio: float = 1.0

    @property
    def orthographic(self) -> bool:
        return bool(self.clip_from_view[3, 3] == 1.0)

    def moved(self, offset: np.ndarray) -> Camera:
        """This camera ``offset`` (3,) m further."""
        matrix = np.array(self.world_from_view, "f8")
        matrix[:3, 3] += offset
        return replace(self, world_from_view=matrix)


@dataclass(eq=False)
class World:
    """The world's background shader; ``ao_distance`` is Blender's ambient-occlusion distance in m."""

    graph: ShaderGraph = ShaderGraph()
    ao_distance: float = 10.0
    visible_camera: bool = True
    uid: int = field(default_factory=lambda: next(_uids))


# Visibility bits of an instance: which rays see it.
CAMERA, DIFFUSE, GLOSSY, TRANSMISSION, VOLUME, SHADOW = (1 << i for i in range(6))
ALL_RAYS = 63
HOLDOUT = 64
# What the camera sees of it is only the shadow on it.
CATCHER = 128
# Light linking: bits 8 to 12 say which set of objects an instance is lit with, bits 16 to 20 which it shades with; every light
# says which sets it lights and which shade it. Blender has at most 64 sets, this has 32.
LIGHT_SETS = 32
EVERY_SET = (1 << LIGHT_SETS) - 1


def receiver_set(visibility: int) -> int:
    """The set that an instance of these bits is lit with."""
    return visibility >> 8 & 31


def blocker_set(visibility: int) -> int:
    """The set that an instance of these bits shades with."""
    return visibility >> 16 & 31


def set_bits(receiver: int, blocker: int) -> int:
    """The bits of an instance for its two sets."""
    return receiver << 8 | blocker << 16


# Mesh attribute that the Geometry node's Pointiness reads.
POINTINESS = ".pointiness"


@dataclass(eq=False)
class Instances:
    """N placed meshes. ``mesh`` (N,) i4; ``matrix`` (N, 4, 4) f8 world from object; ``materials`` one tuple of material
    indices per instance, by slot; ``visibility`` (N,) u4 bits; ``random`` (N,) f4 and ``index`` (N,) i4 as Blender's
    Object Info node gives them; ``color`` (N, 4) f4."""

    mesh: np.ndarray
    matrix: np.ndarray
    materials: list[tuple[int, ...]]
    visibility: np.ndarray
    random: np.ndarray
    index: np.ndarray
    color: np.ndarray

    def __len__(self) -> int:
        return len(self.mesh)

    @staticmethod
    def make(mesh, matrix, materials, *, visibility=None, random=None, index=None, color=None) -> Instances:
        """Fill in the defaults of what is not given."""
        n = len(mesh)
        return Instances(
            np.asarray(mesh, "i4").reshape(n),
            np.asarray(matrix, "f8").reshape(n, 4, 4),
            [tuple(m) for m in materials],
            np.full(n, ALL_RAYS, "u4") if visibility is None else np.asarray(visibility, "u4"),
            np.zeros(n, "f4") if random is None else np.asarray(random, "f4"),
            np.zeros(n, "i4") if index is None else np.asarray(index, "i4"),
            np.ones((n, 4), "f4") if color is None else np.asarray(color, "f4"),
        )


@dataclass
class Scene:
    """All that a frame is made of. ``notes`` are messages to the user from the sync (approximated nodes, missing
    images, dropped objects); ``frame`` and ``name`` label it."""

    meshes: list[Mesh] = field(default_factory=list)
    materials: list[Material] = field(default_factory=list)
    images: list[Image] = field(default_factory=list)
    instances: Instances = field(default_factory=lambda: Instances.make([], np.zeros((0, 4, 4)), []))
    lights: list[Light] = field(default_factory=list)
    camera: Camera | None = None
    world: World = field(default_factory=World)
    notes: list[str] = field(default_factory=list)
    name: str = "Scene"
    frame: int = 0

    # -- geometry ------------------------------------------------------------------------------------------------

    def triangle_count(self) -> int:
        """Triangles drawn, instances counted each."""
        return int(sum(len(self.meshes[m].triangles) for m in self.instances.mesh))

    def world_triangles(self, visibility: int, wanted: Sequence[bool]) -> Iterator[tuple[int, int, np.ndarray]]:
        """Instance, material and corners (T, 3, 3) in world space of what is visible to one of ``visibility`` and has a
        material that is ``wanted``, slot by slot; what has no finite place is left out."""
        inst = self.instances
        for i in range(len(inst)):
            mesh, used = self.meshes[inst.mesh[i]], inst.materials[i]
            if not inst.visibility[i] & visibility or not used or not np.isfinite(inst.matrix[i]).all():
                continue
            for slot, first, count in mesh.slots:
                material = used[min(int(slot), len(used) - 1)]
                if count and wanted[material]:
                    triangles = mesh.positions[mesh.triangles[first : first + count]].astype("f8")
                    yield i, material, triangles @ inst.matrix[i, :3, :3].T + inst.matrix[i, :3, 3]

    def instance_bounds(self) -> np.ndarray:
        """World-space boxes (N, 2, 3) of all instances."""
        n = len(self.instances)
        if n == 0:
            return np.zeros((0, 2, 3))
        local = np.stack([self.meshes[m].bounds for m in self.instances.mesh])
        center, half = local.mean(axis=1), (local[:, 1] - local[:, 0]) / 2
        matrix = self.instances.matrix
        world_center = np.einsum("nij,nj->ni", matrix[:, :3, :3], center) + matrix[:, :3, 3]
        world_half = np.einsum("nij,nj->ni", np.abs(matrix[:, :3, :3]), half)
        return np.stack([world_center - world_half, world_center + world_half], axis=1)

    def bounds(self) -> np.ndarray:
        """World-space box (2, 3) of everything drawn; a unit box at the origin if that is nothing."""
        boxes = self.instance_bounds()
        if len(boxes) == 0:
            return np.array([[-0.5] * 3, [0.5] * 3])
        return np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])

    def far_origin(self) -> np.ndarray:
        """A point (3,) near the scene's middle if that is far from the origin for the scene's size, else the origin.

        32-bit coordinates at distance D are D/2²⁴ apart; up to 16 radii that costs four bits, which everything is made to
        bear. Steps of 16 radii, rounded up to a power of two, keep the point where it is while objects move about.
        """
        low, high = self.bounds()
        radius = 0.5 * float(np.linalg.norm(high - low))
        middle = (low + high) / 2.0
        if not np.isfinite(middle).all() or float(np.abs(middle).max()) <= 16.0 * radius or radius <= 0.0:
            return np.zeros(3)
        step = 2.0 ** np.ceil(np.log2(16.0 * radius))
        return np.round(middle / step) * step

    def moved(self, offset: np.ndarray) -> Scene:
        """This scene with everything placed ``offset`` (3,) m further; meshes, materials and images are shared."""
        shift = np.zeros((4, 4))
        shift[:3, 3] = offset
        camera = self.camera
        return replace(
            self,
            instances=replace(self.instances, matrix=self.instances.matrix + shift),
            lights=[replace(light, matrix=light.matrix + shift) for light in self.lights],
            camera=camera and camera.moved(offset),
        )

    # -- identity ------------------------------------------------------------------------------------------------

    def stamps(self) -> dict[str, str]:
        """What each kind of data is, as short strings that change when it does.

        Kinds: ``meshes``, ``transforms``, ``materials``, ``lights``, ``world``, ``camera``.
        """
        inst = self.instances

        def digest(*parts) -> str:
            h = hashlib.blake2b(digest_size=12)
            for part in parts:
                h.update(part.tobytes() if isinstance(part, np.ndarray) else repr(part).encode())
            return h.hexdigest()

        return {
            "meshes": digest([m.uid for m in self.meshes], inst.mesh, inst.materials, inst.visibility),
            "transforms": digest(inst.matrix, inst.random, inst.index, inst.color),
            "materials": digest([m.uid for m in self.materials], [i.uid for i in self.images]),
            "lights": digest([_plain(light) for light in self.lights]),
            "world": digest(self.world.uid),
            "camera": digest(_plain(self.camera)),
        }

    def digest(self) -> str:
        """A name of the scene's content, the same in every process (unlike stamps)."""
        arrays: dict[str, np.ndarray] = {}
        text = json.dumps(_encode(self, arrays, ""), sort_keys=True)
        h = hashlib.blake2b(text.encode(), digest_size=16)
        for key in sorted(arrays):
            h.update(key.encode() + np.ascontiguousarray(arrays[key]).tobytes())
        return h.hexdigest()

    # -- snapshots -----------------------------------------------------------------------------------------------

    def save(self, path: str | Path) -> None:
        """Write a snapshot (``.npz``, no pickles): all data of this scene, bit for bit."""
        arrays: dict[str, np.ndarray] = {}
        document = {"version": SNAPSHOT_VERSION, "scene": _encode(self, arrays, "")}
        arrays["document"] = np.frombuffer(json.dumps(document).encode(), np.uint8)
        # Written to memory first: a full disk or a crash leaves no half snapshot under the final name.
        stream = io.BytesIO()
        np.savez_compressed(stream, **arrays)
        path = Path(path)
        temporary = path.with_name(path.name + ".part")
        temporary.write_bytes(stream.getvalue())
        temporary.replace(path)

    @staticmethod
    def load(path: str | Path) -> Scene:
        """Read a snapshot. Raises SnapshotError with a reason for a file that isn't a whole one."""
        try:
            with np.load(Path(path), allow_pickle=False) as data:
                document = json.loads(bytes(data["document"]).decode())
                if document.get("version") != SNAPSHOT_VERSION:
                    raise SnapshotError(
                        f"{path}: snapshot version {document.get('version')}, this Quartet reads {SNAPSHOT_VERSION}; "
                        "take the snapshot again"
                    )
                arrays = {key: data[key] for key in data.files if key != "document"}
            scene = _decode(document["scene"], arrays)
            scene._validate()
            return scene
        except SnapshotError:
            raise
        except FileNotFoundError:
            raise SnapshotError(f"{path}: no such snapshot") from None
        except (OSError, ValueError, KeyError, TypeError, IndexError, AttributeError, zipfile.BadZipFile, EOFError) as e:
            raise SnapshotError(f"{path}: damaged or not a Quartet snapshot ({type(e).__name__}: {e})") from e
        except Exception as e:
            # zlib.error and its kin have no common base with the above.
            raise SnapshotError(f"{path}: damaged snapshot ({type(e).__name__}: {e})") from e

    def _validate(self) -> None:
        """Check the indices that the GPU would follow blindly."""
        inst = self.instances
        if len(inst) and (inst.mesh.min() < 0 or inst.mesh.max() >= len(self.meshes)):
            raise SnapshotError("an instance refers to a mesh that is not there")
        for mesh in self.meshes:
            if len(mesh.triangles) and mesh.triangles.max() >= len(mesh.positions):
                raise SnapshotError(f"mesh {mesh.name}: a triangle refers to a vertex that is not there")
        for used in inst.materials:
            if any(not 0 <= m < len(self.materials) for m in used):
                raise SnapshotError("an instance refers to a material that is not there")


_TYPES: dict[str, type] = {}


def _encode(value: Any, arrays: dict[str, np.ndarray], path: str) -> Any:
    if isinstance(value, np.ndarray):
        key = f"a{len(arrays)}"
        arrays[key] = value
        return {"$array": key}
    if is_dataclass(value):
        body = {
            f.name: _encode(getattr(value, f.name), arrays, f"{path}.{f.name}")
            for f in fields(value)
            if f.name != "uid"
        }
        return {"$type": type(value).__name__, **body}
    if isinstance(value, tuple):
        return {"$tuple": [_encode(v, arrays, path) for v in value]}
    if isinstance(value, list):
        return [_encode(v, arrays, path) for v in value]
    if isinstance(value, dict):
        return {"$dict": [[k, _encode(v, arrays, f"{path}.{k}")] for k, v in value.items()]}
    if isinstance(value, np.generic):
        return value.item()
    return value


def _decode(value: Any, arrays: dict[str, np.ndarray]) -> Any:
    if isinstance(value, list):
        return [_decode(v, arrays) for v in value]
    if not isinstance(value, dict):
        return value
    if "$array" in value:
        return arrays[value["$array"]]
    if "$tuple" in value:
        return tuple(_decode(v, arrays) for v in value["$tuple"])
    if "$dict" in value:
        return {k: _decode(v, arrays) for k, v in value["$dict"]}
    cls = _TYPES[value["$type"]]
    return cls(**{k: _decode(v, arrays) for k, v in value.items() if k != "$type"})


def _plain(value: Any) -> Any:
    """A dataclass as nested tuples whose repr is its content (arrays by their bytes)."""
    if is_dataclass(value):
        return tuple((f.name, _plain(getattr(value, f.name))) for f in fields(value))
    if isinstance(value, np.ndarray):
        return value.tobytes()
    return value


_TYPES.update({
    c.__name__: c
    for c in (Scene, Mesh, Image, Material, Light, Camera, World, Instances, ShaderGraph, Node, Link)
})  # fmt: skip

__all__ = [
    "ALL_RAYS",
    "CAMERA",
    "CATCHER",
    "DIFFUSE",
    "EVERY_SET",
    "GLOSSY",
    "HOLDOUT",
    "LIGHT_SETS",
    "SHADOW",
    "TRANSMISSION",
    "VOLUME",
    "Camera",
    "Image",
    "Instances",
    "Light",
    "Link",
    "Material",
    "Mesh",
    "Node",
    "Scene",
    "ShaderGraph",
    "SnapshotError",
    "World",
    "blocker_set",
    "receiver_set",
    "replace",
    "set_bits",
]  # fmt: skip
