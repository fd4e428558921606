# SPDX-License-Identifier: GPL-3.0-or-later
"""LPV against closed forms: injection, propagation, look-up, bounces. f_s = 1: nothing here is fitted."""

from __future__ import annotations

from itertools import permutations, product

import numpy as np
import pytest
from conftest import make
from gpu import evaluate

from gi_addon.compare import scenes
from gi_addon.compare.closed_forms import camera_rays, polygon_form_factor
from gi_addon.engines import lpv
from gi_addon.engines.lpv import Grid, fixed_point_groups, grid, ordinates
from gi_addon.gl import shared
from gi_addon.gpu_types import LIGHT, LIGHT_POINT, LIGHT_SUN
from gi_addon.renderer import Renderer, inspect
from gi_addon.settings import Settings

SMALL = (48, 27)


def indirect(scene, **settings):
    options = {"technique": "LPV", "samples": 1, "resolution": SMALL, "lpv__resolution": 16} | settings
    return make(scene, "Diffuse Indirect", **options).passes["Diffuse Indirect"]


def volumes(scene, inject=None, **settings):
    """(grid, lpv.source, lpv.volume, lpv.walls) after one sub-frame; volumes (9, z, y, x, 3), walls (z, y, x, 3, 4).
    ``inject`` (9, z, y, x, 3) takes the place of the sources."""
    chosen = Settings()
    for name, value in ({"technique": "LPV", "lpv__resolution": 16} | settings).items():
        chosen.set(name.replace("__", "."), value)

    def job(g):
        renderer = Renderer(g)
        renderer.render(scene, chosen, ("Diffuse Indirect",), resolution=(16, 9), subframes=1)
        frame = renderer.frame
        cells = grid(frame.facts)
        nx, ny, nz = cells.size
        if inject is not None:
            data = np.zeros((9, nz, ny, nx, 4), "f4")
            data[..., :3] = inject(cells)
            frame.resources["lpv.source"].write(data.tobytes())
            planned = next(p for p in renderer._plan.run if p.title == "LPV Propagation")
            planned.task.run(frame, planned)

        def texture(name):
            return np.frombuffer(frame.resources[name].read(), "f4").reshape(9, nz, ny, nx, 4)[..., :3].astype("f8")

        walls = frame.resources.get("lpv.walls")
        out = (
            cells, texture("lpv.source"), texture("lpv.volume"),
            None if walls is None else np.frombuffer(walls.read(), "f4").reshape(nz, ny, nx, 3, 4),
        )  # fmt: skip
        renderer.close()
        return out

    return shared().call(job)


def harmonics(w):
    """Real spherical harmonics (…, 9) of unit vectors (…, 3), in the shaders' order."""
    x, y, z = np.moveaxis(np.asarray(w, "f8"), -1, 0)
    return np.stack([
        0.28209479177 + 0 * x, 0.48860251190 * y, 0.48860251190 * z, 0.48860251190 * x, 1.09254843059 * x * y,
        1.09254843059 * y * z, 0.31539156525 * (3 * z * z - 1), 1.09254843059 * x * z, 0.54627421529 * (x * x - y * y),
    ], -1)  # fmt: skip


def flux_of(source, cell):
    """All flux of a source volume, W: ∫ Σ c Y dω = c₀ √(4π), and Q is over h²."""
    return source[0].sum(axis=(0, 1, 2)) * np.sqrt(4.0 * np.pi) * cell**2


# --- the pieces -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [48, 72, 144, 288])
def test_ordinates_integrate_the_sphere_and_are_symmetric(count):
    """Exact to degree 7: moments of x⁴, x²y², x⁶ and x²y²z² are 1/5, 1/15, 1/7 and 1/105 of the sphere."""
    table = ordinates(count).astype("f8")
    w, share = table[:, :3], table[:, 3] / (4.0 * np.pi)
    x, y, z = w.T
    assert len(table) == count and share.sum() == pytest.approx(1.0, abs=1e-6)
    for value, expected in ((x**4, 1 / 5), (x * x * y * y, 1 / 15), (x**6, 1 / 7), (x * x * y * y * z * z, 1 / 105)):
        assert (share * value).sum() == pytest.approx(expected, abs=1e-6)
    assert np.abs(w).min() > np.sin(np.radians(7.0 if count <= 72 else 5.6))  # finer sets need not keep so far off
    known = {tuple(np.round(v, 5)) for v in w}
    for order in permutations(range(3)):
        for signs in product((-1, 1), repeat=3):
            assert {tuple(np.round(v[list(order)] * signs, 5)) for v in w} == known


def test_the_grid_covers_the_scene_with_a_cell_to_spare():
    bounds = np.array([[-3.0, 0.0, 1.0], [5.0, 2.0, 1.5]])
    g = Grid.over(bounds, 18)
    assert g.cell == pytest.approx(0.5) and g.size == (18, 6, 3)
    low = np.array(g.origin)
    high = low + g.cell * np.array(g.size)
    assert (bounds[0] - low >= g.cell - 1e-9).all() and (high - bounds[1] >= g.cell - 1e-9).all()
    flat = Grid.over(np.array([[1.0, 1.0, 1.0], [1.0, 1.0, 1.0]]), 16)
    assert np.isfinite(flat.origin).all() and flat.cell > 0


def test_weak_lights_are_summed_in_units_of_their_own():
    lights = np.zeros(3, LIGHT)
    lights["kind"] = LIGHT_POINT, LIGHT_SUN, LIGHT_POINT
    lights["emission"] = [[100.0] * 3, [1e-3] * 3, [90.0] * 3]
    groups = fixed_point_groups(lights, 0.1)
    assert [g for _, g in groups] == [{0, 2}, {1}]
    assert groups[0][0] * 4.0 * np.pi * 190.0 < 2**30 and groups[1][0] > groups[0][0]


def test_injected_flux_is_what_the_surfaces_reflect(gl):
    """ρΦ, to 1e-3, whatever the resolution of map or grid; its first moment is 2/3 of the flux, inwards."""
    scene = scenes.integrating_sphere(albedo=0.5, power=100.0, light=(0.3, 0.0, 0.2))
    for settings in ({}, {"lpv__resolution": 24}, {"rsm__resolution": 128}):
        g, source, _, _ = volumes(scene, **settings)
        np.testing.assert_allclose(flux_of(source, g.cell), 50.0, rtol=1e-3)
    z, y, x = np.indices(source.shape[1:4])
    radial = np.stack([x, y, z], -1) + 0.5 - np.array(g.size) / 2.0
    radial /= np.linalg.norm(radial, axis=-1, keepdims=True)
    # ∫ w Q dω = √(4π/3) (c₃, c₁, c₂).
    first = np.sqrt(4.0 * np.pi / 3.0) * np.stack([source[k, ..., 0] for k in (3, 1, 2)], -1)
    inwards = -(first * radial).sum() * g.cell**2
    assert inwards == pytest.approx(50.0 * 2 / 3, rel=0.02)


def far_scene():
    """Two specks at the corners of a box: bounds to lay a grid over, and nothing in the way."""
    b = scenes.SceneBuilder("specks")
    for corner in (-1.0, 1.0):
        b.quads(scenes.box_quads((corner - 1e-4,) * 3, (corner + 1e-4,) * 3), scenes.diffuse((0.5,) * 3))
    b.light(scenes.point_light((0.5, 0.2, 0.1), 1.0))
    return b.build(scenes.perspective((0, -4, 0), (0, 0, 0), 0.8))


def emitter(direction=None):
    """A source of 1 W in the middle cell: in all directions alike, or a cosine lobe."""
    def inject(g):
        out = np.zeros((9, g.size[2], g.size[1], g.size[0], 3))
        c = [s // 2 for s in g.size]
        values = np.zeros(9)
        if direction is None:
            values[0] = 1.0 / np.sqrt(4.0 * np.pi)
        else:
            values = harmonics(np.array(direction) / np.linalg.norm(direction)) * np.array([1] + [2 / 3] * 3 + [1 / 4] * 5)
        out[:, c[2], c[1], c[0]] = (values / g.cell**2)[:, None]
        return out

    return inject


@pytest.mark.parametrize("direction", [None, (0, 0, 1), (0.3, -0.5, 0.8)])
def test_free_propagation_conserves_flux(gl, direction):
    """What leaves the grid is what was sent in: 1 W. Light of ω_a < 0 is never above the source's layer of axis a, so on the
    grid's upper side of a all light goes out, and ∫ L ω_a dω, a harmonic of order 1, is what crosses it per h²; and so below."""
    g, source, volume, _ = volumes(far_scene(), inject=emitter(direction), lpv__occlusion=False)
    assert flux_of(source, g.cell)[0] == pytest.approx(1.0, rel=1e-4)
    leaving = 0.0
    for axis, k in ((0, 3), (1, 1), (2, 2)):
        layers = np.moveaxis(np.sqrt(4.0 * np.pi / 3.0) * volume[k, ..., 0] * g.cell**2, 2 - axis, 0)
        leaving += layers[-1].sum() - layers[0].sum()
    assert leaving == pytest.approx(1.0, rel=1e-3)


def test_a_lobe_propagates_alike_in_all_48_orientations(gl):
    """Stability test 4b: ≤ 1e-3. Flips and permutations of the axes, of a lobe that none of them leaves unchanged."""
    # A cubic grid: the lobe's own cell is its middle only for odd sizes.
    base = np.array([0.2, 0.5, 0.84])
    reference = None
    for order, signs in (((0, 1, 2), (1, 1, 1)), ((1, 0, 2), (1, 1, 1)), ((2, 1, 0), (-1, 1, 1)), ((1, 2, 0), (1, -1, -1))):
        direction = base[list(order)] * signs
        _, _, volume, _ = volumes(far_scene(), inject=emitter(direction), lpv__occlusion=False, lpv__resolution=17)
        scalar = volume[0, ..., 0].transpose(2, 1, 0)  # x, y, z
        for axis in range(3):
            if signs[axis] < 0:
                scalar = np.flip(scalar, axis)
        scalar = scalar.transpose(np.argsort(order))
        reference = scalar if reference is None else reference
        assert np.abs(scalar - reference).max() <= 1e-3 * reference.max()


def test_a_point_emitter_shines_alike_in_all_directions(gl):
    """Fluence at distance r is Φ/(4πr²), in the mean over directions to 10 %. Between directions it varies by the
    ordinates' own rays, which show most around a source of one cell: measured .42 with 72 of them; along the grid's axes and
    its diagonals alike to that."""
    g, _, volume, _ = volumes(far_scene(), inject=emitter(), lpv__occlusion=False, lpv__resolution=17)
    c = [s // 2 for s in g.size]
    z, y, x = np.indices(volume.shape[1:4])
    offset = (np.stack([x, y, z], -1) - np.array(c)) * g.cell
    r = np.linalg.norm(offset, axis=-1)
    shell = (r > 3.2 * g.cell) & (r < 5.0 * g.cell)
    fluence = volume[0, ..., 0] * np.sqrt(4.0 * np.pi)
    ratio = fluence[shell] * 4.0 * np.pi * r[shell] ** 2
    assert ratio.mean() == pytest.approx(1.0, abs=0.1)
    assert ratio.std() < 0.45


def test_cosine_lobes_of_the_paper_do_not_cross_a_room():
    """Why propagate_comp.glsl leaves the paper's lobes: Kaplanyan and Dachsbacher's propagation with exact constants (.4007,
    .4234; .8862, 1.0233; rotated sides) in a room of n³ cells whose floor emits B. The ceiling gets .2 B by form factors;
    with lobes it gets .01 B of 8 cells and less than .001 B of 16."""
    axes = [np.array(v, "f8") for v in ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))]

    def ceiling(n):
        lobe = lambda v: np.array([0.88622693, *(1.02332671 * v)]) / np.pi  # noqa: E731
        cells = np.zeros((n, n, n, 4))
        cells[:, :, 0] = lobe(axes[4])
        total = cells.copy()
        for _ in range(3 * n):
            fresh = np.zeros_like(cells)
            for d in axes:
                axis, step = int(np.abs(d).argmax()), int(d.sum())
                moved = np.roll(cells, step, axis)
                moved[(slice(None),) * axis + (0 if step > 0 else -1,)] = 0.0
                for f in axes:
                    if (f == -d).all():
                        continue
                    front = (f == d).all()
                    w = d if front else d * 0.89442719 + f * 0.4472136
                    flux = moved @ np.array([0.28209479, *(0.48860251 * w)]) * (0.40066968 if front else 0.42343135)
                    fresh += flux[..., None] * lobe(f)
            cells = fresh
            total += cells
        top = total[:, :, -1]
        return ((np.pi * 0.28209479 * top[..., 0] + 2 * np.pi / 3 * 0.48860251 * top[..., 3]) / 1.5).mean()

    assert 0.002 < ceiling(8) < 0.02


# --- rooms ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("lamp", "resolution", "limit"),
    [((0, 0, 0), 16, 0.08), ((0, 0, 0), 24, 0.05), ((0.5, 0.0, 0.2), 24, 0.05), ((0, 0, 0), 32, 0.05), ((0, 0.8, 0), 32, 0.05)],
)
def test_sphere_one_bounce_matches_closed_form(gl, lamp, resolution, limit):
    """Stability test 1: E₁ = ρΦ/(4πR²) everywhere, |g − 1| ≤ .05, CV ≤ .15; the last lamp is .2 R from the wall. Light starts
    half a cell in front of a wall in the mean, which is a sphere of R − ½: in 16 cells, R = 7 of them, that counts."""
    image = indirect(scenes.integrating_sphere(albedo=0.5, power=100.0, light=lamp), lpv__resolution=resolution)[..., 0] * np.pi
    g = image / (0.5 * 100.0 / (4.0 * np.pi))
    assert abs(g.mean() - 1.0) <= limit
    assert g.std() / g.mean() <= 0.15


@pytest.mark.parametrize("bounces", [2, 4])
def test_sphere_bounces_add_up(gl, bounces):
    """Stability test 2: after D bounces E = E₀ (ρ + … + ρ^D), relative to one bounce to ± .025 of the limit."""
    scene = scenes.integrating_sphere(albedo=0.5, power=100.0)
    one, more = indirect(scene).mean(), indirect(scene, bounces=bounces).mean()
    assert 0.5 * more / one == pytest.approx(1.0 - 0.5**bounces, abs=0.025)


def test_no_bounce_brings_back_more_than_the_albedo(gl):
    """Stability test 4: Φ_{n+1}/Φ_n ≤ ρ, in a box at an angle to the grid."""
    b = scenes.SceneBuilder("box")
    a = np.radians(30.0)
    turn = np.eye(4)
    turn[:2, :2] = [[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]
    b.add(scenes.mesh_from_quads(scenes.box_quads((-1, -1, 0), (1, 1, 2), inward=True)), scenes.diffuse((0.8,) * 3), turn)
    b.light(scenes.point_light((0.2, 0.1, 1.2), 50.0))
    scene = b.build(scenes.perspective((0, -0.8, 1), (0, 1, 1), 1.6, clip=(0.01, 10)))
    means = [indirect(scene, bounces=n).mean() for n in (1, 2, 3, 4)]
    steps = np.diff(means)
    assert (steps[1:] <= 0.82 * steps[:-1]).all() and steps[-1] > 0


def test_energy_does_not_depend_on_map_or_grid(gl):
    """Stability test 13: ≤ 3 % over maps, and over grids from 16 to 32."""
    scene = scenes.cornell(blocks=False)
    maps = [indirect(scene, rsm__resolution=r).mean() for r in (128, 512)]
    assert max(maps) / min(maps) < 1.03
    grids = [indirect(scene, lpv__resolution=r).mean() for r in (16, 24, 32)]
    assert max(grids) / min(grids) < 1.03


def test_walls_that_fill_whole_tiles_of_the_raster_are_closed(gl):
    """Two walls of a box one behind the other, each of two large triangles: every face of both is blocked, in any grid."""
    b = scenes.SceneBuilder("box")
    b.quads(scenes.box_quads((-1, -1, 0), (1, 1, 2), inward=True), scenes.diffuse((0.5,) * 3))
    b.light(scenes.point_light((0, 0, 1.5), 10.0))
    scene = b.build(scenes.perspective((0, -0.8, 1), (0, 1, 1), 1.2))
    for resolution in (32, 64):
        walls = volumes(scene, lpv__resolution=resolution, lpv__directions="48")[3]
        for axis in range(3):
            layers = np.moveaxis(walls[..., axis, 0], 2 - axis, 0)
            for layer in (1, resolution - 1):
                np.testing.assert_array_equal(layers[layer][1:-1, 1:-1], 1.0)


def test_light_stays_on_its_side_of_a_thin_wall(gl):
    """Stability test 5, wall and room at an angle to the grid: ≤ 1 % however thin the wall; without occlusion it leaks."""
    b = scenes.SceneBuilder("wall")
    a = np.radians(20.0)
    turn = np.eye(4)
    turn[:2, :2] = [[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]
    white = scenes.diffuse((0.7,) * 3)
    b.add(scenes.mesh_from_quads(scenes.box_quads((-2, -1, 0), (2, 1, 2), inward=True)), white, turn)
    b.add(scenes.mesh_from_quads(scenes.box_quads((-0.005, -1, 0), (0.005, 1, 2))), white, turn)
    b.light(scenes.point_light(turn[:3, :3] @ (-1.2, 0.1, 1.3), 50.0))
    images = []
    for side in (-1, 1):
        eye = turn[:3, :3] @ (0.3 * side, 0.0, 1.0)
        target = turn[:3, :3] @ (2.0 * side, 0.0, 1.0)
        images.append(b.build(scenes.perspective(eye, target, 1.5, clip=(0.01, 10))))
        lit_or_dark = indirect(images[-1], lpv__resolution=24).mean()
        images[-1] = (images[-1], lit_or_dark)
    assert images[1][1] <= 0.01 * images[0][1]
    assert indirect(images[1][0], lpv__resolution=24, lpv__occlusion=False).mean() > 0.05 * images[0][1]


def test_scale_does_not_matter(gl):
    """Stability test 12: a scene k times as large under k² the power looks the same."""
    reference = indirect(scenes.integrating_sphere(radius=1.0, power=100.0, segments=32))
    for k in (1e-3, 1e3):
        image = indirect(scenes.integrating_sphere(radius=k, power=100.0 * k * k, segments=32))
        assert np.mean((image - reference) ** 2 / reference.mean() ** 2) <= 1e-4


def test_power_is_linear_and_renders_are_bit_identical(gl):
    """Stability tests 16 and 17."""
    once, again = indirect(scenes.cornell()), indirect(scenes.cornell())
    np.testing.assert_array_equal(once, again)
    strong = indirect(scenes.cornell(power=600.0))
    assert np.abs(strong - 10.0 * once).max() <= 1e-3 * strong.mean()
    both = scenes.cornell()
    both.lights.append(scenes.point_light((0.3, -0.2, 1.2), 20.0))
    other = scenes.cornell()
    other.lights = both.lights[1:]
    difference = np.abs(indirect(both) - once - indirect(other))
    assert difference.mean() <= 1e-3 * indirect(both).mean() and difference.max() <= 1e-3 * indirect(both).max()


def test_lights_that_move_are_averaged_and_propagated_at_doublings(gl):
    """An area light's bounce is another in each sub-frame; the volume after 8 holds their mean, in 4 propagations."""
    scene, chosen = scenes.cornell(light="area"), Settings()
    for name, value in (("technique", "LPV"), ("lpv.resolution", 16), ("samples", 8)):
        chosen.set(name, value)

    def job(g):
        renderer = Renderer(g)
        renderer.begin(scene, chosen, ("Diffuse Indirect",), resolution=(16, 9))
        propagation = next(p for p in renderer._plan.run if p.title == "LPV Propagation").task
        carry, runs = propagation._carry, []
        propagation._carry = lambda *a, **k: (runs.append(renderer.frame.subframe), carry(*a, **k))
        fluxes, counts = [], []
        for index in range(8):
            renderer.subframe(index)
            n = propagation.injection.count
            data = np.frombuffer(renderer.frame.resources["lpv.source"].read(), "f4").reshape(9, -1, 4)
            fluxes.append(data[0, :, :3].astype("f8").sum() / n)
            counts.append(n)
        renderer.close()
        return runs, fluxes, counts

    runs, fluxes, counts = shared().call(job)
    assert runs == [0, 1, 3, 7] and counts == list(range(1, 9))
    assert max(fluxes) / min(fluxes) < 1.1


def test_the_camera_does_not_move_the_light(gl):
    """Stability test 8: the grid belongs to the scene. The volume is the same from anywhere."""
    scene = scenes.cornell()
    _, _, first, _ = volumes(scene)
    scene.camera = scenes.perspective((0.113, -3.9, 1.07), (0, 0, 1), 0.9)
    _, _, second, _ = volumes(scene)
    np.testing.assert_array_equal(first, second)


def test_nothing_is_not_a_number(gl):
    """Stability test 18: degenerate triangles, a zero scale, an empty scene."""
    b = scenes.SceneBuilder("odd")
    b.quads(np.array([[[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]], [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]], "f8"),
            scenes.principled(Base_Color=(0.8, 0.8, 0.8), Roughness=0.2))  # fmt: skip
    b.add(scenes.sphere(0.3, 8, 4), scenes.diffuse((0.5,) * 3), np.diag([0.0, 0.0, 0.0, 1.0]))
    b.light(scenes.point_light((0, 0, 1), 100.0))
    for camera in (scenes.perspective((0, -3, 1), (0, 0, 0), 0.8), scenes.perspective((0, 3, 1), (0, 9, 1), 0.8)):
        passes = make(b.build(camera), "Combined", "Diffuse Indirect", "Glossy Indirect", "Ambient Occlusion", samples=2,
                      technique="LPV", lpv__resolution=16, bounces=2, resolution=SMALL).passes  # fmt: skip
        assert all(np.isfinite(image).all() for image in passes.values())


# --- effects ----------------------------------------------------------------------------------------------------------


def test_a_mirror_shows_the_lit_wall(gl):
    """A smooth metal floor under an evenly lit ceiling reflects the ceiling's radiance: E ρ/π, to 10 %."""
    b = scenes.SceneBuilder("mirror")
    b.quads(np.array([[[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]], "f8"),
            scenes.principled(Base_Color=(1, 1, 1), Metallic=1.0, Roughness=0.05))  # fmt: skip
    b.quads(np.array([[[-4, 4, 2], [4, 4, 2], [4, -4, 2], [-4, -4, 2]]], "f8"), scenes.diffuse((0.6,) * 3))
    b.light(scenes.sun_light((0.0, 0.0, 1.0), 3.0))
    scene = b.build(scenes.perspective((0.0, -1.0, 1.2), (0, 0, 0), 0.3))
    passes = make(scene, "Glossy Indirect", "Glossy Color", "Depth", technique="LPV", samples=8, resolution=SMALL,
                  lpv__resolution=24).passes  # fmt: skip
    seen = passes["Depth"][..., 0] < 1e9
    # The floor takes part of the sun away from the ceiling: its shadow is seen in the middle. Lit is the rest.
    light = passes["Glossy Indirect"][seen]
    assert np.isfinite(light).all() and light.max() > 0.0
    assert np.percentile(light, 95) == pytest.approx(0.6 * 3.0 / np.pi, rel=0.15)


def test_a_pane_shows_the_lit_wall_behind_it(gl):
    """Through a refracting sheet the wall's radiance E ρ/π arrives, whatever the tint, which the pass is divided by: to 10 %."""
    b = scenes.SceneBuilder("pane")
    b.quads(np.array([[[-2, 1, -2], [2, 1, -2], [2, 1, 2], [-2, 1, 2]]], "f8"), scenes.diffuse((0.6,) * 3))
    b.quads(np.array([[[-2, 0, -2], [2, 0, -2], [2, 0, 2], [-2, 0, 2]]], "f8"),
            scenes.principled(Base_Color=(0.5, 0.8, 0.9), Transmission_Weight=1.0, Roughness=0.0, IOR=1.45))  # fmt: skip
    b.light(scenes.sun_light((0.0, 1.0, -4.0), 3.0))  # over the pane's edge
    scene = b.build(scenes.perspective((0, -2, 0), (0, 1, 0), 0.3))
    passes = make(scene, "Transmission Indirect", "Transmission Color", technique="LPV", samples=16, resolution=SMALL,
                  lpv__resolution=24).passes  # fmt: skip
    seen = passes["Transmission Color"][..., 0] > 0.1
    assert seen.mean() > 0.5
    assert passes["Transmission Indirect"][seen].mean() == pytest.approx(0.6 * 3.0 / np.sqrt(17.0) / np.pi, rel=0.03)


def test_a_mirror_shows_the_unlit_wall_by_its_bounces(gl):
    """The corner's wall, which no lamp lights: seen in a mirror it sends albedo × E/π of the lit floor's form factor, to 10 %.
    The mirror hangs in the sun's direction, and the wall itself is not in the picture."""
    scene = scenes.corner()
    b = scenes.SceneBuilder("mirrored-corner")
    for mesh, used in zip((scene.meshes[i] for i in scene.instances.mesh), scene.instances.materials, strict=True):
        b.add(mesh, scene.materials[used[0]])
    b.quads(np.array([[[-0.4, 0.9, 0.1], [0.4, 0.9, 0.1], [0.4, 0.9, 0.9], [-0.4, 0.9, 0.9]]]),
            scenes.principled(Base_Color=(1, 1, 1, 1), Metallic=1.0, Roughness=0.02))  # fmt: skip
    b.light(scene.lights[0])
    camera = scenes.perspective((0.0, 0.3, 0.5), (0.0, 0.9, 0.5), 0.6)
    image = make(b.build(camera), "Glossy Indirect", technique="LPV", samples=4, resolution=SMALL).passes["Glossy Indirect"]
    origin, direction = camera_rays(camera, SMALL)
    points = origin + direction * ((0.9 + 0.9 - origin[..., 1]) / direction[..., 1])[..., None]  # the wall's image is at y = 1.8
    points = (points * [1, 0, 1]).reshape(-1, 3)
    floor = np.array([[-1.0, 0, 0], [1, 0, 0], [1, 1, 0], [-1, 1, 0]])
    exact = 0.8 * 0.8 * 5.0 * polygon_form_factor(points, np.broadcast_to([0.0, 1.0, 0.0], points.shape), floor) / np.pi
    assert image[..., 0].mean() == pytest.approx(exact.mean(), rel=0.1)


def test_lights_in_a_corner_stay_on_their_side(gl):
    """A floor ends at a wall that is at an angle to the grid: of its flux nothing starts in cells behind the wall."""
    for degrees in (15.0, 30.0):
        a = np.radians(degrees)
        turn = np.eye(4)
        turn[:2, :2] = [[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]
        g, source, _, _ = volumes(scenes.transformed(scenes.corner(), turn), lpv__resolution=32)
        z, y, x = np.indices(source.shape[1:4])
        local = ((np.stack([x, y, z], -1) + 0.5) * g.cell + np.array(g.origin)) @ turn[:3, :3]
        flux = source[0, ..., 0]
        assert flux[local[..., 1] < 0.0].sum() <= 0.004 * flux.sum()


@pytest.mark.parametrize(("resolution", "count"), [(16, 72), (32, 72), (48, 144), (64, 144), (100, 288)])
def test_finer_grids_get_more_directions(resolution, count):
    settings = Settings()
    settings.set("technique", "LPV")
    settings.set("lpv.resolution", resolution)
    facts = inspect(scenes.cornell(), settings, ("Diffuse Indirect",), resolution=SMALL).facts
    assert lpv.ordinate_count(facts) == count


def test_ambient_occlusion_is_the_open_share(gl):
    """In a box without a lid the floor's middle sees the opening: cos-weighted share of a square overhead, to .05."""
    b = scenes.SceneBuilder("pit")
    b.quads(scenes.box_quads((-1, -1, 0), (1, 1, 1), inward=True)[[0, 1, 2, 3, 4]], scenes.diffuse((0.5,) * 3))
    b.light(scenes.sun_light((0.1, 0.0, -1.0), 1.0))
    scene = b.build(scenes.perspective((0, 0, 0.9), (0, 0.001, 0), 0.2))
    image = make(scene, "Ambient Occlusion", technique="LPV", samples=16, resolution=SMALL, lpv__resolution=32,
                 ao__samples=16, ao__distance=10.0).passes["Ambient Occlusion"][..., 0]  # fmt: skip
    q = 1.0 / np.sqrt(2.0)
    expected = 4.0 / (2.0 * np.pi) * 2.0 * q * np.arctan(q)
    assert image.mean() == pytest.approx(expected, abs=0.05)


def test_air_dims_what_goes_through_it(gl):
    """Beer's law in the grid: the facing wall, distance d away, gets e^(−σd) of the flux, and a lamp's first leg as much."""
    scene = scenes.integrating_sphere(albedo=0.5, power=100.0, segments=48)
    sigma = 0.4
    scene.world = fog(sigma)
    clear = indirect(scenes.integrating_sphere(albedo=0.5, power=100.0, segments=48)).mean()
    # One radius from the lamp to the wall, then chords: the mean of e^(−σs) over cosine-weighted chords s = 2R cosθ.
    u = 2.0 * sigma
    chord = 2.0 * (1.0 - (1.0 + u) * np.exp(-u)) / u**2
    image = indirect(scene)
    # The picture itself is seen through the air.
    depth = make(scene, "Depth", technique="LPV", samples=1, resolution=SMALL).passes["Depth"]
    assert np.isfinite(depth).all()
    assert image.mean() < clear * np.exp(-sigma) * chord * 1.1


def fog(density):
    from test_volumetric import fog as make_fog

    return make_fog(density, color=(0.0, 0.0, 0.0), kind="VOLUME_ABSORPTION")


def air_of(lit, density):
    """(Volume Indirect, exact) in a sphere of albedo ``lit`` full of fog that scatters isotropically, a lamp in its middle."""
    from test_volumetric import fog as make_fog

    scene, size = scenes.integrating_sphere(albedo=lit, power=100.0), (32, 18)
    scene.world = make_fog(density)
    image = make(scene, "Volume Indirect", technique="LPV", samples=4, resolution=size).passes["Volume Indirect"][..., 0]
    mu, mu_weight = np.polynomial.legendre.leggauss(96)
    u, u_weight = (v / 2 for v in np.polynomial.legendre.leggauss(64))
    # Mean radiance at distance r from the middle: the walls' B e^(−σd), and what the air on the way scatters of the lamp's
    # light, by points equiangular about the lamp.
    wall = lit * 100.0 / (4 * np.pi) / np.pi * np.exp(-density)
    r = np.linspace(1e-3, 0.999, 60)[:, None]
    far = -r * mu + np.sqrt(1.0 - (r * (1.0 - mu) * r * (1.0 + mu)))
    near = r * np.sqrt(1.0 - mu**2)
    low, high = np.arctan(r * mu / near), np.arctan((far + r * mu) / near)
    angle = low[..., None] + (u + 0.5) * (high - low)[..., None]
    s = near[..., None] * np.tan(angle) - (r * mu)[..., None]
    ds = near[..., None] / np.cos(angle) ** 2 * u_weight * (high - low)[..., None]
    lamp = near[..., None] / np.cos(angle)
    scattered = density * 100.0 * np.exp(-density * (lamp + s)) / (4 * np.pi * lamp) ** 2 * ds
    mean = ((wall * np.exp(-density * far) + scattered.sum(-1)) * mu_weight / 2).sum(-1)
    origin, ray = camera_rays(scene.camera, size)
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    b = (origin * ray).sum(-1)
    end = -b + np.sqrt(b * b - (origin**2).sum(-1) + 1.0)
    t = end[..., None] * (u + 0.5)
    at = np.linalg.norm(origin[..., None, :] + t[..., None] * ray[..., None, :], axis=-1)
    return image, (density * np.exp(-density * t) * np.interp(at, r[:, 0], mean) * u_weight * end[..., None]).sum(-1)


@pytest.mark.parametrize(("lit", "density"), [(0.5, 0.01), (0.0, 0.5)])
def test_the_air_scatters_the_light_of_walls_and_of_the_air_to_the_eye(gl, lit, density):
    """Volume Indirect against a double integral: nearly all from lit walls, then all from lit air, between black walls."""
    image, exact = air_of(lit, density)
    assert image.mean() == pytest.approx(exact.mean(), rel=0.06)
    assert np.mean((image - exact) ** 2 / (exact**2 + (0.1 * exact.mean()) ** 2)) < 0.004


def test_forward_scattering_air_shows_more_light_against_it(gl):
    """Air before a lit wall that scatters forward is brighter seen against the wall's light than one that scatters evenly, by
    Σ g^l (2l + 1) P_l(cosθ), and one that scatters backward darker."""
    from test_volumetric import fog as make_fog

    means = []
    for g in (0.0, 0.6, -0.6):
        b = scenes.SceneBuilder()
        b.quads(np.array([[[-1, 1, -1], [1, 1, -1], [1, 1, 1], [-1, 1, 1]]], "f8"), scenes.diffuse((0.8,) * 3))
        b.light(scenes.spot_light((0, 0.9, 0), (0, 1, 0), 100.0, size=1.2, blend=0.0))
        scene = b.build(scenes.perspective((0, -0.5, 0), (0, 1, 0), 0.2, clip=(0.01, 9.0)), make_fog(0.05, anisotropy=g))
        image = make(scene, "Volume Indirect", technique="LPV", samples=1, resolution=(16, 9)).passes["Volume Indirect"]
        means.append(float(image.mean()))
    # cosθ = .72, half way from the edge of the wall seen from d = 1/2 to its middle: 1 ± 3 · .6 cosθ + 5 · .36 P₂ is 2.8 and .2.
    assert means[1] > 1.7 * means[0] > 0.0
    assert 0.0 < means[2] < 0.5 * means[0]


@pytest.mark.parametrize(("change", "runs"), [({}, True), ({"use_volumetric": False}, False), ({"bounces": 0}, False)])
def test_in_scattering_costs_nothing_where_there_is_none(change, runs):
    from test_volumetric import fog as make_fog

    chosen = Settings()
    for name, value in ({"technique": "LPV"} | change).items():
        chosen.set(name, value)
    clear, foggy, smoky = (scenes.cornell() for _ in range(3))
    foggy.world, smoky.world = make_fog(0.2), fog(0.2)
    made = {"LPV In-scattering", "LPV Air Volume"}
    titles = [{p.title for p in inspect(s, chosen, ("Combined",), resolution=SMALL).run} & made for s in (foggy, smoky, clear)]
    assert titles[0] == (made if runs else set())
    assert titles[1] == ({"LPV Air Volume"} if runs else set())  # it only absorbs
    assert titles[2] == set()


@pytest.mark.parametrize(
    ("setting", "gone"),
    [
        ("use_indirect_diffuse", "LPV Lighting Computation"), ("use_glossy", "LPV Glossy Computation"),
        ("use_ao", "LPV AO Generation"),
        ("use_translucency", "LPV Translucency"), ("lpv.occlusion", "LPV Geometry Injection"),
    ],
)  # fmt: skip
def test_a_switched_off_effect_costs_nothing(setting, gone):
    scene = scenes.cornell()
    scene.materials[0] = scenes.principled(Base_Color=scenes.WHITE, Roughness=0.3)
    scene.materials.append(scenes.principled(Transmission_Weight=1.0, Roughness=0.1))
    scene.instances.materials[-1] = (len(scene.materials) - 1,)
    chosen = Settings()
    chosen.set("technique", "LPV")
    outputs = ("Combined", "Ambient Occlusion")
    on = {p.title for p in inspect(scene, chosen, outputs, resolution=SMALL).run}
    chosen.set(setting, False)
    off = inspect(scene, chosen, outputs, resolution=SMALL)
    assert gone in on and gone not in {p.title for p in off.run}
    assert not any(w.name in off.resources for p in lpv.passes(chosen, ()) if p.title == gone for w in p.writes)


def test_iterations_say_how_many_cells_far_light_comes(gl):
    """After N iterations it is within N cells (|i| + |j| + |k|) of its source, and as many as the grid is wide are all."""
    for n in (0, 1, 3):
        g, _, volume, _ = volumes(far_scene(), inject=emitter(), lpv__resolution=8, lpv__occlusion=False, lpv__iterations=n)
        c = np.array([s // 2 for s in g.size][::-1])
        lit = np.argwhere(volume[0, ..., 0] > 0.0)
        reach = np.abs(lit - c).sum(axis=1).max()
        assert reach == (n or np.maximum(c, np.array(volume.shape[1:4]) - 1 - c).sum())
    scene = scenes.cornell()
    _, _, swept, _ = volumes(scene, lpv__resolution=8, lpv__cascades="1")  # iterations are cells of one grid
    g, _, iterated, _ = volumes(scene, lpv__resolution=8, lpv__iterations=sum(g.size))
    np.testing.assert_allclose(iterated, swept, rtol=1e-4, atol=1e-6 * np.abs(swept).max())


def beam_before_steps(run, wx, wy, share, rows=160):
    """Mean radiance of the cells along a flight of steps that a uniform beam of radiance 1 grazes, by the propagation's balance
    in a plane. The beam goes along +x and +y (weights ``wx``, ``wy``), off the treads and into the steps, which are ``run``
    cells apart (x), or 1/run cells high (y) where that is less than 1; ``share`` is what a step takes of all it could."""
    rises = run >= 1.0
    wall = (lambda i: i // round(run)) if rises else (lambda i: i // round(1.0 / run))
    radiance, passed = np.ones((rows, 2 * rows)), np.ones((rows, 2 * rows))
    along = []
    for i in range(1, rows):
        for j in range(1, 2 * rows):
            # (x, y) is (i, j) with air at y ≥ wall(x), or (j − rows, i) with air at x ≤ wall(y).
            if rises:
                inside, behind_tread, step_ahead = j >= wall(i), j - 1 < wall(i), j < wall(i + 1)
                from_x, from_y = (i - 1, j), (i, j - 1)
            else:
                inside, behind_tread, step_ahead = j <= wall(i) + rows, j > wall(i - 1) + rows, j + 1 > wall(i) + rows
                from_x, from_y = (i, j - 1), (i - 1, j)
            if not inside:
                continue
            flux = wx * radiance[from_x] * passed[from_x]
            flux += 0.0 if behind_tread else wy * radiance[from_y] * passed[from_y]
            section = wx if behind_tread else wx + wy
            ahead = wy if step_ahead else wx + wy
            radiance[i, j] = flux / section
            passed[i, j] = (section - share * max(section - ahead, 0.0)) / ahead
            if i > rows // 2 and (behind_tread if rises else step_ahead):
                along.append(radiance[i, j])
    period = round(run if rises else 1.0 / run)
    return np.mean(along[: len(along) // period * period])


@pytest.mark.parametrize(
    ("run", "elevation"), [(2, 12.0), (3, 10.0), (5, 8.0), (1 / 3, 65.0), (1 / 6, 75.0), (1, 30.0), (1 / 2, 40.0)]
)
def test_a_beam_that_grazes_steps_stays_one(gl, run, elevation):
    """What a step takes of a grazing beam leaves the cells before the wall the beam's radiance in the mean, at any slope; if
    steps took all that comes, they would have .47 to .81 of it."""
    wx, wy = np.cos(np.radians(elevation)), np.sin(np.radians(elevation))
    n = np.array([-1.0, run]) / np.hypot(1.0, run)
    leaving, meeting = wy * n[1], -wx * n[0]
    assert meeting > leaving
    code = """
const int grid_column = 0; const int grid_first = 0; const ivec3 grid_size = ivec3(1);
#include "engines/lpv/transport_lib.glsl"
vec4 evaluate(vec4 i) { return vec4(step_share(i.z, i.w, vec3(-i.x, i.y, 0.0), vec3(i.xy, 0.0))); }
"""
    share = float(gl(lambda g: evaluate(g, code, [[wx, wy, leaving, meeting]], HAS_LPV_WALLS=0, LPV_CHOOSES=0))[0, 0])
    assert beam_before_steps(run, wx, wy, share) == pytest.approx(1.0, abs=0.03)
    if share < 0.9:
        assert beam_before_steps(run, wx, wy, 1.0) < 0.9
