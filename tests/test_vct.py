# SPDX-License-Identifier: GPL-3.0-or-later
"""Voxel cone tracing against closed forms. f_s = 1: nothing here is fitted."""

from __future__ import annotations

import re

import numpy as np
import pytest
import voxel_store
from conftest import make

from gi_addon.compare import scenes
from gi_addon.compare.closed_forms import polygon_form_factor
from gi_addon.compare.stability import PASS, Suite, run_one
from gi_addon.compare.stability_checks import leak, wall_reference
from gi_addon.gl import GL, shared
from gi_addon.outputs import OUTPUTS
from gi_addon.renderer import Renderer, inspect
from gi_addon.scene import Link, Material, Node, ShaderGraph
from gi_addon.settings import Settings, walk


def vct(scene, *outputs, **settings):
    return make(scene, *outputs, technique="VCT", **settings)


def volume(scene, level: int = 0, name: str = "vct.radiance", **settings) -> np.ndarray:
    """Light after one sub-frame: (axis, side, z, y, x, 4)."""
    chosen = Settings()
    chosen.technique, chosen.samples = "VCT", 1
    for key, value in settings.items():
        chosen.set(key.replace("__", "."), value)

    def job(g: GL):
        renderer = Renderer(g)
        renderer.render(scene, chosen, ("Diffuse Indirect",), resolution=(32, 18))
        _, out = voxel_store.light(renderer, level, name)
        renderer.close()
        return out

    return shared().call(job)


# --- what light is on a sheet -----------------------------------------------------------------------------------------


def test_a_low_step_throws_its_whole_shadow(gl):
    """Sun at cosine .1 over a step of ⅖ of a cell: four cells of the lower floor are dark, though the lit edge is near to its
    plane. Told by that nearness alone they shone as the step does."""
    b = scenes.SceneBuilder("step")
    step = 0.4 * 4.0 / 31.0
    white = scenes.diffuse((0.8,) * 3)
    upper = np.array([[[-2, -2, 0], [0, -2, 0], [0, 2, 0], [-2, 2, 0]]], "f8")
    lower = np.array([[[0, -2, -step], [2, -2, -step], [2, 2, -step], [0, 2, -step]]], "f8")
    riser = np.array([[[0, -2, -step], [0, 2, -step], [0, 2, 0], [0, -2, 0]]], "f8")
    b.quads(np.concatenate([upper, lower, riser]), white)
    b.light(scenes.sun_light((1.0, 0.0, -0.1), 10.0))
    scene = b.build(scenes.perspective((0, -4, 3), (0, 0, 0), 0.9))
    up = volume(scene, vct__resolution=32)[2, 0]
    column = up[..., 0].sum((0, 1)) / np.maximum(up[..., 3].sum((0, 1)), 1e-9)
    edge = len(column) // 2
    lit = column[edge - 6 : edge - 2].mean()
    assert column[edge + 1 : edge + 4].max() < 0.05 * lit
    np.testing.assert_allclose(column[edge + 6 : edge + 10], lit, rtol=0.05)


def test_a_corrugated_floor_sends_what_arrives(gl):
    """Ridges of 35° and half a cell wide, sun at 80°: the lit facets are four times as bright as a flat floor, and half of the
    surface is dark. Together they reflect what a flat floor does."""
    white = scenes.diffuse((0.8,) * 3)
    sent = []
    for height in (0.0, 0.7):
        b = scenes.SceneBuilder("corrugated")
        width = 4.0 / 63.0 / 2.0
        x = np.arange(-2.0, 2.0 - width / 2, width)
        rise = height * width / 2.0
        low, top, next_ = x, x + width / 2, x + width
        facets = [
            np.stack([np.stack([p, -2 + 0 * x, a + 0 * x], -1), np.stack([q, -2 + 0 * x, c + 0 * x], -1),
                      np.stack([q, 2 + 0 * x, c + 0 * x], -1), np.stack([p, 2 + 0 * x, a + 0 * x], -1)], 1)
            for p, q, a, c in ((low, top, 0.0, rise), (top, next_, rise, 0.0))
        ]  # fmt: skip
        b.quads(np.concatenate(facets), white)
        b.light(scenes.sun_light((1.0, 0.0, -np.tan(np.radians(10.0))), 10.0))
        scene = b.build(scenes.perspective((0, -4, 3), (0, 0, 0), 0.9))
        seen, through = 0.0, 1.0
        for layer in volume(scene, vct__resolution=32, rsm__resolution=2048)[2, 0, ::-1]:  # from above
            seen, through = seen + through * layer[..., 0], through * (1.0 - layer[..., 3])
        sent.append(seen[4:-4, 4:-4].mean())
    assert sent[1] == pytest.approx(sent[0], rel=0.15)


@pytest.mark.parametrize("up", [False, True])
def test_a_floor_beside_a_lit_outer_wall_is_dark_whichever_way_it_faces(gl, up):
    """A room without thickness, sunlit from outside. Cells where the floor meets the wall hold the wall's bright outer side too:
    it leaves to that side alone, not upwards."""
    b = scenes.SceneBuilder("room")
    box = scenes.box_quads((-1, -1, 0), (1, 1, 2), inward=True)
    floor = np.abs(box[..., 2]).max(axis=1) < 1e-9
    box[floor] = box[floor][:, :: 1 if up else -1]
    b.quads(box, scenes.diffuse((0.8,) * 3))
    b.light(scenes.sun_light((-1.0, 0.0, -0.2), 10.0))
    scene = b.build(scenes.perspective((0, -0.9, 1), (0, 0, 0.8), 1.2))
    fronts, backs = (volume(scene, name=name, vct__resolution=32) for name in ("vct.radiance", "vct.back"))
    floor_light = (fronts[2, 0] if up else backs[2, 1])[: fronts.shape[2] // 2]
    assert floor_light[..., 3].max() == 1.0
    assert floor_light[..., 0].max() < 1e-3 * backs[0, 1][..., 0].max()


def test_a_small_lampshade_does_not_mirror_itself(gl):
    """A cone in black surroundings mirrors next to nothing. It is four cells wide and a tenth of one thick: its sheets are not
    where it is, and rays met its own lit side (.056 of its light) where the picture shows that nothing stands."""
    turn = np.linspace(0.0, 2.0 * np.pi, 25)
    ring = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], -1)
    b = scenes.SceneBuilder("lampshade")
    b.quads(scenes.box_quads((-3.15,) * 3, (3.15,) * 3, inward=True), scenes.diffuse((0.0,) * 3))
    white = scenes.principled(**{"Base Color": (0.8,) * 3, "Roughness": 0.3, "Specular IOR Level": 1.0})
    for thick in (0.0, 0.012):
        low, high = ring * (0.18 - thick) + (0.03, 0.02, 0.04), ring * (0.04 - thick) + (0.03, 0.02, 0.18)
        b.quads(np.stack([low[:-1], low[1:], high[1:], high[:-1]], 1)[:, :: -1 if thick else 1], white)
    b.light(scenes.point_light((-1.0, -2.0, 2.0), 100.0))
    scene = b.build(scenes.perspective((0, -1.5, 0.5), (0, 0, 0.1), 0.35))
    passes = vct(scene, "Glossy Indirect", "Diffuse Direct", resolution=(64, 36), samples=4).passes
    assert passes["Glossy Indirect"].mean() < 0.025 * passes["Diffuse Direct"].mean()


# --- energy -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("lamp", [(0, 0, 0), (0.5, 0.0, 0.2)])
@pytest.mark.parametrize("resolution", [32, 64])
def test_sphere_one_bounce_matches_closed_form(gl, lamp, resolution):
    """Stability test 1: E₁ = ρΦ/(4πR²) everywhere; |g − 1| ≤ .05, CV ≤ .15."""
    scene = scenes.integrating_sphere(albedo=0.5, power=100.0, light=lamp, segments=64)
    image = vct(scene, "Diffuse Indirect", samples=8, vct__resolution=resolution).passes["Diffuse Indirect"][..., 0]
    g = image * np.pi / (0.5 * 100.0 / (4 * np.pi))
    assert abs(g.mean() - 1.0) <= 0.05
    assert g.std() / g.mean() <= 0.15


def test_light_does_not_depend_on_the_shadow_maps_resolution(gl):
    """Cells ask the map; how many of its texels fall into a cell does not matter."""
    scene = scenes.cornell(blocks=False)
    means = [
        vct(scene, "Diffuse Indirect", samples=4, rsm__resolution=r).passes["Diffuse Indirect"].mean()
        for r in (64, 256, 1024)
    ]
    assert max(means) / min(means) <= 1.02


def test_light_does_not_depend_on_the_grids_resolution(gl):
    """Stability test 13: drift of the mean ≤ 3 % from 16 to 64 cells."""
    scene = scenes.cornell(blocks=False)
    means = [
        vct(scene, "Diffuse Indirect", samples=8, vct__resolution=r).passes["Diffuse Indirect"].mean()
        for r in (16, 32, 64)
    ]
    assert max(means) / min(means) <= 1.03


def test_a_uniform_enclosure_returns_its_radiance(gl):
    """Stability test 3, the furnace: a convex object inside an emitter of radiance 1 receives E/π = 1; mean .98 … 1.01,
    and nowhere more than 1.01."""
    b = scenes.SceneBuilder()
    b.add(scenes.sphere(1.0, 48, 24, inward=True), scenes.emissive((1, 1, 1), 1.0))
    b.add(scenes.sphere(0.25, 32, 16), scenes.diffuse((1, 1, 1)))
    scene = b.build(scenes.perspective((0, -0.9, 0), (0, 0, 0), 0.5))
    p = vct(scene, "Diffuse Indirect", "Diffuse Color", samples=8, vct__emissive_voxels=True, gather_scale=1).passes
    seen = p["Diffuse Color"][..., 0] > 0.99
    image = p["Diffuse Indirect"][..., 0][seen]
    assert seen.sum() > 300
    assert 0.98 <= image.mean() <= 1.01
    assert image.max() <= 1.01


def test_an_empty_cornell_box_has_the_right_amount_of_light(gl):
    """Mean over the back wall of one bounce by quadrature of the lit floor and walls, ± 5 %."""
    scene = scenes.cornell(blocks=False, power=60.0)
    image = vct(scene, "Diffuse Indirect", samples=16, resolution=(96, 54)).passes["Diffuse Indirect"]
    n = 40
    u = (np.arange(n) + 0.5) / n * 2 - 1
    a, c = (g.ravel() for g in np.meshgrid(u, u, indexing="ij"))
    one = np.ones_like(a)
    white, red, green = (np.array(x) for x in (scenes.WHITE, scenes.RED, scenes.GREEN))
    walls = [
        (np.stack([a, c, 0 * one], -1), (0, 0, 1), white), (np.stack([-one, a, c + 1], -1), (1, 0, 0), red),
        (np.stack([one, a, c + 1], -1), (-1, 0, 0), green),
    ]  # fmt: skip
    lamp, cos_half = np.array([0, 0, 1.98]), np.cos(np.radians(50.0))
    receivers = np.stack([a[::7], one[::7], c[::7] + 1], -1)
    total = np.zeros(3)
    for points, normal, albedo in walls:
        d = lamp - points
        d2 = (d * d).sum(-1)
        w = d / np.sqrt(d2)[:, None]
        t = np.clip((w[:, 2] - cos_half) / ((1 - cos_half) * 0.3), 0, 1)
        arriving = 60.0 / (4 * np.pi) * t * t * (3 - 2 * t) * np.maximum(w @ normal, 0) / d2
        to = points[None] - receivers[:, None]
        e2 = (to * to).sum(-1)
        v = to / np.sqrt(e2)[..., None]
        form = np.maximum(-v[..., 1], 0) * np.maximum(-(v @ np.array(normal, "f8")), 0) / (np.pi * e2)
        total += (form * arriving).sum(1).mean() * (4.0 / n**2) * albedo / np.pi
    # The back wall in the picture: y = 1, seen from 5.2 m with a field of view of .85 across 96 pixels.
    half = 96 / 2 / np.tan(0.85 / 2) / 5.2
    wall = image[int(27 - half) + 1 : int(27 + half), int(48 - half) + 1 : int(48 + half)]
    np.testing.assert_allclose(wall.mean(axis=(0, 1)), total, rtol=0.05)


# --- what blocks light -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("degrees", [0, 15, 45])
def test_a_wall_two_cells_thick_keeps_light_out(gl, degrees):
    """Stability test 5 at w = 2: a lit and a dark room side by side; E_dark/E_lit ≤ 1 %, at any angle to the grid."""
    b = scenes.SceneBuilder()
    thick = 2.0 * 4.0 / 63.0
    a = np.radians(degrees)
    turn = np.array([[np.cos(a), -np.sin(a), 0, 0], [np.sin(a), np.cos(a), 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    white = scenes.diffuse((0.8,) * 3)
    for low, high in (((-1.5, -1, -1), (-thick / 2, 1, 1)), ((thick / 2, -1, -1), (1.5, 1, 1))):
        b.add(scenes.mesh_from_quads(scenes.box_quads(low, high, inward=True)), white, turn)
    b.quads(np.array([[[-2, -2, -1.2], [2, -2, -1.2], [2, 2, -1.2], [-2, 2, -1.2]]]), white)
    lamp = turn[:3, :3] @ np.array([-0.8, 0.0, 0.5])
    b.light(scenes.point_light(lamp, 50.0))

    def mean(x):
        eye, to = turn[:3, :3] @ np.array([x, -0.9, 0.0]), turn[:3, :3] @ np.array([x, 1.0, 0.0])
        scene = b.build(scenes.perspective(eye, to, 1.2))
        return vct(scene, "Diffuse Indirect", samples=4, resolution=(48, 27)).passes["Diffuse Indirect"].mean()

    assert mean(0.75) <= 0.01 * mean(-0.75)


def test_a_wall_covers_the_faces_of_its_cells_at_every_mip(gl):
    """A wall across the grid covers all of its cells' faces, in the cells and in each mip: alpha 1 of the side it faces."""
    wall = np.array([[[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]]])
    b = scenes.SceneBuilder().quads(wall, scenes.diffuse((0.5,) * 3))
    b.light(scenes.sun_light((0, 1, 0), 1.0))
    scene = b.build(scenes.perspective((0, -4, 0), (0, 0, 0), 0.8))
    for level in range(3):
        part = volume(scene, level, vct__resolution=32)[1, 1]  # −y
        np.testing.assert_allclose(part[1:-1, :, 1:-1, 3].max(axis=1), 1.0, atol=1e-3)


def test_a_wall_red_on_one_side_does_not_bleed_through(gl):
    """A wall two cells thick, red to the left and blue to the right: what leaves it to the right has < 1 % of the red."""
    thick = 2.0 * 2.0 / 31.0
    b = scenes.SceneBuilder()
    quads = scenes.box_quads((-thick / 2, -1, -1), (thick / 2, 1, 1))
    b.quads(quads[[0]], scenes.diffuse((0.9, 0.0, 0.0)))
    b.quads(quads[[1]], scenes.diffuse((0.0, 0.0, 0.9)))
    b.light(scenes.sun_light((1, 0, 0), 1.0)).light(scenes.sun_light((-1, 0, 0), 1.0))
    scene = b.build(scenes.perspective((0.5, -4, 0), (0, 0, 0), 0.8))
    for level in range(2):
        light = volume(scene, level, vct__resolution=32)[0, :, 2:-2, 2:-2]
        right, left = light.sum(axis=(1, 2, 3))
        assert right[2] > 0 and left[0] > 0
        assert right[0] <= 0.01 * right[2]
        assert left[2] <= 0.01 * left[0]


def test_empty_cells_hold_nothing(gl):
    """No light, at any mip: 0, not 0/0."""
    b = scenes.SceneBuilder().quads(scenes.box_quads((-1, -1, -1), (1, 1, 1)), scenes.diffuse((0.5,) * 3))
    b.light(scenes.point_light((0, -3, 0), 10.0))
    scene = b.build(scenes.perspective((0, -4, 0), (0, 0, 0), 0.8))
    for level in range(2):
        light = volume(scene, level, vct__resolution=32)
        assert np.isfinite(light).all()
        assert (light[:, :, 2:-2, 2:-2, 2:-2] == 0).all() and (light[..., 3] > 0).any()


@pytest.mark.parametrize(("cells", "up", "within"), [(1.0, True, 0.06), (1.0, False, 0.06), (2.0, True, 0.06), (0.5, False, 0.3)])
def test_a_lamp_close_to_a_floor_lights_it_and_hides_what_is_below(gl, cells, up, within):
    """An emissive square a cell or two above a floor, whichever way it faces: what a ceiling receives from the floor around it is
    ∫ ρ L F(x → lamp) cosθ cosθ'/(π d²) dA over what the lamp leaves visible, ± 6 %; nearer than a cell, where lamp and floor
    share cells, ± 30 %."""
    h = cells * 4.0 / 63.0
    lamp = np.array([[-0.25, -0.25, h], [0.25, -0.25, h], [0.25, 0.25, h], [-0.25, 0.25, h]])
    b = scenes.SceneBuilder()
    b.quads(np.array([[[-2.0, -2, 0], [2, -2, 0], [2, 2, 0], [-2, 2, 0]]]), scenes.diffuse((0.8,) * 3))
    b.quads((lamp if up else lamp[::-1])[None], scenes.emissive((1, 1, 1), 10.0))
    b.quads(np.array([[[-0.5, -0.5, 1.5], [-0.5, 0.5, 1.5], [0.5, 0.5, 1.5], [0.5, -0.5, 1.5]]]), scenes.diffuse((0.5,) * 3))
    scene = b.build(scenes.perspective((0, 0, 0.9), (0, 0.001, 1.5), 0.9))
    image = vct(scene, "Diffuse Indirect", samples=16, resolution=(32, 18), vct__cones=12).passes["Diffuse Indirect"]
    edge = np.sinh(np.linspace(-3.0, 3.0, 161))
    edge *= 2.0 / edge[-1]
    middle, width = (edge[1:] + edge[:-1]) / 2, np.diff(edge)
    x, y = np.meshgrid(middle, middle)
    floor = np.stack([x, y, 0 * x], -1).reshape(-1, 3)
    radiosity = 0.8 * np.pi * 10.0 * polygon_form_factor(floor, np.broadcast_to([0.0, 0, 1], floor.shape), lamp)
    flux = radiosity * np.outer(width, width).ravel()
    exact = []
    for px, py in ((px, py) for px in np.linspace(-0.2, 0.2, 3) for py in np.linspace(-0.12, 0.12, 3)):
        to = np.array([px, py, 1.5]) - floor
        d2 = (to * to).sum(-1)
        over = floor[:, :2] * (1 - h / 1.5) + np.array([px, py]) * (h / 1.5)
        seen = (np.abs(over) >= 0.25).any(-1)
        exact.append((flux * seen * to[:, 2] ** 2 / d2**2).sum() / np.pi**2)
    assert image.mean() == pytest.approx(np.mean(exact), rel=within)


# --- the rest of the stability suite --------------------------------------------------------------------------------------


def test_light_is_linear_in_power_and_two_lights_add(gl):
    """Stability test 17; what cones bring keeps its sign and strength."""
    def box(*lights):
        scene = scenes.cornell(blocks=False)
        scene.lights = list(lights)
        return vct(scene, "Diffuse Indirect", samples=2).passes["Diffuse Indirect"]

    def one(k=1.0):
        return scenes.point_light((-0.4, 0, 1.5), 40.0 * k)

    two = scenes.spot_light((0.3, 0, 1.9), (0, 0, 0), 90.0, 1.4, 0.3)
    a, b, both, bright = box(one()), box(two), box(one(), two), box(one(100.0))
    assert np.abs(bright - 100.0 * a).max() <= 1e-3 * bright.max()
    assert np.abs(both - a - b).max() <= 1e-3 * both.max()
    for k in (1e4, -1.0):
        assert np.abs(box(one(k)) - k * a).max() <= 1e-3 * abs(k) * a.max(), k


def test_the_same_input_gives_the_same_picture_bit_for_bit(gl):
    """Stability test 16."""
    scene = scenes.cornell(light="area")
    a, b = (vct(scene, "Combined", samples=2).passes["Combined"] for _ in range(2))
    assert np.array_equal(a, b)


def test_the_grid_stays_where_the_scene_is(gl):
    """Stability test 8: a camera's move re-lights nothing: the light on a wall is the same to .5 %."""
    def mean(x):
        scene = scenes.cornell(blocks=False)
        scene.camera = scenes.orthographic((x, -4.0, 1.0), (x, 0, 1.0), 0.8)
        return vct(scene, "Diffuse Indirect", samples=8, resolution=(64, 36), gather_scale=1).passes["Diffuse Indirect"].mean()

    assert mean(0.001) == pytest.approx(mean(0.0), rel=5e-3)


def test_every_pass_is_finite_whatever_the_scene(gl):
    """Stability test 18."""
    camera = scenes.perspective((0, -4, 1), (0, 0, 1), 0.8)
    mesh = scenes.mesh_from_quads(scenes.box_quads((-0.5, -0.5, 0), (0.5, 0.5, 1)))
    mesh.normals = np.zeros_like(mesh.normals)
    broken = scenes.mesh_from_quads(scenes.box_quads((-0.2, -0.2, 1.2), (0.2, 0.2, 1.5)))
    broken.positions[3] = np.nan
    broken.__post_init__()
    b = scenes.SceneBuilder()
    for part in (mesh, scenes.mesh_from_quads(np.zeros((1, 4, 3))), broken):
        b.add(part, scenes.principled(Metallic=0.5, Roughness=0.0))
    b.add(mesh, scenes.diffuse((1, 1, 1)), np.zeros((4, 4)))
    b.light(scenes.point_light((0.5, -0.5, 0.5), 10.0)).light(scenes.sun_light((0, 0, -1), 1.0))
    full = b.build(camera, scenes.world((0.1, 0.1, 0.1)))
    for scene in (scenes.SceneBuilder().build(camera), full):
        for name, image in vct(scene, *OUTPUTS, samples=2, resolution=(32, 18), vct__resolution=16).passes.items():
            assert np.isfinite(image).all(), name


def test_lights_are_injected_anew_and_voxels_stay(gl):
    """Static voxels are lit again when a light changes, with continuous voxelization off."""
    scene, settings = scenes.cornell(), Settings()
    settings.technique, settings.samples = "VCT", 1

    def job(g: GL):
        renderer = Renderer(g)
        def ran():
            result = renderer.render(scene, settings, ("Combined",), resolution=(48, 27), timed=True)
            return set(result.milliseconds), result.passes["Combined"][..., :3].mean()
        first, before = ran()
        again, _ = ran()
        scene.lights[0].emission = scene.lights[0].emission * 2.0
        light, after = ran()
        renderer.close()
        return first, again, light, before, after

    first, again, light, before, after = shared().call(job)
    assert {"Voxelization", "Voxel Radiance Injection"} <= first
    assert not {"Voxelization", "Voxel Radiance Injection"} & again
    assert "Voxel Radiance Injection" in light and "Voxelization" not in light
    assert after == pytest.approx(2.0 * before, rel=5e-3)


def test_what_is_switched_off_costs_nothing(gl):
    """No indirect light: no voxels. And the plan states their memory."""
    scene = scenes.cornell()

    def planned(**changed):
        settings = Settings()
        settings.technique = "VCT"
        for name, value in changed.items():
            settings.set(name.replace("__", "."), value)
        return inspect(scene, settings, resolution=(64, 36))

    on = planned()
    assert {"Voxelization", "Voxel Radiance Injection"} <= {p.title for p in on.run}
    assert re.search(r"vct.radiance: 4096×\d+ rgba16f, \d+\.\d+ MiB", on.text())
    for off in ({"use_indirect_diffuse": False}, {"bounces": 0}):
        plan = planned(**off)
        assert not [p.title for p in plan.run if p.title.startswith("Voxel")]
        assert not [name for name in plan.resources if name.startswith(("vct.", "voxels."))]


# --- the other effects ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("bounces", [2, 4])
def test_further_bounces_sum_the_geometric_series(gl, bounces):
    """Stability test 2: L_D = Σ ρ^k = 1 − .5^D of the light for ρ = .5, ± .025."""
    scene = scenes.integrating_sphere(albedo=0.5, power=100.0, light=(0.3, 0.0, 0.2), segments=48)
    image = vct(scene, "Diffuse Indirect", samples=4, bounces=bounces, vct__resolution=24).passes["Diffuse Indirect"][..., 0]
    assert image.mean() * np.pi / (100.0 / (4 * np.pi)) == pytest.approx(1 - 0.5**bounces, abs=0.025)


def _enclosed(material):
    b = scenes.SceneBuilder()
    b.add(scenes.sphere(1.0, 48, 24, inward=True), scenes.emissive((1, 1, 1), 1.0))
    b.add(scenes.sphere(0.3, 32, 16), material)
    return b.build(scenes.perspective((0, -0.9, 0), (0, 0, 0), 0.4))


@pytest.mark.parametrize("roughness", [0.0, 0.5])
def test_a_metal_ball_in_a_furnace_reflects_all_of_its_colour(gl, roughness):
    """Uniform radiance 1 around: the reflected light over the glossy colour is 1, ± 3 %, mirror or rough."""
    scene = _enclosed(scenes.principled(Metallic=1.0, Roughness=roughness, Base_Color=(0.9, 0.7, 0.4), IOR=1.5))
    p = vct(scene, "Glossy Indirect", "Glossy Color", samples=16, vct__emissive_voxels=True, resolution=(48, 27)).passes
    middle = np.zeros(p["Glossy Color"].shape[:2], bool)
    middle[9:18, 20:28] = True
    assert p["Glossy Indirect"][middle].mean() == pytest.approx(1.0, abs=0.03)


def test_ambient_occlusion_of_a_plane_is_open_and_of_a_box_is_closed(gl):
    """1 on an open plane; about 0 deep in a closed box; ½ at the foot of an endless wall."""
    plane = scenes.plane_scene(scenes.sun_light((0, 0, -1), 1.0))
    p = vct(plane, "Ambient Occlusion", "Diffuse Color", samples=2, resolution=(48, 27)).passes
    seen = p["Diffuse Color"][..., 0] > 0.79
    assert p["Ambient Occlusion"][seen].mean() == pytest.approx(1.0, abs=0.01)
    sphere = scenes.integrating_sphere()
    assert vct(sphere, "Ambient Occlusion", samples=2, resolution=(48, 27)).passes["Ambient Occlusion"].mean() < 0.02


def test_shadow_cones_agree_with_shadow_maps(gl):
    """Direct light of a Cornell box with blocks: the mean within 5 %."""
    scene = scenes.cornell()
    maps, cones = (vct(scene, "Diffuse Direct", samples=4, vct__shadow_cones=c).passes["Diffuse Direct"] for c in (False, True))
    assert cones.mean() == pytest.approx(maps.mean(), rel=0.05)
    assert "Shadow Maps" not in {p.title for p in vct(scene, "Diffuse Direct", samples=1, vct__shadow_cones=True).plan.run}


def test_a_clear_pane_shows_what_is_behind_it(gl):
    """A pane of index 1 bends nothing: light through it is the wall's own behind it, in its tint."""
    def box(pane):
        b = scenes.SceneBuilder()
        b.quads(np.array([[[-2, 1, -2], [2, 1, -2], [2, 1, 2], [-2, 1, 2]]])[:, ::-1], scenes.diffuse((0.8,) * 3))
        if pane:
            glass = scenes.principled(Transmission_Weight=1.0, Roughness=0.0, IOR=1.0001, Base_Color=(1, 0.5, 0.25))
            b.quads(np.array([[[-2, -1, -2], [2, -1, -2], [2, -1, 2], [-2, -1, 2]]]), glass)
        b.light(scenes.point_light((0.3, 0.0, 0.2), 50.0))
        return b.build(scenes.perspective((0, -3, 0), (0, 0, 0), 0.5))

    bare = vct(box(False), "Combined", samples=4, resolution=(48, 27)).passes["Combined"][..., :3]
    p = vct(box(True), "Transmission Indirect", "Transmission Color", samples=4, resolution=(48, 27)).passes
    red, green, _ = p["Transmission Color"][13, 24]
    assert green / red == pytest.approx(np.sqrt(0.5), rel=0.02)  # one of two surfaces
    assert 0.97 <= p["Transmission Indirect"].mean() / bare.mean() <= 1.03


def test_air_is_lit_and_shadowed_by_voxels(gl):
    """Haze in a Cornell box with blocks: as much light as by the shadow maps, ± 5 %, and less than without shadows."""
    scene = scenes.cornell(light="point")
    haze = {"volume__density": 0.2, "samples": 4, "resolution": (48, 27)}
    voxels = vct(scene, "Volume Direct", **haze)
    maps = make(scene, "Volume Direct", **haze).passes["Volume Direct"].mean()
    open_ = vct(scene, "Volume Direct", use_shadows=False, **haze).passes["Volume Direct"].mean()
    assert voxels.passes["Volume Direct"].mean() == pytest.approx(maps, rel=0.05)
    assert max(maps, voxels.passes["Volume Direct"].mean()) < 0.995 * open_
    assert "Shadow Maps" not in {p.title for p in voxels.plan.run}


OTHER = {
    "vct.resolution": 16, "vct.cones": 2, "vct.emissive_voxels": True, "vct.shadow_cones": True,
    "vct.continuous_voxelization": True,
}  # fmt: skip


@pytest.mark.parametrize("path", [p for p, _, _ in walk() if p.startswith("vct.")])
def test_every_setting_changes_the_picture_or_the_plan(gl, path):
    scene = scenes.cornell()
    scene.materials[1] = scenes.emissive((1.0, 0.6, 0.3), 2.0)
    base = vct(scene, "Combined", samples=2, resolution=(48, 27))
    other = vct(scene, "Combined", samples=2, resolution=(48, 27), **{path.replace(".", "__"): OTHER[path]})
    assert not np.array_equal(base.passes["Combined"], other.passes["Combined"]) or base.plan.text() != other.plan.text()


@pytest.mark.parametrize(
    ("off", "title"),
    [("use_glossy", "Voxel Glossy Reflections"), ("use_ao", "Voxel Ambient Occlusion"),
     ("use_translucency", "Voxel Translucency"), ("use_volumetric", "Voxel Volumetric Light")],
)  # fmt: skip
def test_every_effect_is_on_its_switch(gl, off, title):
    scene = scenes.cornell()
    scene.materials[0] = scenes.principled(Base_Color=scenes.WHITE, Roughness=0.3)
    scene.materials.append(scenes.principled(Transmission_Weight=0.8, Roughness=0.1))
    scene.instances.materials[-1] = (len(scene.materials) - 1,)

    def titles(**changed):
        settings = Settings()
        settings.technique = "VCT"
        settings.set("volume.density", 0.1)
        for name, value in changed.items():
            settings.set(name, value)
        return {p.title for p in inspect(scene, settings, ("Combined", "Ambient Occlusion"), resolution=(64, 36)).run}

    assert title in titles()
    assert title not in titles(**{off: False})


def test_shared_cones_add_no_light_and_lose_none(gl):
    """A lit floor against a wall: E/π on the wall by the floor's form factor. Hits of blocks around weigh by how each point faces
    them; without the cosine at the floor the wall was 9 % too bright."""
    scene = scenes.corner()
    floor = np.array([[-1.0, 0, 0], [1, 0, 0], [1, 1, 0], [-1, 1, 0]])
    exact = wall_reference(scene.camera, (64, 36), floor, 0.8 * 5.0)
    image = vct(scene, "Diffuse Indirect", samples=8, resolution=(64, 36), use_ao=False).passes["Diffuse Indirect"][..., 0]
    assert abs(np.nansum(np.where(np.isnan(exact), np.nan, image)) / np.nansum(exact) - 1.0) <= 0.03


def test_light_is_not_smoothed_through_a_thin_wall(gl):
    """A wall of a tenth of a cell: its far side gets .1 % of the lit one's light; 1 % where blocks on either side of it are
    smoothed over as if one saw the other."""
    suite = Suite("VCT")
    assert leak(suite, 0.1, 0.0, 0.0, suite.cell(scenes.thin_wall(0.1))) <= 0.004
    suite.close()


def test_a_wall_keeps_still_while_the_picture_moves_by_half_a_pixel(gl):
    """Stability test 6: noise against the exact light of each frame's own points, one sub-frame."""
    suite = Suite("VCT")
    finding = run_one(suite, "6")
    suite.close()
    assert finding.verdict == PASS, finding.quantities


@pytest.mark.parametrize("power", [1e-9, 1e9])
def test_light_of_any_power_next_to_a_wall_stays_finite_and_in_proportion(gl, power):
    """Volumes hold half floats; a lamp a fifth of a cell above a floor lights a ceiling in proportion to its power, to 1e-3."""

    def ceiling(watts):
        b = scenes.SceneBuilder()
        b.quads(np.array([[[-2.0, -2, 0], [2, -2, 0], [2, 2, 0], [-2, 2, 0]]]), scenes.diffuse((0.8,) * 3))
        b.quads(np.array([[[-0.5, -0.5, 1.5], [-0.5, 0.5, 1.5], [0.5, 0.5, 1.5], [0.5, -0.5, 1.5]]]), scenes.diffuse((0.5,) * 3))
        b.light(scenes.point_light((0.0, 0.0, 0.2 * 4.0 / 31.0), watts))
        scene = b.build(scenes.perspective((0, 0, 0.9), (0, 0.001, 1.5), 0.9))
        return vct(scene, "Diffuse Indirect", samples=1, resolution=(32, 18), vct__resolution=32).passes["Diffuse Indirect"]

    one, other = ceiling(1.0), ceiling(power)
    assert one.mean() > 1e-4
    np.testing.assert_allclose(other / power, one, rtol=1e-3)


def test_light_through_a_translucent_sheet_leaves_its_far_side(gl):
    """A sheet of transmittance T in the sun lights a floor in its own shade: E/π at a point is T E_sun/π of the sheet's form
    factor there, ± 5 %. The other share goes nowhere: what the sheet sends back lights nothing here."""
    through = Material("Paper", ShaderGraph((Node("BSDF_TRANSLUCENT", "Paper", {"Color": (0.6, 0.3, 0.1)}),), Link(0, "BSDF")))
    sheet = np.array([[-1.0, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]])
    b = scenes.SceneBuilder().quads(sheet[None], through)
    b.quads(np.array([[[-0.5, -0.5, 0.0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]]]), scenes.diffuse((0.5,) * 3))
    b.light(scenes.sun_light((0.0, 0.0, -1.0), 4.0))
    scene = b.build(scenes.orthographic((0, 0, 0.5), (0, 0.001, 0), 0.9, aspect=16 / 9))
    image = vct(scene, "Diffuse Indirect", samples=8, resolution=(32, 18)).passes["Diffuse Indirect"]
    x, y = np.meshgrid((np.arange(32) + 0.5) / 32 - 0.5, ((np.arange(18) + 0.5) / 18 - 0.5) * 9 / 16)
    points = np.stack([0.9 * x, 0.9 * y, 0 * x], -1)
    form = polygon_form_factor(points.reshape(-1, 3), np.broadcast_to([0.0, 0, 1], (x.size, 3)), sheet)
    exact = 4.0 / np.pi * form.mean() * np.array([0.6, 0.3, 0.1])
    np.testing.assert_allclose(image.mean(axis=(0, 1)), exact, rtol=0.05)
