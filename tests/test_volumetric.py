# SPDX-License-Identifier: GPL-3.0-or-later
"""Single scattering in homogeneous media against integrals done by quadrature, and against Cycles."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import make, pictures_to

from gi_addon.compare import scenes
from gi_addon.compare.metrics import rel_mse
from gi_addon.renderer import inspect
from gi_addon.scene import Link, Node, ShaderGraph, World
from gi_addon.settings import Settings

SIZE = (32, 18)


def fog(density: float, color=(1.0, 1.0, 1.0), anisotropy: float = 0.0, kind: str = "VOLUME_SCATTER") -> World:
    """A black world full of a medium."""
    inputs = {"Color": tuple(color), "Density": density}
    inputs |= {"Anisotropy": anisotropy} if kind == "VOLUME_SCATTER" else {}
    nodes = (Node("BACKGROUND", "Background", {"Color": (0.0, 0.0, 0.0), "Strength": 0.0}), Node(kind, "Volume", inputs))
    return World(ShaderGraph(nodes, Link(0, "Background"), Link(1, "Volume")), 10.0)


def airlight(eye, rays, lamp, power, sigma, scattering, g, far=60.0):
    """∫ σs p I/d² e^(−σ(t + d)) dt along ``rays`` (N, 3) by 20 000 points, denser towards the eye."""
    t = far * np.linspace(0.0, 1.0, 20001) ** 3
    p = eye + t[None, :, None] * rays[:, None]
    to_lamp = lamp - p
    d = np.linalg.norm(to_lamp, axis=-1)
    cos = np.einsum("nti,ni->nt", to_lamp / d[..., None], rays)
    phase = (1 - g * g) / (4 * np.pi * (1 + g * g - 2 * g * cos) ** 1.5)
    value = scattering * phase * power / (4 * np.pi) / d**2 * np.exp(-sigma * (t + d))
    return np.trapezoid(value, t, axis=1) if hasattr(np, "trapezoid") else np.trapz(value, t, axis=1)


@pytest.mark.parametrize(("density", "anisotropy"), [(0.05, 0.0), (0.5, 0.0), (0.2, 0.7), (0.2, -0.4)])
def test_a_lamp_in_endless_fog_glows_as_the_integral_says(gl, density, anisotropy):
    b = scenes.SceneBuilder()
    lamp = np.array([0.6, 4.0, 0.3])
    b.light(scenes.point_light(lamp, 100.0))
    # Something for the maps to have bounds over, behind the camera.
    b.quads(scenes.box_quads((-9, -9, -9), (-8.9, -8.9, -8.9)), scenes.diffuse((0.5,) * 3))
    eye = np.zeros(3)
    camera = scenes.perspective(eye, (0, 1, 0), 0.9, clip=(1e-4, 100.0))
    image = make(b.build(camera, fog(density, anisotropy=anisotropy)), "Volume Direct", samples=32, resolution=SIZE,
                 pixel_filter="BOX", filter_width=0.01).passes["Volume Direct"][..., 0]  # fmt: skip
    half = np.tan(0.45)
    x = ((np.arange(SIZE[0]) + 0.5) / SIZE[0] * 2 - 1) * half
    z = ((np.arange(SIZE[1]) + 0.5) / SIZE[1] * 2 - 1) * half * SIZE[1] / SIZE[0]
    z, x = np.meshgrid(z, x, indexing="ij")
    rays = np.stack([x, np.ones_like(x), z], -1).reshape(-1, 3)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    expected = airlight(eye, rays, lamp, 100.0, density, density, anisotropy).reshape(image.shape)
    assert np.abs(image / expected - 1.0).mean() < 0.02
    assert image.mean() == pytest.approx(expected.mean(), rel=0.01)


def test_what_shines_behind_is_dimmed_by_beers_law_and_by_colour(gl):
    b = scenes.SceneBuilder()
    b.quads(np.array([[[-9, 3, -9], [9, 3, -9], [9, 3, 9], [-9, 3, 9]]]), scenes.emissive((1, 1, 1), 2.0))
    scene = b.build(scenes.orthographic((0, 0, 0), (0, 1, 0), 1.0, aspect=16 / 9, clip=(1e-4, 100.0)),
                    fog(0.5, (0.2, 0.5, 0.9), kind="VOLUME_ABSORPTION"))  # fmt: skip
    p = make(scene, "Combined", "Emission", "Volume Direct", samples=2, resolution=SIZE).passes
    expected = 2.0 * np.exp(-0.5 * (1.0 - np.array([0.2, 0.5, 0.9])) * 3.0)
    assert p["Emission"].reshape(-1, 3).mean(axis=0) == pytest.approx(expected, rel=1e-3)
    assert np.allclose(p["Combined"][..., :3], p["Emission"], rtol=1e-5)
    assert p["Volume Direct"].max() == 0.0


def test_a_lamps_light_is_dimmed_on_its_way_to_a_surface_and_on_to_the_next(gl):
    """In an absorbing medium the diffuse sphere's one bounce is ρΦ/(4πR²) · e^(−σR) · ∫ e^(−σd), d the chord, which the
    sphere's constant kernel spreads uniformly over cosines: mean of e^(−2σR cosθ) over the area is
    ∫ e^(−2σRμ) 2μ dμ."""
    sigma, radius = 0.7, 1.0
    scene = scenes.integrating_sphere(albedo=0.5, power=100.0)
    scene.world = fog(sigma, (0.0, 0.0, 0.0), kind="VOLUME_ABSORPTION")
    image = make(scene, "Diffuse Indirect", samples=8, resolution=SIZE).passes["Diffuse Indirect"][..., 0]
    mu = (np.arange(4096) + 0.5) / 4096
    chord = (np.exp(-2 * sigma * radius * mu) * 2 * mu).mean()
    expected = 0.5 * 100.0 / (4 * np.pi * radius**2) / np.pi * np.exp(-sigma * radius) * chord
    assert image.mean() == pytest.approx(expected, rel=0.02)


def test_clear_air_and_a_switched_off_effect_cost_nothing():
    foggy = scenes.cornell()
    foggy.world = fog(0.2)
    for scene, settings, runs in (
        (scenes.cornell(), {}, False), (foggy, {}, True), (foggy, {"use_volumetric": False}, False),
        (scenes.cornell(), {"volume.density": 0.1}, True),
    ):  # fmt: skip
        chosen = Settings()
        for name, value in settings.items():
            chosen.set(name, value)
        plan = inspect(scene, chosen, ("Combined",), resolution=SIZE)
        assert any("volume.light" in {w.name for w in p.writes} for p in plan.run) is runs


def test_dimming_does_not_depend_on_which_passes_are_asked_for(gl):
    scene = scenes.cornell()
    scene.world = fog(0.3)
    alone = make(scene, "Diffuse Color", samples=1, resolution=SIZE).passes["Diffuse Color"]
    together = make(scene, "Diffuse Color", "Combined", samples=1, resolution=SIZE).passes["Diffuse Color"]
    assert np.array_equal(alone, together)


@pytest.mark.blender
@pytest.mark.parametrize("light", ["spot", "point", "area"])
def test_shafts_are_as_bright_as_in_cycles(blender, gl, light):
    """Volume Direct beside Cycles: gain .9 to 1.1. Colours dim alike, too."""
    from gi_addon.host.build import build
    from gi_addon.host.cycles import Reference, render_passes, set_up

    scene = scenes.cornell()
    scene.lights = [{
        "spot": lambda: scenes.spot_light((0, 0, 1.98), (0, 0, 0), 60.0, size=1.0, blend=0.3),
        "point": lambda: scenes.point_light((0, -0.3, 1.4), 30.0),
        "area": lambda: scenes.area_light((0, 0, 1.99), (0, 0, 0), 40.0, (0.5, 0.5)),
    }[light]()]  # fmt: skip
    scene.world = fog(0.15, (0.9, 0.8, 0.7), 0.3)
    names, halves = ("Volume Direct", "Diffuse Direct", "Diffuse Color"), []
    for seed in (1, 2):
        there = build(scene)
        there.render.resolution_x, there.render.resolution_y, there.render.resolution_percentage = 64, 36, 100
        set_up(there, Reference(1, 32, seed))
        there.cycles.volume_bounces = 0
        halves.append(render_passes(there, names))
    test = make(scene, *names, samples=32, resolution=(64, 36)).passes
    for name, low, high in (("Volume Direct", 0.9, 1.1), ("Diffuse Direct", 0.97, 1.03), ("Diffuse Color", 0.98, 1.02)):
        a, b, t = (x[name][..., :3] for x in (*halves, test))
        pictures_to("volumetric", f"{light}-{name}", test=t, reference=(a + b) / 2)
        assert low < t.sum() / ((a + b) / 2).sum() < high, name
        if name == "Volume Direct":
            assert rel_mse(t, a, b) < 0.01


def test_fog_lights_a_floor_out_of_the_lamps_sight(gl):
    """A spot that shines level over a floor lights it by the fog alone: E = ∫ I σs e^(−σ(s + d)) p cosθ / d² dω ds, here by
    quadrature over a cone of even intensity; the phase function is even, so p = 1/4π."""
    density, height, power, half = 0.05, 1.0, 200.0, 0.2
    b = scenes.SceneBuilder()
    b.quads(np.array([[[-6, -6, 0], [6, -6, 0], [6, 6, 0], [-6, 6, 0]]], "f8"), scenes.diffuse((0.5,) * 3))
    # The wall that the beam ends on reflects nothing.
    b.quads(scenes.box_quads((3.0, -2, 0), (3.2, 2, 3)), scenes.diffuse((0.0,) * 3))
    b.light(scenes.spot_light((-2.0, 0.0, height), (0.0, 0.0, height), power, size=2 * half, blend=0.0))
    camera = scenes.orthographic((0.0, 0.0, 0.9), (0.0, 1e-4, 0.0), 0.4, aspect=16 / 9)
    scene = b.build(camera, fog(density))
    seen = make(scene, "Diffuse Indirect", samples=64, resolution=SIZE, use_ao=False).passes["Diffuse Indirect"]
    mu = 1.0 - (1.0 - np.cos(half)) * (np.arange(24) + 0.5) / 24
    phi = 2 * np.pi * (np.arange(32) + 0.5) / 32
    s = 5.0 * (np.arange(1000) + 0.5) / 1000
    mu, phi, s = np.meshgrid(mu, phi, s, indexing="ij")
    r = np.sqrt(1.0 - mu**2)
    p = np.stack([-2.0 + s * mu, s * r * np.cos(phi), height + s * r * np.sin(phi)], -1)
    keep = (p[..., 0] < 3.0) & (p[..., 2] > 0.0)
    d2 = (p**2).sum(axis=-1)
    value = power / (4 * np.pi) * density * np.exp(-density * (s + np.sqrt(d2))) / (4 * np.pi) * p[..., 2] / d2**1.5
    expected = (value * keep).mean() * 2 * np.pi * (1.0 - np.cos(half)) * 5.0
    # The camera's own way through the fog dims light and colour alike.
    assert seen[6:12, 10:22].mean() == pytest.approx(expected / np.pi, rel=0.05)
