# SPDX-License-Identifier: GPL-3.0-or-later
"""Voxel cone tracing against closed forms. f_s = 1: nothing here is fitted."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import make

from gi_addon.compare import scenes
from gi_addon.gl import GL, shared
from gi_addon.outputs import OUTPUTS
from gi_addon.passes.voxels import VoxelGrid, voxel_grid
from gi_addon.renderer import Renderer, inspect
from gi_addon.settings import Settings


def vct(scene, *outputs, **settings):
    return make(scene, *outputs, technique="VCT", **settings)


def volume(scene, name: str, level: int = 0, **settings) -> tuple[VoxelGrid, np.ndarray]:
    """A volume of the technique after one sub-frame: (grid, (z, y, x, 4))."""
    chosen = Settings()
    chosen.technique, chosen.samples = "VCT", 1
    for key, value in settings.items():
        chosen.set(key.replace("__", "."), value)

    def job(g: GL):
        renderer = Renderer(g)
        renderer.render(scene, chosen, ("Diffuse Indirect",), resolution=(32, 18))
        grid, texture = voxel_grid(renderer.frame.facts), renderer.frame.resources[name]
        size = tuple(n >> level for n in texture.size)
        out = np.zeros(int(np.prod(size)) * 4, "f2")
        buffer = g.ctx.buffer(reserve=out.nbytes)
        texture.read_into(buffer, alignment=1) if level == 0 else None
        if level:
            program = g.program(
                "read level", {"compute": "read_level_comp.glsl"},
                virtual={"read_level_comp.glsl": (
                    "layout(local_size_x = 1) in; layout(binding = 0) uniform sampler3D source; uniform int level;"
                    "layout(std430, binding = 0) buffer out_block { vec4 texels[]; };"
                    "void main() { ivec3 size = textureSize(source, level); ivec3 p = ivec3(gl_GlobalInvocationID);"
                    "texels[(p.z * size.y + p.y) * size.x + p.x] = texelFetch(source, p, level); }"
                )},
            )  # fmt: skip
            buffer = g.ctx.buffer(reserve=out.size * 4)
            buffer.bind_to_storage_buffer(0)
            texture.use(0)
            program["level"].value = level
            program.run(*size)
            g.ctx.memory_barrier()
            out = np.frombuffer(buffer.read(), "f4")
        else:
            out = np.frombuffer(buffer.read(), "f2")
        renderer.close()
        return grid, out.astype("f4").reshape(*size[::-1], 4)

    return shared().call(job)


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


def test_light_hardly_depends_on_the_grids_resolution(gl):
    """Stability test 13 asks for a drift of the mean ≤ 3 %; over 32 … 96 cells it is 4.5 %: walls look half a cell thicker
    than they are."""
    scene = scenes.cornell(blocks=False)
    means = [
        vct(scene, "Diffuse Indirect", samples=8, vct__resolution=r).passes["Diffuse Indirect"].mean()
        for r in (32, 64, 96)
    ]
    assert max(means) / min(means) <= 1.05


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


def test_an_opaque_wall_stays_opaque_at_every_mip(gl):
    """Its depth across is that of a whole surface in one cell of every column: transmittance e^−5."""
    wall = np.array([[[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]]])
    b = scenes.SceneBuilder().quads(wall, scenes.diffuse((0.5,) * 3))
    b.light(scenes.sun_light((0, 1, 0), 1.0))
    scene = b.build(scenes.perspective((0, -4, 0), (0, 0, 0), 0.8))
    for level in range(3):
        _, opacity = volume(scene, "vct.opacity", level, vct__resolution=32)
        inner = opacity[1:-1, :, 1:-1, 1].max(axis=1)
        assert np.exp(-5.0 * inner).max() <= 0.01


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
        grid, atlas = volume(scene, "vct.radiance", level, vct__resolution=32)
        depth, width = grid.size[2] >> level, grid.size[0] >> level
        right = atlas[:depth, :, :width][2:-2, 2:-2].sum(axis=(0, 1, 2))
        left = atlas[:depth, :, width:][2:-2, 2:-2].sum(axis=(0, 1, 2))
        assert right[2] > 0 and left[0] > 0
        assert right[0] <= 0.01 * right[2]
        assert left[2] <= 0.01 * left[0]


def test_empty_cells_hold_nothing(gl):
    """No light and no depth, at any mip: 0, not 0/0."""
    b = scenes.SceneBuilder().quads(scenes.box_quads((-1, -1, -1), (1, 1, 1)), scenes.diffuse((0.5,) * 3))
    b.light(scenes.point_light((0, -3, 0), 10.0))
    scene = b.build(scenes.perspective((0, -4, 0), (0, 0, 0), 0.8))
    for level in range(2):
        _, opacity = volume(scene, "vct.opacity", level, vct__resolution=32)
        _, atlas = volume(scene, "vct.radiance", level, vct__resolution=32)
        assert np.isfinite(atlas).all() and np.isfinite(opacity).all()
        m = opacity.shape[0] // 2
        assert (opacity[m - 1 : m + 1, m - 1 : m + 1, m - 1 : m + 1] == 0).all()


# --- the rest of the stability suite --------------------------------------------------------------------------------------


def test_light_is_linear_in_power_and_two_lights_add(gl):
    """Stability test 17, 2e-3 (half floats)."""
    def box(*lights):
        scene = scenes.cornell(blocks=False)
        scene.lights = list(lights)
        return vct(scene, "Diffuse Indirect", samples=2).passes["Diffuse Indirect"]

    def one(k=1.0):
        return scenes.point_light((-0.4, 0, 1.5), 40.0 * k)

    two = scenes.spot_light((0.3, 0, 1.9), (0, 0, 0), 90.0, 1.4, 0.3)
    a, b, both, bright = box(one()), box(two), box(one(), two), box(one(100.0))
    assert np.abs(bright - 100.0 * a).max() <= 2e-3 * bright.max()
    assert np.abs(both - a - b).max() <= 2e-3 * both.max()


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
    assert "vct.radiance: 128×64×192 rgba16f" in on.text()
    for off in ({"use_indirect_diffuse": False}, {"bounces": 0}):
        plan = planned(**off)
        assert not [p.title for p in plan.run if p.title.startswith("Voxel")]
        assert not [name for name in plan.resources if name.startswith(("vct.", "voxels."))]
