# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights in watts: what leaves them, what their maps hold, what arrives."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import make

from gi_addon import atlas
from gi_addon.compare import scenes
from gi_addon.emitters import Emitters
from gi_addon.focus import Focus
from gi_addon.gl import shared
from gi_addon.gpu_types import LIGHT_WORLD
from gi_addon.lights import build_rig, spread_profile
from gi_addon.materials.ies import mean_strength
from gi_addon.renderer import Renderer
from gi_addon.settings import Settings
from gi_addon.world_map import WorldMap


def flux_in_the_maps(scene, resolution: int) -> float:
    """Total flux (W) that the RSM's texels hold in an enclosure of albedo 1."""

    def job(gl):
        renderer = Renderer(gl)
        settings = Settings()
        settings.samples = 1
        settings.rsm.resolution = resolution
        renderer.render(scene, settings, ("Diffuse Indirect",), resolution=(16, 9))
        texture = renderer.frame.resources["rsm.flux"]
        levels = max(texture.size).bit_length() - 1
        total = float(np.frombuffer(texture.read(level=levels), "f4")[0])
        renderer.close()
        return total

    return shared().call(job)


def enclosure(light):
    b = scenes.SceneBuilder()
    b.add(scenes.sphere(2.0, 48, 24, inward=True), scenes.diffuse((1.0, 1.0, 1.0)))
    b.light(light)
    return b.build(scenes.perspective((0, -1, 0), (0, 1, 0), 1.0))


@pytest.mark.parametrize("resolution", [64, 256])
@pytest.mark.parametrize(
    ("name", "light", "power"),
    [
        ("point", scenes.point_light((0.3, 0.2, -0.1), 100.0), 100.0),
        ("area", scenes.area_light((0, 0, 0.5), (0.3, 0.1, -1), 100.0, (0.6, 0.3)), 100.0),
        ("disk", scenes.area_light((0, 0, 0.5), (0.3, 0.1, -1), 100.0, (0.6, 0.6), "DISK"), 100.0),
        ("spread", scenes.area_light((0, 0, 0.5), (0, 0, -1), 100.0, (0.2, 0.2), spread=1.0), 100.0),
    ],
    ids=lambda v: v if isinstance(v, str) else "",
)
def test_the_maps_hold_the_lights_power_at_any_resolution(gl, name, light, power, resolution):
    """Flux sums over the texels to Φ: energy must not depend on the RSM's resolution."""
    assert flux_in_the_maps(enclosure(light), resolution) == pytest.approx(power, rel=0.01)


def test_a_spots_cone_masks_and_does_not_concentrate(gl):
    """Φ/(4π) × ∫ smoothstep((cosθ − c)/((1 − c) blend)) dω: with x = the argument, ∫ = 2π (1−c)(1 − blend/2)."""
    size, blend = 1.2, 0.5
    c = np.cos(size / 2)
    expected = 100.0 / (4 * np.pi) * 2 * np.pi * (1 - c) * (1 - blend / 2)
    light = scenes.spot_light((0, 0, 0), (0.2, 0.3, -1), 100.0, size, blend)
    assert flux_in_the_maps(enclosure(light), 256) == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("half", [0.05, 0.4, 1.0, 1.5])
def test_the_spread_keeps_the_power(half):
    """∫ cosθ L(θ) dω = π for a profile of unit power per area and π."""
    tan, scale = spread_profile(half)
    theta = (np.arange(200000) + 0.5) / 200000 * half
    profile = np.maximum(tan - np.tan(theta), 0.0) * scale
    total = 2 * np.pi * np.sum(np.cos(theta) * np.sin(theta) * profile) * half / 200000
    assert total == pytest.approx(np.pi, rel=1e-3)


def test_a_sun_lights_a_facing_surface_by_its_strength(gl):
    scene = scenes.plane_scene(scenes.sun_light((0, 0, -1), 3.0, angle=0.3))
    image = make(scene, "Diffuse Direct", samples=16).passes["Diffuse Direct"]
    assert image[2:20, 10:-10].mean() * np.pi == pytest.approx(3.0, rel=3e-3)


def test_a_point_light_follows_the_inverse_square(gl):
    """E = Φ/(4π h²) right below, in the picture's centre."""
    for height in (1.0, 2.0):
        b = scenes.SceneBuilder()
        b.quads(np.array([[[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]]), scenes.diffuse((0.5,) * 3))
        b.light(scenes.point_light((0, 0, height), 50.0))
        scene = b.build(scenes.orthographic((0, 0, 0.9), (0, 1e-4, 0), 0.02))
        image = make(scene, "Diffuse Direct", samples=1, resolution=(8, 8)).passes["Diffuse Direct"]
        assert image.mean() * np.pi == pytest.approx(50.0 / (4 * np.pi * height**2), rel=2e-3)


def test_a_uniform_sky_lights_an_open_plane_by_pi(gl):
    """E = π L on an unoccluded surface: Diffuse Direct (E/π) is the sky's radiance."""
    b = scenes.SceneBuilder()
    b.quads(np.array([[[-4, -4, 0], [4, -4, 0], [4, 4, 0], [-4, 4, 0]]]), scenes.diffuse((0.5,) * 3))
    scene = b.build(scenes.perspective((0, -3, 3), (0, 0, 0), 0.5), scenes.world((0.2, 0.4, 0.8)))
    image = make(scene, "Diffuse Direct", samples=64, resolution=(32, 18)).passes["Diffuse Direct"]
    np.testing.assert_allclose(image.mean((0, 1)), (0.2, 0.4, 0.8), rtol=0.03)


def test_an_emissive_quad_equals_an_area_light(gl):
    """A quad of radiance L and area A is an area light of power π L A (on the side both shine to)."""
    side, radiance = 0.5, 20.0
    h = side / 2
    quad = np.array([[[-h, h, 1.5], [h, h, 1.5], [h, -h, 1.5], [-h, -h, 1.5]]])
    b = scenes.SceneBuilder()
    floor = np.array([[[-2, -2, 0], [2, -2, 0], [2, 2, 0], [-2, 2, 0]]])
    b.quads(floor, scenes.diffuse((0.5,) * 3))
    b.quads(quad, scenes.emissive((1, 1, 1), radiance))
    camera = scenes.perspective((0, -3, 1.2), (0, 0, 0), 0.5)
    mesh = make(b.build(camera), "Diffuse Direct", samples=64).passes["Diffuse Direct"]
    b = scenes.SceneBuilder()
    b.quads(floor, scenes.diffuse((0.5,) * 3))
    b.light(scenes.area_light((0, 0, 1.5), (0, 0, 0), np.pi * radiance * side * side, (side, side)))
    lamp = make(b.build(camera), "Diffuse Direct", samples=64).passes["Diffuse Direct"]
    rows = slice(0, 20)
    assert mesh[rows].mean() == pytest.approx(lamp[rows].mean(), rel=0.03)


def test_lights_that_are_not_numbers_are_left_out_with_a_note():
    good, bad = scenes.point_light((0, 0, 1), 10.0), scenes.point_light((0, 0, 1), 10.0)
    bad.matrix[0, 3] = np.nan
    off = scenes.point_light((0, 0, 1), 0.0)
    rig = build_rig(
        [good, bad, off], Focus.on(np.array([[-1.0] * 3, [1.0] * 3])), world=None, world_samples=1, emitters=Emitters.none(),
        emitter_samples=1, area_lights=True, shadows=True, bounces=True, shadow_resolution=64, bounce_resolution=64,
        world_resolution=64,
    )  # fmt: skip
    assert len(rig.sources) == 1
    assert len(rig.notes) == 1 and "not a number" in rig.notes[0]


def test_the_world_map_draws_directions_by_its_radiance():
    """Importance sampling integrates any function of direction: mean(f L/pdf) = ∫ f L dω."""
    rng = np.random.default_rng(3)
    radiance = rng.random((16, 32, 3)) ** 4
    radiance[12, 5] = 50.0
    world = WorldMap(radiance)
    u = (np.stack(np.meshgrid(np.arange(256), np.arange(256)), -1).reshape(-1, 2) + 0.5) / 256
    direction, weight, pdf = world.sample(u)
    np.testing.assert_allclose(np.linalg.norm(direction, axis=1), 1.0, atol=1e-6)
    up = np.maximum(direction[:, 2:], 0.0)
    theta = np.pi * ((np.arange(16 * 64) + 0.5) / (16 * 64) - 0.5)
    solid = (np.cos(theta) * np.pi / (16 * 64) * 2 * np.pi / 32)[:, None]
    fine = np.repeat(radiance, 64, axis=0)
    expected = (fine * (solid * np.maximum(np.sin(theta), 0.0)[:, None])[..., None]).sum((0, 1))
    np.testing.assert_allclose((up * weight).mean(axis=0), expected, rtol=0.02)
    assert (pdf > 0).all()


def test_a_light_in_the_world_map_is_found_where_blender_shows_it():
    """Blender's equirectangular convention: +X looks at u = ½, −Y at u = ¾, +Z at v = 1."""
    for direction, (u, v) in {(1, 0, 0): (0.5, 0.5), (0, -1, 0): (0.75, 0.5), (0, 0, 1): (0.5, 1.0)}.items():
        radiance = np.zeros((32, 64, 3))
        radiance[min(int(v * 32), 31), min(int(u * 64), 63)] = 1.0
        if v == 1.0:
            radiance[31] = 1.0
        found, _, _ = WorldMap(radiance).sample(np.array([[0.5, 0.5]]))
        assert found[0] @ np.array(direction) > 0.98


def test_tiles_of_an_atlas_do_not_overlap():
    sizes = [512, 64, 256, 256, 100, 16, 512, 300]
    corners, (width, height) = atlas.pack(sizes, power_of_two=True)
    used = np.zeros((height, width), int)
    for (x, y), size in zip(corners, sizes, strict=True):
        used[y : y + size, x : x + size] += 1
        assert x + size <= width and y + size <= height
    assert used.max() == 1
    assert width & (width - 1) == 0 and height & (height - 1) == 0


def test_sources_move_with_the_subframes_only_where_they_have_an_extent(gl):
    bounds = Focus.on(np.array([[-1.0] * 3, [1.0] * 3]))
    rig = build_rig(
        [scenes.point_light((0, 0, 1), 10.0), scenes.point_light((0, 0, 1), 10.0, 0.2)], bounds,
        world=WorldMap(np.ones((16, 32, 3))), world_samples=2, emitters=Emitters.none(), emitter_samples=1,
        area_lights=True, shadows=True, bounces=True, shadow_resolution=64, bounce_resolution=64, world_resolution=64,
    )  # fmt: skip
    a, b = rig.sample(0, 4, bounce=False).lights, rig.sample(1, 4, bounce=False).lights
    assert (a["position_ws"][0] == b["position_ws"][0]).all()
    assert (a["position_ws"][1] != b["position_ws"][1]).any()
    world = a["kind"] == LIGHT_WORLD
    assert (a["axis_ws"][world] != b["axis_ws"][world]).any()
    once = rig.sample(0, 1, bounce=False).lights
    np.testing.assert_allclose(once["position_ws"][1], (0, 0, 1), atol=1e-6)


def test_a_block_of_two_to_the_n_texels_is_of_one_tile():
    """Coarser levels of an atlas's sums are then each tile's own: 2^n blocks at multiples of 2^n."""
    sizes = [100, 512, 33, 64, 300]
    corners, _ = atlas.pack(sizes, power_of_two=True)
    blocks = set()
    for (x, y), size in zip(corners, sizes, strict=True):
        block = 1 << (size - 1).bit_length()
        assert x % block == y % block == 0
        covered = {(i, j) for i in range(x, x + block, 16) for j in range(y, y + block, 16)}
        assert not covered & blocks
        blocks |= covered


def test_many_dim_lights_share_samples_without_losing_light(gl):
    """40 lamps and 16 samples: a lamp has one in some sub-frames only, and all of its light in the mean. Each lamp sees the
    whole sphere, so of L lamps N samples in each of S sub-frames are discs of L/(NS) of it, and form factors K A/(1 + K A)
    are less than K A by 1 + L/(NS) (gather_lib.glsl)."""
    rng = np.random.default_rng(4)
    b = scenes.SceneBuilder()
    b.add(scenes.sphere(2.0, 48, 24, inward=True), scenes.diffuse((0.5,) * 3))
    for i in range(40):
        light = scenes.point_light(rng.uniform(-0.3, 0.3, 3), 1.0 + i % 3)
        light.name = f"Lamp {i}"
        b.light(light)
    scene = b.build(scenes.perspective((0, -1, 0), (0, 1, 0), 1.0))
    power = sum(float(light.emission[0]) for light in scene.lights)
    result = make(scene, "Diffuse Indirect", samples=32, rsm__samples=16, resolution=(16, 9))
    exact = 0.5 * power / (4 * np.pi * 2.0**2) / np.pi
    assert result.passes["Diffuse Indirect"].mean() == pytest.approx(exact / (1 + 40 / (16 * 32)), rel=0.01)


@pytest.mark.parametrize(("angles", "candela", "mean"), [
    ("0 90 180", "1 1 1", 0.0707),       # Cycles, an emission of one such lamp over a sphere of 64 x 32 pixels
    ("0 30 60 90 180", "1000 900 400 50 0", 16.90),
])  # fmt: skip
def test_a_photometric_lamp_sends_what_its_file_says_on_average(angles, candela, mean):
    """Cycles' flux through a sphere around the lamp, over its power; it bends between the angles, which here are straight."""
    count = len(angles.split())
    file = f"IESNA:LM-63-2002\n[TEST] some lamp\nTILT=NONE\n1 1000 1 {count} 1 1 2 0 0 0\n1 1 100\n{angles}\n0\n{candela}\n"
    assert mean_strength(file) == pytest.approx(mean, rel=0.05)
    assert mean_strength(file.replace("1 1000 1", "1 1000 2")) == pytest.approx(2.0 * mean, rel=0.05)


@pytest.mark.parametrize("text", ["", "TILT=NONE", "TILT=NONE\n1 1000 1 5 1", "TILT=INCLUDE\n1 2 3\nx"])
def test_what_is_no_photometric_file_has_no_mean(text):
    assert mean_strength(text) is None
