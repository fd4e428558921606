# SPDX-License-Identifier: GPL-3.0-or-later
"""Light below surfaces, against walks in slabs and half spaces and against Cycles' random walk."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import make
from gpu import evaluate

from gi_addon.compare import scenes
from gi_addon.engines import TECHNIQUES

WALKERS = sorted(set(TECHNIQUES) & {"RSM", "LPV", "VCT"})


def albedo_of_turns(albedo: float) -> float:
    """Single-scattering albedo by Wrenninge, Villemin and Hery's fit, anisotropy 0."""
    blend = albedo**0.25
    low = 1.8260523782 * np.arctan((4.98511194385 + 0.127355959438) * albedo) ** 1.09686102424
    return (1.0 - blend) * low + blend * 0.496310210422 * np.arctan((4.23190299701 + 0.00310603949088) * albedo) ** 2.40602999408


def slab(thickness: float, albedo: float, count: int = 40000, *, evenly: bool = False) -> tuple[float, float]:
    """(transmitted, returned) share of what goes straight, or ``evenly`` from all sides, into a slab ``thickness`` free paths
    thick whose surface does not refract: walks in one dimension, whose standard error is below .0025."""
    rng = np.random.default_rng(1)
    alpha = min(albedo_of_turns(albedo), 0.999999)
    depth, slope, weight = np.zeros(count), np.sqrt(rng.random(count)) if evenly else np.ones(count), 1.0
    through = back = 0.0
    for _ in range(512):
        depth = depth - slope * np.log(1.0 - rng.random(len(depth)))
        through += weight * np.count_nonzero(depth > thickness)
        back += weight * np.count_nonzero(depth < 0.0)
        depth = depth[(depth >= 0.0) & (depth <= thickness)]
        slope, weight = 2.0 * rng.random(len(depth)) - 1.0, weight * alpha
    return through / count, back / count


def wax(radius, albedo=0.8, **inputs):
    radius = radius if np.iterable(radius) else (radius,) * 3
    return scenes.principled("Wax", Base_Color=(albedo,) * 3, Subsurface_Weight=1.0, Subsurface_Scale=1.0,
                             Subsurface_Radius=radius, **{"Specular_IOR_Level": 0.0, **inputs})  # fmt: skip


def lit_slab(thickness: float, material, *suns: float):
    """A slab that faces the camera; a sun of 3 W/m² per side in ``suns``: −1 behind, 1 in front."""
    b = scenes.SceneBuilder()
    b.quads(scenes.box_quads((-2, 0, -2), (2, thickness, 2)), material)
    for side in suns:
        b.light(scenes.sun_light((0.0, side, 0.0), 3.0))
    return b.build(scenes.orthographic((0, -1, 0), (0, 0, 0), 2.0, aspect=16 / 9))


def seen(scene, **settings) -> float:
    """Mean exitance over the sun's irradiance × albedo, around the picture's middle."""
    options = {"samples": 24, "resolution": (32, 18), "rsm__resolution": 256, **settings}
    return float(make(scene, "Diffuse Direct", **options).passes["Diffuse Direct"][4:14, 8:24].mean() * np.pi / 3.0)


def test_the_albedo_of_turns_is_the_fit(gl):
    """So is the decay of the diffuse field, within 2 % of the root of α = 2κ/ln((1 + κ)/(1 − κ)) from α = ½ on."""
    albedo = np.array([0.05, 0.2, 0.5, 0.8, 0.95], "f4")
    code = "vec4 evaluate(vec4 v) { float a = single_scattering_albedo(v.x); return vec4(a, diffuse_decay(a), 0.0, 0.0); }"
    found = gl(evaluate, code, np.stack([albedo] * 4, 1), "lib/subsurface_lib.glsl")
    expected = np.array([min(albedo_of_turns(float(a)), 0.999999) for a in albedo])
    np.testing.assert_allclose(found[:, 0], expected, rtol=1e-4)
    k = np.linspace(1e-6, 1.0 - 1e-9, 2000001)
    roots = np.interp(expected[1:4], (2.0 * k / np.log((1.0 + k) / (1.0 - k)))[::-1], k[::-1])
    np.testing.assert_allclose(found[1:4, 1], roots, rtol=0.03)


@pytest.mark.parametrize("thickness", [0.03, 0.1, 0.3])
def test_light_through_a_slab_is_that_of_walks(gl, thickness):
    """Lit evenly from behind: the share that walks of free path 5 cm carry through."""
    scene = lit_slab(thickness, wax(0.05), -1.0)
    expected, _ = slab(thickness / 0.05, 0.8)
    assert seen(scene) * 0.8 == pytest.approx(expected, rel=0.04)
    assert seen(scene, samples=1, use_translucency=False) == 0.0


def test_a_slab_that_absorbs_little_keeps_its_light(gl):
    """Lit alike on both sides, what does not come back has come through, whichever of the lights a walk looks for."""
    material = wax(0.05, albedo=0.97)
    assert seen(lit_slab(0.1, material, -1.0, 1.0)) * 0.97 == pytest.approx(1.0, rel=0.03)


def test_thick_wax_returns_what_a_half_space_does(gl):
    _, expected = slab(200.0, 0.8)
    assert seen(lit_slab(1.0, wax(0.005), 1.0)) * 0.8 == pytest.approx(expected, rel=0.03)


def test_a_channel_without_radius_keeps_its_light(gl):
    scene = lit_slab(0.5, wax((0.0, 0.0, 0.02)), 1.0)
    image = make(scene, "Diffuse Direct", samples=8, resolution=(32, 18)).passes["Diffuse Direct"][4:14, 8:24]
    assert image[..., :2] == pytest.approx(3.0 / np.pi, rel=1e-3)
    assert image[..., 2].mean() == pytest.approx(3.0 / np.pi * slab(25.0, 0.8)[1] / 0.8, rel=0.04)


@pytest.mark.parametrize("technique", WALKERS)
def test_every_technique_with_light_maps_lights_wax_from_behind(gl, technique):
    scene = lit_slab(0.1, wax(0.05), -1.0)
    assert seen(scene, technique=technique) * 0.8 == pytest.approx(slab(2.0, 0.8)[0], rel=0.05)


@pytest.mark.blender
def test_a_ball_lit_from_behind_is_that_of_cycles(blender, gl):
    """Well inside its outline: gain within 20 %, where nine tenths of the light came through."""
    from gi_addon.compare.metrics import rel_mse
    from gi_addon.host.build import build
    from gi_addon.host.cycles import Reference, render_passes, set_up

    b = scenes.SceneBuilder()
    b.add(scenes.sphere(0.45, 32, 16), wax((0.2, 0.15, 0.1), Specular_IOR_Level=0.5, Roughness=1.0))
    b.light(scenes.spot_light((0.4, 2.5, 1.5), (0, 0, 0), 600.0, size=0.6, radius=0.05))
    scene, size = b.build(scenes.perspective((0, -2.5, 0.4), (0, 0, 0), 0.75)), (64, 36)
    halves = []
    for seed in (1, 2):
        there = build(scene)
        there.render.resolution_x, there.render.resolution_y, there.render.resolution_percentage = *size, 100
        set_up(there, Reference(1, 96, seed))
        halves.append(render_passes(there, ("Diffuse Direct",))["Diffuse Direct"][..., :3][10:26, 24:40])
    tests = {
        on: make(scene, "Diffuse Direct", samples=24, resolution=size, use_translucency=on).passes["Diffuse Direct"][10:26, 24:40]
        for on in (True, False)
    }
    gain = 2.0 * tests[True].sum() / (halves[0] + halves[1]).sum()
    dark = tests[False].sum() / tests[True].sum()
    assert gain == pytest.approx(1.0, abs=0.2) and dark < 0.1, (gain, dark)

    def blocks(image):  # means of 8 × 8 pixels: single ones are noise in both
        return image.reshape(2, 8, 2, 8, 3).mean(axis=(1, 3))

    assert rel_mse(*map(blocks, (tests[True], *halves))) < 0.05
