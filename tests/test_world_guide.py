# SPDX-License-Identifier: GPL-3.0-or-later
"""The world's directions are aimed at openings: less noise, the same light."""

from __future__ import annotations

import numpy as np
from conftest import make

from gi_addon.compare import scenes
from gi_addon.compare.scenes import SceneBuilder
from gi_addon.sequence import sobol_2d
from gi_addon.world_map import WorldMap

RADIANCE = 2.0
# A room of 4 × 4 × 2 m about the origin with a window in its ceiling.
WINDOW = ((-0.5, 0.5), (0.2, 1.2), 2.0)


def room():
    b = SceneBuilder("room")
    gray = scenes.diffuse((0.5,) * 3)
    sides = scenes.box_quads((-2, -2, 0), (2, 2, 2), inward=True)
    b.quads(sides[:5], gray)
    (x0, x1), (y0, y1), z = WINDOW
    for (a0, a1), (c0, c1) in (((-2, 2), (-2, y0)), ((-2, 2), (y1, 2)), ((-2, x0), (y0, y1)), ((x1, 2), (y0, y1))):
        b.quads(np.array([[[a0, c0, z], [a0, c1, z], [a1, c1, z], [a1, c0, z]]], "f4"), gray)
    return b.build(scenes.perspective((0, -1.8, 1.0), (0.0, 0.6, 0.0), 1.0), scenes.world((RADIANCE,) * 3))


def floor_irradiance(points: np.ndarray) -> np.ndarray:
    """Irradiance (N,) on the floor at ``points`` (N, 2) from the window's patch of sky, by quadrature over its area:
    ∫ L cosθ² / d² dA, both faces horizontal."""
    (x0, x1), (y0, y1), z = WINDOW
    n = 64
    x, y = np.meshgrid(x0 + (np.arange(n) + 0.5) / n * (x1 - x0), y0 + (np.arange(n) + 0.5) / n * (y1 - y0))
    d2 = (points[:, 0, None] - x.ravel()) ** 2 + (points[:, 1, None] - y.ravel()) ** 2 + z * z
    return (RADIANCE * z * z / d2**2).sum(axis=1) * (x1 - x0) * (y1 - y0) / n**2


def floor(camera, size) -> tuple[np.ndarray, np.ndarray]:
    """(mask (H, W), points (N, 2)): the pixels whose ray meets z = 0 away from the walls, and where."""
    width, height = size
    v, u = np.meshgrid((np.arange(height) + 0.5) / height * 2 - 1, (np.arange(width) + 0.5) / width * 2 - 1, indexing="ij")
    inverse = np.linalg.inv(np.asarray(camera.clip_from_view, "f8"))
    ray = np.stack([u, v, np.ones_like(u), np.ones_like(u)], -1) @ inverse.T
    world_from_view = np.asarray(camera.world_from_view, "f8")
    ray = (ray[..., :3] / ray[..., 3:]) @ world_from_view[:3, :3].T
    eye = world_from_view[:3, 3]
    hit = eye + ray * (-eye[2] / np.where(ray[..., 2] < 0, ray[..., 2], np.nan))[..., None]
    mask = (np.abs(hit[..., :2]) < 1.8).all(axis=-1)
    return mask, hit[mask][:, :2]


def test_a_room_is_lit_through_its_window_with_less_noise_and_the_same_light(gl):
    errors = {}
    for aimed in (True, False):
        result = make(room(), "Diffuse Direct", "Depth", "Normal", samples=64, world__aimed=aimed, resolution=(48, 27))
        direct = result.passes["Diffuse Direct"][..., 0]
        mask, points = floor(room().camera, (48, 27))
        assert mask.sum() > 300
        expected = floor_irradiance(points) / np.pi
        errors[aimed] = np.sqrt(((direct[mask] - expected) ** 2).mean()) / expected.mean()
        if aimed:
            assert abs(direct[mask].mean() / expected.mean() - 1.0) < 0.05
    assert errors[True] < 0.6 * errors[False], errors


def test_a_guided_map_gives_the_same_integral_and_bounded_weights():
    radiance = np.random.default_rng(2).random((24, 48, 3)) ** 4
    world = WorldMap(radiance)
    guided = world.guided(np.random.default_rng(3).random((12, 24)) ** 3)
    u = np.array([sobol_2d(i, 5) for i in range(1 << 13)])
    _, weight, pdf = guided.sample(u)
    luminance = weight @ [0.2126, 0.7152, 0.0722]
    assert abs(luminance.mean() / world.total - 1.0) < 0.01
    assert luminance.max() <= 4.001 * world.total and (pdf > 0.0).all()


def test_a_guide_that_sees_nothing_changes_nothing():
    world = WorldMap(np.ones((16, 32, 3)))
    assert world.guided(np.zeros((12, 24))) is world
    assert WorldMap(np.zeros((16, 32, 3))).guided(np.ones((12, 24))).black


def test_rays_through_the_cells_smooth_the_light_and_keep_its_mean(gl):
    size, scene = (48, 27), room()
    mask, points = floor(scene.camera, size)
    expected = floor_irradiance(points) / np.pi
    for technique in ("RSM", "LPV"):
        errors = {}
        for rays in (0, 32):
            result = make(scene, "Diffuse Direct", technique=technique, samples=8, world__rays=rays, resolution=size)
            direct = result.passes["Diffuse Direct"][..., 0][mask]
            errors[rays] = ((direct - expected) ** 2).mean() / expected.mean() ** 2
        assert errors[32] < 0.6 * errors[0], (technique, errors)
    many = make(scene, "Diffuse Direct", samples=64, world__rays=32, resolution=size).passes["Diffuse Direct"][..., 0][mask]
    plain = make(scene, "Diffuse Direct", samples=64, world__rays=0, resolution=size).passes["Diffuse Direct"][..., 0][mask]
    assert abs(many.mean() / expected.mean() - 1.0) < 0.03
    # Pixel by pixel too: the rays shift no light from one place to another.
    near = [np.sqrt(((p - expected) ** 2).mean()) / expected.mean() for p in (many, plain)]
    assert near[0] < near[1], near


def test_rays_through_cells_too_coarse_for_the_window_add_no_light(gl):
    """Cells of 31 cm hide most of the window, so A and B are wrong; their difference still has mean zero."""
    size, scene = (24, 14), room()
    mask, points = floor(scene.camera, size)
    result = make(scene, "Diffuse Direct", samples=256, world__rays=8, rsm__visibility_resolution=16, resolution=size)
    expected = floor_irradiance(points) / np.pi
    assert abs(result.passes["Diffuse Direct"][..., 0][mask].mean() / expected.mean() - 1.0) < 0.03


def test_rays_are_absent_without_a_world_or_when_switched_off(gl):
    off, dark = (
        make(scene, "Diffuse Direct", samples=1, world__rays=rays, resolution=(16, 9)).plan.text()
        for scene, rays in ((room(), 0), (scenes.cornell(), 32))
    )
    assert "World Rays — world.rays is 0" in off
    assert "World Rays — the world gives no light" in dark
