# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair and points as triangles: a rasteriser has no round ones.

A strand is a three-sided tube whose mean silhouette, over all sides it is looked at from, is that of the round hair: a
convex prism's mean width is its girth / π, 3√3 r′/π here, so r′ = 2π/(3√3) r. Its normals are the round hair's. A point is an
icosahedron once divided, its radius such that the mean silhouette (a quarter of its surface) is the sphere's.
"""

from __future__ import annotations

import bpy
import numpy as np

from ..scene import Mesh

_SIDES = 3
_WIDER = 2.0 * np.pi / (2.0 * _SIDES * np.sin(np.pi / _SIDES))
_DEFAULT_RADIUS = 0.005  # m, of curves without a radius, as in Cycles
MOST_STRANDS = 200_000


def tubes(name: str, points: np.ndarray, radii: np.ndarray, offsets: np.ndarray) -> Mesh:
    """Strands as a Mesh: ``points`` (P, 3) of all strands one after the other, ``radii`` (P,), ``offsets`` (S + 1,).

    Attribute ``attr:.hair`` holds (1, place along the strand, random of the strand) for the Hair Info node.
    """
    counts = np.diff(offsets)
    strand = np.repeat(np.arange(len(counts)), counts)
    index = np.arange(len(points))
    first, last = index == offsets[strand], index == offsets[strand + 1] - 1
    ahead, behind = np.where(last, index, index + 1), np.where(first, index, index - 1)
    tangent = _unit(points[ahead] - points[behind])
    # One reference per strand: the axis that its whole run is farthest from.
    run = points[np.maximum(offsets[1:] - 1, 0)] - points[np.minimum(offsets[:-1], len(points) - 1)]
    reference = np.eye(3)[np.abs(run).argmin(axis=1)][strand]
    u = _unit(np.cross(tangent, reference))
    v = np.cross(tangent, u)
    angle = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
    normal = u[:, None] * np.cos(angle)[None, :, None] + v[:, None] * np.sin(angle)[None, :, None]
    positions = points[:, None] + normal * (radii * _WIDER)[:, None, None]
    start = index[~last]
    a = (start[:, None] * _SIDES + np.arange(_SIDES)).reshape(-1)
    b = (start[:, None] * _SIDES + (np.arange(_SIDES) + 1) % _SIDES).reshape(-1)
    triangles = np.concatenate([np.stack([a, b, b + _SIDES], -1), np.stack([a, b + _SIDES, a + _SIDES], -1)])
    along = (index - offsets[strand]) / np.maximum(counts - 1, 1)[strand]
    random = (strand * 0.61803398875) % 1.0
    info = np.repeat(np.stack([np.ones(len(points)), along, random], -1), _SIDES, axis=0)
    return Mesh(
        name, positions.reshape(-1, 3).astype("f4"), normal.reshape(-1, 3).astype("f4"), triangles.astype("u4"),
        np.array([[0, 0, len(triangles)]]), {"attr:.hair": info.astype("f4")},
    )  # fmt: skip


def curves_mesh(obj: bpy.types.Object) -> Mesh | None:
    """A hair curves object."""
    data = obj.data
    position = data.attributes.get("position")
    if position is None or not len(position.data):
        return None
    points = np.empty(len(position.data) * 3, "f4")
    position.data.foreach_get("vector", points)
    radii = np.full(len(position.data), _DEFAULT_RADIUS, "f4")
    radius = data.attributes.get("radius")
    if radius is not None:
        radius.data.foreach_get("value", radii)
    offsets = np.empty(len(data.curve_offset_data), "i4")
    data.curve_offset_data.foreach_get("value", offsets)
    return tubes(obj.name, points.reshape(-1, 3), radii, offsets.astype("i8"))


def particle_meshes(obj: bpy.types.Object, render: bool) -> list[tuple[Mesh, int]]:
    """The hair of an object's particle systems, in world space: (mesh, material slot) each."""
    found = []
    for system in obj.particle_systems:
        settings = system.settings
        if settings.type != "HAIR" or settings.render_type != "PATH":
            continue
        parents, children = len(system.particles), len(system.child_particles)
        strands = range(parents, parents + children) if settings.child_type != "NONE" and children else range(parents)
        strands = strands[:MOST_STRANDS]
        steps = 2 ** (settings.render_step if render else settings.display_step) + 1
        if not strands or steps < 2:
            continue
        hair = system.co_hair
        points = np.array([hair(object=obj, particle_no=k, step=s) for k in strands for s in range(steps)], "f4")
        # A strand's points beyond its end are at the origin.
        points = points.reshape(len(strands), steps, 3)
        there = (points != 0.0).any(axis=2)
        for k in range(1, steps):
            points[:, k] = np.where(there[:, k, None], points[:, k], points[:, k - 1])
        along = np.linspace(0.0, 1.0, steps)
        radii = np.tile(_profile(settings, along), len(strands))
        offsets = np.arange(len(strands) + 1, dtype="i8") * steps
        name = f"{obj.name} {system.name}"
        found.append((tubes(name, points.reshape(-1, 3), radii, offsets), max(settings.material - 1, 0)))
    return found


def _profile(settings: bpy.types.ParticleSettings, along: np.ndarray) -> np.ndarray:
    """Radius along a hair: from root to tip by the settings' shape."""
    root, tip = (0.5 * v * settings.radius_scale for v in (settings.root_radius, settings.tip_radius))
    left = 1.0 - along
    if settings.shape < 0.0:
        left = left ** (1.0 + settings.shape)
    elif settings.shape > 0.0:
        left = left ** (1.0 / max(1.0 - settings.shape, 1e-6))
    radii = left * (root - tip) + tip
    if settings.use_close_tip:
        radii[-1] = 0.0
    return radii


def points_of(obj: bpy.types.Object) -> tuple[np.ndarray, np.ndarray]:
    """Positions (N, 3) and radii (N,) of a point cloud, object space."""
    position = obj.data.attributes.get("position")
    count = len(position.data) if position is not None else 0
    at, radii = np.zeros(count * 3, "f4"), np.full(count, 0.01, "f4")
    if count:
        position.data.foreach_get("vector", at)
        radius = obj.data.attributes.get("radius")
        if radius is not None:
            radius.data.foreach_get("value", radii)
    return at.reshape(-1, 3), radii


def ball() -> Mesh:
    """A sphere of radius 1: an icosahedron, each face divided in four."""
    g = (1.0 + np.sqrt(5.0)) / 2.0
    corners = [(s, t * g, 0.0) for s in (-1, 1) for t in (-1, 1)]
    corners = np.array(corners + [(0.0, s, t) for s, _, t in ((a, 0, b * g) for a in (-1, 1) for b in (-1, 1))]
                       + [(t * g, 0.0, s) for s in (-1, 1) for t in (-1, 1)])  # fmt: skip
    corners = _unit(corners)
    near = np.linalg.norm(corners[:, None] - corners[None], axis=2) < 1.2  # neighbours are 1.05 apart
    faces = [(i, j, k) for i in range(12) for j in range(i + 1, 12) for k in range(j + 1, 12)
             if near[i, j] and near[j, k] and near[i, k]]  # fmt: skip
    parts = []
    for i, j, k in faces:
        a, b, c = corners[i], corners[j], corners[k]
        if np.dot(np.cross(b - a, c - a), a) < 0.0:
            b, c = c, b
        ab, bc, ca = (_unit(p) for p in (a + b, b + c, c + a))
        parts += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    triangles = np.array(parts)
    # Cauchy: a convex body's mean shadow is a quarter of its surface.
    area = 0.5 * np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1).sum()
    normals = triangles.reshape(-1, 3).astype("f4")
    count = len(normals)
    return Mesh("ball", (normals * np.sqrt(4.0 * np.pi / area)).astype("f4"), normals,
                np.arange(count, dtype="u4").reshape(-1, 3), np.array([[0, 0, count // 3]]))  # fmt: skip


def _unit(v: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(v, axis=-1, keepdims=True)
    return v / np.where(length > 0.0, length, 1.0)
