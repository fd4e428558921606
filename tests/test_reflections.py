# SPDX-License-Identifier: GPL-3.0-or-later
"""Reflected rays shared among pixels (passes/reflections.py): energy, noise, edges and mirrors, in all four techniques."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import make

from gi_addon.compare import scenes
from gi_addon.renderer import inspect
from gi_addon.settings import Settings

WALL, FRONT, HEIGHT = 0.5 * 5.0 / np.hypot(1.0, 0.4) / np.pi, 1.0, 4.0  # radiance ρ E cosθ/π; where the wall stands; m
SPAN, EYE, LOOK = 3.0, np.array([0.0, -2.0, 2.2]), np.array([0.0, 2.0, -2.2]) / np.hypot(2.0, 2.2)


def floor_before_a_wall(*patches):
    """``patches`` ((low x, high x), material) of a floor before a lit wall of albedo ½, seen in parallel from above."""
    b = scenes.SceneBuilder()
    for (low, high), material in patches:
        b.quads(np.array([[[low, -1, 0], [high, -1, 0], [high, 1, 0], [low, 1, 0]]]), material)
    wall = [[-SPAN, FRONT, 0], [-SPAN, FRONT, HEIGHT], [SPAN, FRONT, HEIGHT], [SPAN, FRONT, 0]]
    b.quads(np.array([wall])[:, ::-1], scenes.diffuse((0.5,) * 3))
    b.light(scenes.sun_light((0.0, 1.0, -0.4), 5.0))
    return b.build(scenes.orthographic(tuple(EYE), (0, 0, 0), 1.0, aspect=16 / 9))


def metal(roughness: float):
    return scenes.principled(Base_Color=(1.0,) * 3, Metallic=1.0, Roughness=roughness, Specular_Tint=(1.0,) * 3)


def mirrored(scene, technique="RSM", resolution=(48, 27), **settings):
    """The light of Glossy Indirect (H, W), colour and all, without diffuse bounces."""
    p = make(scene, "Glossy Indirect", "Glossy Color", technique=technique, resolution=resolution, use_indirect_diffuse=False,
             **{"samples": 1, **settings}).passes  # fmt: skip
    return (p["Glossy Indirect"] * p["Glossy Color"])[..., 0]


def of_the_lobe(y: np.ndarray, roughness: float, count: int = 20000) -> np.ndarray:
    """What a white metal at (0, ``y``, 0) mirrors of the wall, over its radiance, without multiple scattering's gain: Σ G2/G1
    over visible normals (Heitz 2018) whose mirrored rays meet the wall, and the same for all of them: (N, 2)."""
    rng = np.random.default_rng(1)
    a, v = roughness**2, -LOOK
    # Visible normals of a stretched hemisphere (ibid., listing 1); here v lies in the plane x = 0.
    s = np.array([a * v[0], a * v[1], v[2]])
    s /= np.linalg.norm(s)
    t1 = np.array([-s[1], s[0], 0.0]) / np.hypot(s[0], s[1])
    t2 = np.cross(s, t1)
    u1, u2 = rng.random((2, count))
    r, phi = np.sqrt(u1), 2.0 * np.pi * u2
    p1, p2, k = r * np.cos(phi), r * np.sin(phi), 0.5 * (1.0 + s[2])
    p2 = (1.0 - k) * np.sqrt(1.0 - p1**2) + k * p2
    h = p1[:, None] * t1 + p2[:, None] * t2 + np.sqrt(np.maximum(0.0, 1.0 - p1**2 - p2**2))[:, None] * s
    h = h * [a, a, 1.0]
    h /= np.linalg.norm(h, axis=1, keepdims=True)
    out = 2.0 * (h @ v)[:, None] * h - v

    def lam(z):
        return 0.5 * (np.sqrt(1.0 + a * a * np.maximum(1.0 / z**2 - 1.0, 0.0)) - 1.0)

    up = out[:, 2] > 0.0
    weight = np.where(up, (1.0 + lam(v[2])) / (1.0 + lam(v[2]) + lam(np.maximum(out[:, 2], 1e-6))), 0.0)
    rows = []
    for at in y:
        t = (FRONT - at) / np.where(out[:, 1] > 0.0, out[:, 1], 1e-9)
        meets = up & (out[:, 1] > 0.0) & (t * out[:, 2] < HEIGHT) & (np.abs(t * out[:, 0]) < SPAN)
        rows.append((np.mean(weight * meets), np.mean(weight)))
    return np.array(rows)


# The picture spans 1 m across; a pixel's row lies so far along the floor.
def row_places(rows: int, columns: int) -> np.ndarray:
    height = ((np.arange(rows) + 0.5) / rows - 0.5) * rows / columns
    return height / LOOK[2] * -1.0


@pytest.mark.parametrize("roughness", [0.3, 0.6])
def test_a_rough_floor_shows_a_wall_as_its_lobe_says(gl, roughness):
    """The wall's share of the lobe by quadrature, row by row, with four rays a pixel: the mean within 1 %, a row's (48 pixels
    that share their rays) within 4 % of the wall's radiance."""
    seen = mirrored(floor_before_a_wall(((-3, 3), metal(roughness))), samples=4) / WALL
    share = of_the_lobe(row_places(*seen.shape), roughness)
    expected = share[:, 0] / share[:, 1]  # a white metal loses nothing: multiple scattering makes up for the rest
    assert seen.mean() == pytest.approx(expected.mean(), rel=0.01)
    assert seen.mean(axis=1) == pytest.approx(expected, abs=0.04)


@pytest.mark.parametrize("technique", ["RSM", "LPV", "VCT"])
def test_shared_rays_keep_the_light_and_take_the_noise(gl, technique):
    """Of a roughness of ½ each pixel shares about a hundred rays: the mean stays within three of its standard errors, and the
    variance between neighbours falls to less than a tenth."""
    scene = floor_before_a_wall(((-3, 3), metal(0.5)))
    alone, shared = (mirrored(scene, technique, share_reflections=s) for s in (False, True))
    noise = [float(np.mean(np.diff(a, axis=1) ** 2)) / 2.0 for a in (alone, shared)]
    assert noise[1] < 0.1 * noise[0] > 0.0
    assert shared.mean() == pytest.approx(float(alone.mean()), abs=float(3.0 * np.sqrt(noise[0] / alone.size)))
    assert shared.max() <= alone.max() + 1e-4, "a mean is brighter than what it is of"


@pytest.mark.parametrize("technique", ["RSM", "LPV", "VCT"])
def test_a_mirror_shares_nothing(gl, technique):
    """To the bit."""
    scene = floor_before_a_wall(((-3, 3), metal(0.0)))
    alone, shared = (mirrored(scene, technique, share_reflections=s) for s in (False, True))
    np.testing.assert_allclose(shared, alone, rtol=1e-5)
    assert alone.max() > 0.5 * WALL


def test_lobes_of_other_width_are_no_neighbours(gl):
    """Half the floor is a mirror, half is rough: the mirror stays as it is up to the last pixel, and the rough half is at the
    border as bright as without a border."""
    both = floor_before_a_wall(((-3, 0), metal(0.0)), ((0, 3), metal(0.6)))
    rough = mirrored(floor_before_a_wall(((-3, 3), metal(0.6))), samples=4)
    seen = mirrored(both, samples=4)
    alone = mirrored(both, samples=4, share_reflections=False)
    np.testing.assert_allclose(seen[:, :23], alone[:, :23], rtol=1e-5)
    assert seen[:, 25:30].mean() == pytest.approx(rough[:, 25:30].mean(), rel=0.03)


@pytest.mark.parametrize("roughness", [0.1, 0.5, 1.0])
def test_an_even_world_is_as_bright_in_rough_metal_as_it_is(gl, roughness):
    """A white metal under a world of radiance 1 reflects its albedo: Glossy Direct is 1, and no row is off by 3 %."""
    b = scenes.SceneBuilder()
    b.quads(np.array([[[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]]]), metal(roughness))
    scene = b.build(scenes.perspective((0, -3, 2), (0, 0, 0), 0.4), scenes.world((1.0,) * 3))
    p = make(scene, "Glossy Direct", technique="SSDO", ssdo__sources="SCREEN", samples=16, resolution=(64, 36)).passes
    light = p["Glossy Direct"][..., 0]
    assert light.mean() == pytest.approx(1.0, abs=0.01)
    assert np.abs(light.mean(axis=1) - 1.0).max() < 0.03


@pytest.mark.parametrize("technique", ["RSM", "LPV", "VCT", "SSDO"])
def test_what_is_off_or_not_there_shares_nothing(technique):
    glossy, matt = floor_before_a_wall(((-3, 3), metal(0.5))), scenes.cornell()
    for scene, settings, rounds in (
        (glossy, {}, 2), (glossy, {"share_reflections": False}, 1), (glossy, {"use_glossy": False}, 0), (matt, {}, 0),
    ):  # fmt: skip
        chosen = Settings(technique=technique)
        for name, value in settings.items():
            chosen.set(name, value)
        plan = inspect(scene, chosen, ("Combined",), resolution=(32, 18))
        assert sum(p.title.startswith("Reflection Sharing") for p in plan.run) == rounds, (settings, plan.text())


def dark_room(*, sun_on_the_wall: bool):
    """A closed room of zero-thickness walls with a floor of rough metal, seen at the foot of a wall; outside, a second wall in
    the sun. ``sun_on_the_wall``: another sun shines on the first wall's outside."""
    b = scenes.SceneBuilder()
    walls = scenes.box_quads((-1.5, -1.0, 0.0), (1.5, 1.0, 1.5))
    floor = np.abs(walls[..., 2]).max(axis=1) < 1e-6
    b.quads(walls[~floor], scenes.diffuse((0.5,) * 3))
    b.quads(walls[floor], metal(0.5))
    b.quads(np.array([[[-3, 4, 0], [-3, 4, 3], [3, 4, 3], [3, 4, 0]]])[:, ::-1], scenes.diffuse((0.5,) * 3))
    b.light(scenes.sun_light((0.0, 1.0, -0.5), 5.0))
    if sun_on_the_wall:
        b.light(scenes.sun_light((0.0, -1.0, -2.5), 1.0))
    return b.build(scenes.perspective((0, 0.3, 0.5), (0, 0.95, 0.0), 0.5))


@pytest.mark.parametrize("technique", ["RSM", "LPV"])
def test_rays_at_the_foot_of_a_wall_do_not_leave_the_room(gl, technique):
    """It is dark inside. Rays that start within a cell of a wall would pass it; they stop where the picture shows the wall, or
    a light's map its other side: of the second wall's radiance less than 2 % comes in, less where a light shines on the wall."""
    known, unknown = (mirrored(dark_room(sun_on_the_wall=s), technique).mean() for s in (True, False))
    assert unknown < 0.02 * 0.5 * 5.0 / np.hypot(1.0, 0.5) / np.pi
    assert known < 0.5 * unknown
