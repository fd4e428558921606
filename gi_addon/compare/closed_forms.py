# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that can be written down: what the stability suite compares with instead of another renderer."""

from __future__ import annotations

import numpy as np

from ..scene import Camera


def polygon_form_factor(points: np.ndarray, normals: np.ndarray, polygon: np.ndarray) -> np.ndarray:
    """Form factors (N,) from differential areas to a polygon (K, 3) wholly in front of them: Lambert's formula,
    F = 1/(2π) Σ θᵢ n·Γᵢ with θᵢ the angle an edge spans and Γᵢ the unit normal of its plane with the point
    (J. Lambert 1760; Baum et al., SIGGRAPH 1989, eq. 7). Sign-free: the polygon may wind either way."""
    v = polygon[None].astype("f8") - points[:, None].astype("f8")
    v /= np.linalg.norm(v, axis=-1, keepdims=True)
    w = np.roll(v, -1, axis=1)
    cross = np.cross(v, w)
    length = np.linalg.norm(cross, axis=-1, keepdims=True)
    angle = np.arctan2(length, np.sum(v * w, -1, keepdims=True))
    gamma = cross / np.maximum(length, 1e-300)
    return np.abs(np.sum(angle[..., 0] * np.einsum("nki,ni->nk", gamma, normals.astype("f8")), -1)) / (2 * np.pi)


def camera_rays(camera: Camera, resolution: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Origins and directions (H, W, 3) of rays through the pixels' centres, row 0 at the bottom."""
    width, height = resolution
    x = (np.arange(width) + 0.5) / width * 2.0 - 1.0
    y = (np.arange(height) + 0.5) / height * 2.0 - 1.0
    ndc = np.stack([*np.meshgrid(x, y)], -1)
    inverse = np.asarray(camera.world_from_view, "f8") @ np.linalg.inv(np.asarray(camera.clip_from_view, "f8"))

    def at(z: float) -> np.ndarray:
        p = np.concatenate([ndc, np.full((*ndc.shape[:2], 1), z), np.ones((*ndc.shape[:2], 1))], -1) @ inverse.T
        return p[..., :3] / p[..., 3:]

    near, far = at(-1.0), at(1.0)
    return near, far - near


def hits(origin: np.ndarray, direction: np.ndarray, corner: np.ndarray, u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, ...]:
    """Where rays meet the parallelogram corner + s u + t v: (distance along the ray or inf, s, t)."""
    normal = np.cross(u, v)
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = ((corner - origin) @ normal) / (direction @ normal)
        local = origin + distance[..., None] * direction - corner
        s, t = local @ u / (u @ u), local @ v / (v @ v)
    inside = (distance > 0) & (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
    return np.where(inside, distance, np.inf), s, t


def visible_share(
    camera: Camera, radius: float, power: float, lamp: np.ndarray, count: int = 200_000, beyond: tuple[float, float] = (0.0, 0.0)
) -> float:
    """Share of the flux reflected inside a sphere that leaves from where the camera looks: by symmetry the share of the
    one-bounce irradiance that a screen-space method can know of. ``beyond`` is what it draws on each side of the picture, as
    shares of its width and height. Quadrature over a Fibonacci sphere."""
    i = np.arange(count) + 0.5
    z = 1.0 - 2.0 * i / count
    phi = np.pi * (1.0 + 5.0**0.5) * i
    unit = np.stack([np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), z], -1)
    points = radius * unit
    to_lamp = lamp - points
    d2 = np.sum(to_lamp**2, -1)
    direct = power / (4 * np.pi * d2) * np.maximum(0.0, np.sum(-unit * to_lamp, -1)) / np.sqrt(d2)
    clip = (
        np.concatenate([points, np.ones((count, 1))], -1)
        @ (np.asarray(camera.clip_from_view, "f8") @ np.linalg.inv(np.asarray(camera.world_from_view, "f8"))).T
    )
    seen = (clip[:, 3] > 0) & (np.abs(clip[:, :2]) <= clip[:, 3:] * (1.0 + 2.0 * np.asarray(beyond))).all(-1)
    return float(direct[seen].sum() / direct.sum())
