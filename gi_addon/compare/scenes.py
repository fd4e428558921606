# SPDX-License-Identifier: GPL-3.0-or-later
"""Test scenes made by code: Cornell boxes, the integrating sphere, form-factor patches and their like.

They are plain Scenes; ``host/build.py`` puts the same scenes into Blender, so that Cycles renders what Quartet does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..scene import (
    Camera,
    Instances,
    Light,
    Link,
    Material,
    Mesh,
    Node,
    Scene,
    ShaderGraph,
    World,
)

WHITE = (0.725, 0.71, 0.68)
RED = (0.63, 0.065, 0.05)
GREEN = (0.14, 0.45, 0.091)


# --- materials, lights, cameras ---------------------------------------------------------------------------------------


def diffuse(color: Sequence[float], name: str = "Diffuse") -> Material:
    """A Lambert surface: Diffuse BSDF of ``color``."""
    return Material(name, ShaderGraph((Node("BSDF_DIFFUSE", name, {"Color": tuple(color)}),), Link(0, "BSDF")))


def principled(name: str = "Principled", **inputs: float | Sequence[float]) -> Material:
    """A Principled BSDF with socket values by name (``Base_Color=…``)."""
    values = {k.replace("_", " "): tuple(v) if isinstance(v, (tuple, list)) else float(v) for k, v in inputs.items()}
    return Material(name, ShaderGraph((Node("BSDF_PRINCIPLED", name, values),), Link(0, "BSDF")))


def emissive(color: Sequence[float], strength: float, name: str = "Emission") -> Material:
    """A surface that emits radiance ``color`` × ``strength``."""
    inputs = {"Color": tuple(color), "Strength": float(strength)}
    return Material(name, ShaderGraph((Node("EMISSION", name, inputs),), Link(0, "Emission")))


def world(color: Sequence[float] = (0.0, 0.0, 0.0), strength: float = 1.0, ao_distance: float = 10.0) -> World:
    """A world of one radiance."""
    node = Node("BACKGROUND", "Background", {"Color": tuple(color), "Strength": float(strength)})
    return World(ShaderGraph((node,), Link(0, "Background")), ao_distance)


def look_at(eye: Sequence[float], target: Sequence[float], up: Sequence[float] = (0.0, 0.0, 1.0)) -> np.ndarray:
    """world_from_view (4, 4) of a camera or light at ``eye`` looking along −Z at ``target``."""
    eye, target = np.asarray(eye, "f8"), np.asarray(target, "f8")
    z = eye - target
    z /= np.linalg.norm(z)
    x = np.cross(up, z)
    if np.linalg.norm(x) < 1e-9:
        x = np.cross((0.0, 1.0, 0.0), z)
    x /= np.linalg.norm(x)
    out = np.eye(4)
    out[:3, 0], out[:3, 1], out[:3, 2], out[:3, 3] = x, np.cross(z, x), z, eye
    return out


def perspective(
    eye: Sequence[float], target: Sequence[float], fov: float = 0.7, aspect: float = 16 / 9,
    clip: tuple[float, float] = (0.01, 1000.0),
) -> Camera:  # fmt: skip
    """A perspective camera with ``fov`` (rad) across the longer side."""
    near, far = clip
    half = np.tan(fov / 2.0)
    sx, sy = (1.0 / half, aspect / half) if aspect >= 1.0 else (1.0 / (half * aspect), 1.0 / half)
    projection = np.array([
        [sx, 0, 0, 0], [0, sy, 0, 0],
        [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)], [0, 0, -1, 0],
    ])  # fmt: skip
    return Camera(look_at(eye, target), projection, near, far)


def orthographic(
    eye: Sequence[float], target: Sequence[float], scale: float = 4.0, aspect: float = 16 / 9,
    clip: tuple[float, float] = (0.01, 1000.0),
) -> Camera:  # fmt: skip
    """An orthographic camera ``scale`` m across the longer side."""
    near, far = clip
    w, h = (scale, scale / aspect) if aspect >= 1.0 else (scale * aspect, scale)
    projection = np.array([
        [2 / w, 0, 0, 0], [0, 2 / h, 0, 0], [0, 0, -2 / (far - near), -(far + near) / (far - near)], [0, 0, 0, 1],
    ])  # fmt: skip
    return Camera(look_at(eye, target), projection, near, far)


def point_light(position: Sequence[float], power: float, radius: float = 0.0, color=(1.0, 1.0, 1.0)) -> Light:
    """An isotropic light of ``power`` W."""
    matrix = np.eye(4)
    matrix[:3, 3] = position
    return Light("Point", "POINT", power * np.asarray(color, "f8"), matrix, radius=radius)


def spot_light(
    position: Sequence[float], target: Sequence[float], power: float, size: float = 1.0, blend: float = 0.15,
    radius: float = 0.0, color=(1.0, 1.0, 1.0),
) -> Light:  # fmt: skip
    """A spot of full angle ``size`` rad."""
    return Light("Spot", "SPOT", power * np.asarray(color, "f8"), look_at(position, target), radius=radius,
                 spot_size=size, spot_blend=blend)  # fmt: skip


def sun_light(direction: Sequence[float], strength: float, angle: float = 0.0, color=(1.0, 1.0, 1.0)) -> Light:
    """Parallel light travelling along ``direction``, ``strength`` W/m² on a facing surface."""
    return Light("Sun", "SUN", strength * np.asarray(color, "f8"), look_at((0, 0, 0), direction), angle=angle)


def area_light(
    position: Sequence[float], target: Sequence[float], power: float, size: tuple[float, float] = (1.0, 1.0),
    shape: str = "RECTANGLE", spread: float = np.pi, color=(1.0, 1.0, 1.0),
) -> Light:  # fmt: skip
    """A rectangle or ellipse of ``size`` m shining towards ``target``."""
    return Light("Area", "AREA", power * np.asarray(color, "f8"), look_at(position, target), shape=shape, size=size,
                 spread=spread)  # fmt: skip


# --- geometry ---------------------------------------------------------------------------------------------------------


def mesh_from_quads(quads: np.ndarray, name: str = "Quads") -> Mesh:
    """Flat quads (N, 4, 3), counter-clockwise seen from their front, each with UVs over [0, 1]²."""
    quads = np.asarray(quads, "f4").reshape(-1, 4, 3)
    n = len(quads)
    normal = np.cross(quads[:, 1] - quads[:, 0], quads[:, 2] - quads[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.where(length > 0, normal / np.where(length > 0, length, 1.0), 0.0)
    triangles = (np.arange(n)[:, None] * 4 + np.array([0, 1, 2, 0, 2, 3])).reshape(-1, 3)
    uv = np.tile(np.array([[0, 0], [1, 0], [1, 1], [0, 1]], "f4"), (n, 1))
    return Mesh(
        name, quads.reshape(-1, 3), np.repeat(normal, 4, axis=0).astype("f4"), triangles.astype("u4"),
        np.array([[0, 0, len(triangles)]]), {"uv:UVMap": uv}, "UVMap",
    )  # fmt: skip


def box_quads(low: Sequence[float], high: Sequence[float], *, inward: bool = False) -> np.ndarray:
    """The six sides (6, 4, 3) of a box, in order −x, +x, −y, +y, −z, +z."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    quads = np.array([
        [[x0, y1, z0], [x0, y0, z0], [x0, y0, z1], [x0, y1, z1]],
        [[x1, y0, z0], [x1, y1, z0], [x1, y1, z1], [x1, y0, z1]],
        [[x0, y0, z0], [x1, y0, z0], [x1, y0, z1], [x0, y0, z1]],
        [[x1, y1, z0], [x0, y1, z0], [x0, y1, z1], [x1, y1, z1]],
        [[x0, y1, z0], [x1, y1, z0], [x1, y0, z0], [x0, y0, z0]],
        [[x0, y0, z1], [x1, y0, z1], [x1, y1, z1], [x0, y1, z1]],
    ], "f4")  # fmt: skip
    return quads[:, ::-1] if inward else quads


def sphere(radius: float = 1.0, segments: int = 64, rings: int = 32, *, inward: bool = False) -> Mesh:
    """A UV sphere about the origin with smooth normals."""
    theta = np.pi * np.arange(rings + 1) / rings
    phi = 2.0 * np.pi * np.arange(segments + 1) / segments
    t, p = np.meshgrid(theta, phi, indexing="ij")
    unit = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], -1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(rings), np.arange(segments), indexing="ij")
    a = (i * (segments + 1) + j).ravel()
    b, c, d = a + 1, a + segments + 1, a + segments + 2
    triangles = np.concatenate([np.stack([a, c, d], -1), np.stack([a, d, b], -1)])
    if inward:
        triangles = triangles[:, ::-1]
    normals = -unit if inward else unit
    uv = np.stack([p.ravel() / (2 * np.pi), 1.0 - t.ravel() / np.pi], -1).astype("f4")
    return Mesh("Sphere", (radius * unit).astype("f4"), normals.astype("f4"), triangles.astype("u4"),
                np.array([[0, 0, len(triangles)]]), {"uv:UVMap": uv}, "UVMap")  # fmt: skip


class SceneBuilder:
    """Collects placed meshes with one material each."""

    def __init__(self, name: str = "Scene") -> None:
        self.scene = Scene(name=name, world=world())
        self._placed: list[tuple[int, np.ndarray, int, int]] = []

    def add(self, mesh: Mesh, material: Material, matrix: np.ndarray | None = None, visibility: int = 63) -> SceneBuilder:
        """Place ``mesh`` with ``material`` at ``matrix`` (identity by default)."""
        scene = self.scene
        if mesh not in scene.meshes:
            scene.meshes.append(mesh)
        if material not in scene.materials:
            scene.materials.append(material)
        self._placed.append(
            (scene.meshes.index(mesh), np.eye(4) if matrix is None else np.asarray(matrix, "f8"),
             scene.materials.index(material), visibility)
        )  # fmt: skip
        return self

    def quads(self, quads: np.ndarray, material: Material, visibility: int = 63) -> SceneBuilder:
        """Add flat quads as one mesh."""
        return self.add(mesh_from_quads(quads), material, visibility=visibility)

    def light(self, light: Light) -> SceneBuilder:
        self.scene.lights.append(light)
        return self

    def build(self, camera: Camera | None = None, world_: World | None = None) -> Scene:
        """The Scene."""
        scene = self.scene
        n = len(self._placed)
        scene.instances = Instances.make(
            [p[0] for p in self._placed],
            np.array([p[1] for p in self._placed]).reshape(n, 4, 4),
            [(p[2],) for p in self._placed],
            visibility=[p[3] for p in self._placed],
        )
        scene.camera = camera
        if world_ is not None:
            scene.world = world_
        return scene


def _turned(quads: np.ndarray, degrees: float, center: Sequence[float]) -> np.ndarray:
    a = np.radians(degrees)
    r = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    return (quads - center) @ r.T + center


# --- scenes -----------------------------------------------------------------------------------------------------------


def cornell(
    *, blocks: bool = True, light: str = "spot", power: float = 60.0, aspect: float = 16 / 9, fov: float = 0.85
) -> Scene:
    """A Cornell box 2 m wide, open towards the camera at −y; ``light``: spot (from above, downwards), point, area, sun.

    The walls' backs face outwards, so that the camera's side is the only opening.
    """
    b = SceneBuilder(f"cornell-{light}{'' if blocks else '-empty'}")
    sides = box_quads((-1, -1, 0), (1, 1, 2), inward=True)
    white, red, green = diffuse(WHITE, "White"), diffuse(RED, "Red"), diffuse(GREEN, "Green")
    b.quads(sides[[3, 4, 5]], white)
    b.quads(sides[[0]], red)
    b.quads(sides[[1]], green)
    if blocks:
        tall = _turned(box_quads((-0.62, 0.05, 0.0), (-0.02, 0.65, 1.2)), 17.0, (-0.32, 0.35, 0.0))
        low = _turned(box_quads((0.05, -0.6, 0.0), (0.65, 0.0, 0.6)), -16.0, (0.35, -0.3, 0.0))
        b.quads(tall[[0, 1, 2, 3, 5]], white)
        b.quads(low[[0, 1, 2, 3, 5]], white)
    b.light({
        "spot": lambda: spot_light((0, 0, 1.98), (0, 0, 0), power, size=np.radians(100.0), blend=0.3),
        "point": lambda: point_light((0, 0, 1.6), power),
        "area": lambda: area_light((0, 0, 1.99), (0, 0, 0), power, (0.5, 0.5)),
        "sun": lambda: sun_light((0.25, 0.8, -0.9), power / 10.0),
    }[light]())  # fmt: skip
    return b.build(perspective((0, -4.2, 1.0), (0, 0, 1.0), fov, aspect))


def integrating_sphere(
    *, radius: float = 1.0, albedo: float = 0.5, power: float = 100.0, light: Sequence[float] = (0.0, 0.0, 0.0),
    segments: int = 96,
) -> Scene:  # fmt: skip
    """Stability test 1: inside a diffuse sphere one bounce of any light is ρΦ/(4πR²) everywhere."""
    b = SceneBuilder("integrating-sphere")
    b.add(sphere(radius, segments, segments // 2, inward=True), diffuse((albedo,) * 3))
    position = radius * np.asarray(light, "f8")
    b.light(point_light(position, power))
    return b.build(perspective((0.0, -0.5 * radius, 0.1 * radius), (0.0, radius, 0.0), 1.9,
                               clip=(1e-3 * radius, 10 * radius)))  # fmt: skip


def two_patches(*, distance: float = 1.0, size: float = 0.5, albedo: float = 0.6) -> Scene:
    """A lit square patch facing an unlit receiver point above it: the form factor of parallel squares.

    A narrow spot lights only the sender from between the two; the receiver is a small patch seen by the camera.
    """
    b = SceneBuilder("two-patches")
    h = size / 2.0
    sender = [[-h, -h, 0], [h, -h, 0], [h, h, 0], [-h, h, 0]]
    b.quads(np.array([sender]), diffuse((albedo,) * 3, "Sender"))
    r = 0.02 * size
    receiver = [[-r, r, distance], [r, r, distance], [r, -r, distance], [-r, -r, distance]]
    b.quads(np.array([receiver]), diffuse((1.0,) * 3, "Receiver"))
    b.light(sun_light((0.0, 0.9, -1.0), 10.0))
    return b.build(perspective((0.0, -0.6 * distance, 0.35 * distance), (0, 0, distance), 0.12, clip=(1e-3, 100.0)))


def plane_scene(light: Light, *, size: float = 8.0, material: Material | None = None) -> Scene:
    """A plane under one light, nothing to bounce: what direct light is compared with Cycles on."""
    b = SceneBuilder(f"plane-{light.kind.lower()}")
    h = size / 2.0
    b.quads(np.array([[[-h, -h, 0], [h, -h, 0], [h, h, 0], [-h, h, 0]]]), material or diffuse((0.8,) * 3))
    b.light(light)
    return b.build(perspective((0, -7, 4), (0, 0, 0), 0.9))


def corner(*, size: float = 2.0, depth: float = 1.0, height: float = 1.0, albedo: float = 0.8, strength: float = 5.0) -> Scene:
    """A lit floor against a dark wall at 90°: the sun runs along the wall, so only the floor's bounce lights it. Floor
    x ∈ ±size/2, y ∈ 0 … depth; wall at y = 0, z ∈ 0 … height."""
    b = SceneBuilder("corner")
    h = size / 2.0
    b.quads(np.array([[[-h, 0, 0], [h, 0, 0], [h, depth, 0], [-h, depth, 0]]]), diffuse((albedo,) * 3, "Floor"))
    b.quads(np.array([[[-h, 0, 0], [-h, 0, height], [h, 0, height], [h, 0, 0]]]), diffuse((albedo,) * 3, "Wall"))
    b.light(sun_light((0.0, 0.0, -1.0), strength))
    return b.build(perspective((0.0, 3.0, 1.7), (0.0, 0.3, 0.35), 0.85))


def sliding_plate(*, offset: float = 0.0, plate: float = 0.4, lift: float = 0.1) -> Scene:
    """A lit square plate at x = ``offset`` above a black floor, before a wall that it lights: for motion. The box around
    everything stays as it is while the plate moves."""
    b = SceneBuilder("sliding-plate")
    b.quads(np.array([[[-1, 0, 0], [1, 0, 0], [1, 1, 0], [-1, 1, 0]]]), diffuse((0.0,) * 3, "Floor"))
    b.quads(np.array([[[-1, 0, 0], [-1, 0, 1], [1, 0, 1], [1, 0, 0]]]), diffuse((0.8,) * 3, "Wall"))
    r = plate / 2.0
    mesh = mesh_from_quads(np.array([[[-r, -r, 0], [r, -r, 0], [r, r, 0], [-r, r, 0]]]))
    matrix = np.eye(4)
    matrix[:3, 3] = (offset, 0.35, lift)
    b.add(mesh, diffuse((0.8,) * 3, "Plate"), matrix)
    b.light(sun_light((0.0, 0.0, -1.0), 5.0))
    return b.build(perspective((0.0, 3.0, 1.7), (0.0, 0.3, 0.35), 0.85))


def thin_wall(thickness: float, *, offset: float = 0.0, degrees: float = 0.0, height: float = 1.0) -> Scene:
    """Two roofless rooms of 2 m × 2 m with a wall of ``thickness`` m between them, its middle at x = ``offset``; a lamp in
    the left one. All walls are equally high and the lamp is below their top: every straight line from a surface of the
    left room to the right room's floor crosses the wall, so after one bounce that floor is black. The camera looks down.
    ``degrees`` turns everything about z."""
    b = SceneBuilder("thin-wall")
    white = diffuse((0.8,) * 3, "White")
    box = box_quads((-2, -1, 0), (2, 1, height), inward=True)
    b.quads(box[[0, 1, 2, 3, 4]], white)
    half = thickness / 2.0
    b.quads(box_quads((offset - half, -1, 0), (offset + half, 1, height))[[0, 1, 5]], white)
    b.light(point_light((-1.0, 0.0, 0.6 * height), 50.0))
    scene = b.build(orthographic((0, 0, 6), (0, 0, 0), 4.6, aspect=16 / 9))
    angle = np.radians(degrees)
    turn = np.eye(4)
    turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return transformed(scene, turn)


def furnace(*, albedo: float = 1.0, radius: float = 1.0, strength: float = 1.0) -> Scene:
    """White furnace: a convex body in a uniform world. With albedo 1 it vanishes."""
    b = SceneBuilder("furnace")
    b.add(sphere(radius, 96, 48), diffuse((albedo,) * 3))
    return b.build(perspective((0, -4.0 * radius, 0), (0, 0, 0), 0.65), world((strength,) * 3))


def corridor(*, power: float = 60.0) -> Scene:
    """Two rooms and a corridor: the lamp is behind the door of the room that the camera does not stand in. What arrives
    here has bounced: leaks and missing bounces both show."""
    b = SceneBuilder("corridor")
    white, red, blue = diffuse(WHITE, "White"), diffuse(RED, "Red"), diffuse((0.1, 0.2, 0.6), "Blue")
    sides = box_quads((-1, -3, 0), (1, 3, 2), inward=True)
    b.quads(sides[[2, 3, 4, 5]], white)
    b.quads(sides[[0]], red)
    b.quads(sides[[1]], blue)
    # A wall of 0.1 m across the corridor with a doorway of 0.8 × 1.6 m.
    for low, high in (((-1, -0.05, 0), (-0.4, 0.05, 2)), ((0.4, -0.05, 0), (1, 0.05, 2)), ((-0.4, -0.05, 1.6), (0.4, 0.05, 2))):
        b.quads(box_quads(low, high), white)
    b.quads(box_quads((-0.7, -1.6, 0), (-0.3, -1.2, 0.7)), white)
    b.light(spot_light((0.35, 2.2, 1.9), (0.0, 0.6, 0.0), power, size=1.6, blend=0.3))
    return b.build(perspective((0.55, -2.8, 1.2), (-0.15, 0.0, 0.8), 1.1))


def fog(density: float, color: Sequence[float] = (0.0, 0.0, 0.0)) -> World:
    """A world filled with a medium of ``density`` per metre that scatters alike in all directions."""
    nodes = (
        Node("BACKGROUND", "Background", {"Color": tuple(color), "Strength": 1.0}),
        Node("VOLUME_SCATTER", "Fog", {"Color": (1.0, 1.0, 1.0), "Density": float(density), "Anisotropy": 0.0}),
    )
    return World(ShaderGraph(nodes, Link(0, "Background"), Link(1, "Volume")))


def effect(name: str) -> Scene:
    """A scene made for one effect of the paper's Table 1, in which little else happens."""
    b = SceneBuilder(f"effect-{name}")
    white, red = diffuse(WHITE, "White"), diffuse(RED, "Red")
    floor = np.array([[[-3, -3, 0], [3, -3, 0], [3, 3, 0], [-3, 3, 0]]])
    back = np.array([[[-3, 2, 0], [-3, 2, 4], [3, 2, 4], [3, 2, 0]]])[:, ::-1]
    tall = _turned(box_quads((-1.1, -0.3, 0), (-0.4, 0.4, 1.3)), 20, (-0.75, 0, 0))
    blocks = (tall, box_quads((0.4, -0.6, 0), (1.2, 0.2, 0.6)))
    camera = perspective((0, -5.0, 2.2), (0, 0.2, 0.6), 0.75)
    if name == "indirect_diffuse":
        return cornell()
    if name == "glossy":
        b.quads(floor, principled("Polished", Base_Color=(0.6, 0.6, 0.6, 1.0), Metallic=1.0, Roughness=0.15))
        b.quads(back, red)
        for quads in blocks:
            b.quads(quads, white)
        b.light(spot_light((-2.0, -3.0, 4.0), (0, 0, 0.5), 800.0, size=1.0))
        return b.build(camera)
    if name in ("shadows", "ao"):
        b.quads(floor, white)
        for quads in blocks:
            b.quads(quads, white)
        if name == "shadows":
            b.light(spot_light((-2.0, -2.0, 4.0), (0, 0, 0), 800.0, size=1.2, radius=0.15))
            return b.build(camera)
        return b.build(camera, world((0.5, 0.5, 0.5), ao_distance=2.0))
    if name == "translucency":
        b.quads(floor, white)
        matrix = np.eye(4)
        matrix[:3, 3] = (-0.8, 0, 0.6)
        wax = principled("Wax", Base_Color=(0.8, 0.6, 0.4, 1.0), Subsurface_Weight=1.0, Subsurface_Radius=(0.5, 0.25, 0.12),
                         Subsurface_Scale=0.2, Roughness=1.0)  # fmt: skip
        b.add(sphere(0.6, 48, 24), wax, matrix)
        paper = Material("Paper", ShaderGraph((Node("BSDF_TRANSLUCENT", "Paper", {"Color": (0.8, 0.75, 0.6)}),), Link(0, "BSDF")))
        b.quads(np.array([[[0.3, 0, 0], [1.5, 0, 0], [1.5, 0, 1.4], [0.3, 0, 1.4]]]), paper)
        b.light(spot_light((0.5, 2.5, 2.5), (0, 0, 0.5), 600.0, size=1.0, radius=0.05))
        return b.build(camera)
    if name == "volumetric":
        b.quads(floor, white)
        for quads in blocks:
            b.quads(quads, white)
        b.light(spot_light((-2.0, 1.0, 3.5), (0.3, 0, 0.3), 1500.0, size=0.9, blend=0.3))
        return b.build(camera, fog(0.08))
    if name == "area_lights":
        b.quads(floor, white)
        b.quads(back, red)
        for quads in blocks:
            b.quads(quads, white)
        panel = np.array([[[-2.4, -1.0, 3.2], [-2.4, 1.0, 3.2], [-1.0, 1.0, 3.8], [-1.0, -1.0, 3.8]]])
        b.quads(panel, emissive((1.0, 0.9, 0.7), 20.0, "Panel"))
        return b.build(camera)
    raise KeyError(name)


def window(material: Material, *, thickness: float = 0.2, albedo: float = 0.7) -> Scene:
    """A dark room, without the wall before the camera, whose only window is a slab of ``material`` that the sun shines on from
    outside, 10 W/m²."""
    b = SceneBuilder("window")
    walls = diffuse((albedo,) * 3, "Walls")
    b.quads(box_quads((-1, -1, 0), (1, 1, 2), inward=True)[[0, 1, 4, 5]], walls)
    out = 1 + thickness
    for low, high in (((-1, 1, 0), (-0.5, out, 2)), ((0.5, 1, 0), (1, out, 2)),
                      ((-0.5, 1, 0), (0.5, out, 0.6)), ((-0.5, 1, 1.6), (0.5, out, 2))):  # fmt: skip
        b.quads(box_quads(low, high), walls)
    b.quads(box_quads((-0.5, 1, 0.6), (0.5, out, 1.6)), material)
    b.light(sun_light((0.0, -1.0, 0.0), 10.0))
    return b.build(perspective((0, -2.6, 1.0), (0, 1, 1.0), 0.9))


def ball_over_floor(material: Material, *, albedo: float = 0.7) -> Scene:
    """A ball of ``material``, 40 cm in radius, in a spot's beam over a floor, which lies in its shadow."""
    b = SceneBuilder("ball-over-floor")
    b.quads(np.array([[[-1.5, -1.5, 0], [1.5, -1.5, 0], [1.5, 1.5, 0], [-1.5, 1.5, 0]]]), diffuse((albedo,) * 3, "Floor"))
    place = np.eye(4)
    place[:3, 3] = (0, 0, 0.6)
    b.add(sphere(0.4, 48, 24), material, place)
    b.light(spot_light((0.4, 0.8, 2.6), (0, 0, 0.6), 300.0, size=0.42))
    return b.build(perspective((0, -3.2, 1.6), (0, 0, 0.4), 0.75))


def transformed(scene: Scene, matrix: np.ndarray) -> Scene:
    """``scene`` moved, turned, scaled (uniformly) and mirrored by ``matrix`` (4, 4), in place. Power goes with the square of
    the scale, so that radiance stays; sun strength is that of a surface already. Of a mirrored scene the picture is
    mirrored from left to right."""
    determinant = np.linalg.det(matrix[:3, :3])
    scale = float(np.cbrt(abs(determinant)))
    rigid = matrix.copy()
    rigid[:3, :3] /= scale
    # Lights and cameras have right-handed axes: mirrored once more along their own x they have again.
    handed = np.diag([np.sign(determinant), 1.0, 1.0, 1.0])
    inst = scene.instances
    inst.matrix = matrix @ inst.matrix
    for i, light in enumerate(scene.lights):
        moved = rigid @ light.matrix @ handed
        moved[:3, 3] = (matrix @ light.matrix)[:3, 3]
        scene.lights[i] = replace(
            light, matrix=moved, radius=light.radius * scale, size=tuple(scale * v for v in light.size),
            emission=light.emission * (1.0 if light.kind == "SUN" else scale**2),
        )  # fmt: skip
    camera = scene.camera
    if camera is not None:
        pose = rigid @ camera.world_from_view @ handed
        pose[:3, 3] = (matrix @ camera.world_from_view)[:3, 3]
        near, far = camera.clip_start * scale, camera.clip_end * scale
        projection = handed @ camera.clip_from_view @ handed
        if camera.orthographic:
            projection[0, 0], projection[1, 1] = projection[0, 0] / scale, projection[1, 1] / scale
            projection[2] = [0, 0, -2 / (far - near), -(far + near) / (far - near)]
        else:
            projection[2] = [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)]
        scene.camera = replace(camera, world_from_view=pose, clip_from_view=projection, clip_start=near, clip_end=far,
                               aperture=camera.aperture * scale, focus=camera.focus * scale)  # fmt: skip
    scene.world.ao_distance *= scale
    return scene


# Scenes by name, for ``quartet compare builtin:NAME``.
BUILTIN = {
    "cornell": cornell, "cornell-empty": lambda: cornell(blocks=False), "cornell-area": lambda: cornell(light="area"),
    "cornell-point": lambda: cornell(light="point"), "corridor": corridor, "corner": corner, "furnace": furnace,
    "integrating-sphere": integrating_sphere, "sliding-plate": sliding_plate, "thin-wall": lambda: thin_wall(0.1),
    "two-patches": two_patches,
    **{f"effect-{name}": (lambda name=name: effect(name)) for name in (
        "indirect_diffuse", "glossy", "shadows", "ao", "translucency", "volumetric", "area_lights",
    )},
}  # fmt: skip


__all__ = [name for name in globals() if not name.startswith("_") and name not in ("annotations", "CAMERA", "np")]
