# SPDX-License-Identifier: GPL-3.0-or-later
"""Points spread evenly over all of the scene's surfaces: where light goes on from after its first bounce."""

from __future__ import annotations

import numpy as np

from ..facts import Facts
from ..frame import Frame
from ..gl.structs import struct
from ..graph import Buffer, Pass, Planned
from ..materials import mean_albedo, mean_emission
from ..scene import DIFFUSE, Scene
from ..sequence import sobol_2d

SURFACE_SAMPLE = struct(
    ("position_ws", "f4", 3), ("area", "f4"),  # m², that it stands for in a sub-frame
    ("normal_ws", "f4", 3), ("_pad", "f4"),
    ("albedo", "f4", 3), ("_pad1", "f4"),  # of the front, where the normal points
    ("albedo_back", "f4", 3), ("_pad2", "f4"),
)  # fmt: skip
# Sub-frames with points of their own; later ones start over.
SETS = 256


def points_per_subframe(facts: Facts) -> int:
    """Half as many as first-bounce lights: what bounces twice is dimmer and smoother."""
    return max(1, facts.settings.rsm.samples // 2)


def _count(facts: Facts) -> int:
    return points_per_subframe(facts) * min(facts.subframes, SETS)


class SurfacePoints(Pass):
    """Draws the points."""

    title = "Surface Points"
    writes = (
        Buffer("surface.points", "surface_points", "points uniform over the surfaces' area, those of each sub-frame together",
               "SurfaceSample", SURFACE_SAMPLE, _count),
    )  # fmt: skip
    depends = ("transforms", "meshes", "materials")
    settings = ("rsm.samples", "bounces")

    def rate(self, facts: Facts) -> str:
        return "static"

    def absent(self, facts: Facts) -> str | None:
        if facts.settings.bounces < 2:
            return "light bounces once at most"
        return None if facts.triangles else "the scene has no surfaces"

    def run(self, frame: Frame, planned: Planned) -> None:
        points = surface_points(frame.gpu.scene, _count(planned.facts), points_per_subframe(planned.facts))
        frame.upload("surface.points", points)


def surface_points(scene: Scene, count: int, per_set: int) -> np.ndarray:
    """``count`` SURFACE_SAMPLEs by the low-discrepancy sequence; in sets of ``per_set`` each stands for its share of the
    area. All zero where the scene has no area."""
    out = np.zeros(count, SURFACE_SAMPLE)
    # Lamps are left out: what they reflect is nothing beside what they shine, and between a lamp and the ceiling it hangs
    # from, closer than a cell, light would be handed to and fro and leak.
    albedos = [
        np.zeros((2, 3)) if (mean_emission(m.graph, scene.images) > 0.0).any()
        else np.stack([mean_albedo(m.graph, scene.images, back=back) for back in (False, True)])
        for m in scene.materials
    ]  # fmt: skip
    corners, colors = [], []
    for i, material, triangles in scene.world_triangles(DIFFUSE, [(color > 0.0).any() for color in albedos]):
        corners.append(triangles)
        # A mirrored triangle winds the other way, its front stays.
        mirrored = np.linalg.det(scene.instances.matrix[i, :3, :3]) < 0.0
        color = albedos[material]
        colors.append(np.broadcast_to(color[::-1] if mirrored else color, (len(triangles), 2, 3)))
    if not corners:
        return out
    corners, colors = np.concatenate(corners), np.concatenate(colors)
    a, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(u, v)
    area = 0.5 * np.nan_to_num(np.linalg.norm(normal, axis=1))
    total = float(area.sum())
    if total <= 0.0:
        return out
    cdf = np.cumsum(area) / total
    x = sobol_2d(np.arange(count), 31)
    index = np.searchsorted(cdf, x[:, 0], side="right").clip(0, len(cdf) - 1)
    low = np.where(index > 0, cdf[index - 1], 0.0)
    # The rest of the number that chose the triangle is as good as new.
    first = np.sqrt(((x[:, 0] - low) / np.maximum(cdf[index] - low, 1e-12)).clip(0.0, 1.0))
    b1, b2 = first * (1.0 - x[:, 1]), first * x[:, 1]
    out["position_ws"] = a[index] + u[index] * b1[:, None] + v[index] * b2[:, None]
    out["normal_ws"] = normal[index] / np.maximum(2.0 * area[index], 1e-30)[:, None]
    out["albedo"], out["albedo_back"] = colors[index, 0], colors[index, 1]
    out["area"] = total / per_set
    return out
