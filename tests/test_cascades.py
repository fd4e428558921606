# SPDX-License-Identifier: GPL-3.0-or-later
"""Grids of LPV within each other around the camera."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from conftest import make
from test_focus import props

from gi_addon.compare import scenes
from gi_addon.compare.stability_checks import _FLOOR, wall_reference
from gi_addon.focus import Focus, find_focus
from gi_addon.nested_grids import MOST_GRIDS, grids_needed, nested_grids
from gi_addon.renderer import inspect
from gi_addon.settings import Settings

BOX = np.array([[0.0, 0.0, 0.0], [30.0, 20.0, 10.0]])


def indirect(scene, *, size=(64, 36), **settings):
    options = {"technique": "LPV", "samples": 1, "resolution": size} | settings
    return make(scene, "Diffuse Indirect", **options).passes["Diffuse Indirect"]


def near_corner(eye=(0.0, 0.6, 0.5)):
    """The corner's wall from near it: its middle is in the inner grid, its ends are not."""
    scene = scenes.corner()
    scene.camera = scenes.perspective(eye, (eye[0], 0.0, 0.45), 2.0, clip=(0.01, 10))
    return scene


@pytest.mark.parametrize("eye", [(15.0, 10.0, 5.0), (0.0, 0.0, 0.0), (29.0, -50.0, 3.0), (np.inf, np.nan, 0.0)])
def test_inner_grids_lie_on_the_cells_of_the_one_around_wherever_the_eye_is(eye):
    found = nested_grids(Focus.on(BOX), 32, MOST_GRIDS, np.array(eye))
    sizes = [g.size for g in nested_grids(Focus.on(BOX), 32, MOST_GRIDS, np.array([7.0, 7.0, 7.0]))]
    assert [g.size for g in found] == sizes
    for outer, inner in pairwise(found):
        assert inner.cell == outer.cell / 2.0
        low = (np.array(inner.origin) - outer.origin) / outer.cell
        high = low + np.array(inner.size) / 2.0
        np.testing.assert_allclose(low, inner.low, atol=1e-9)
        assert (low >= -1e-9).all() and (high <= np.array(outer.size) + 1e-9).all()
        assert (inner.column, inner.first) == (outer.column + outer.size[0], outer.first + outer.cells)
        # A side is a rim where light of the grid around comes in behind it: everywhere but at the scene's own border.
        for axis in range(3):
            end = inner.origin[axis] + inner.size[axis] * inner.cell
            border = found[0].origin[axis], found[0].origin[axis] + found[0].size[axis] * found[0].cell
            assert bool(inner.rim >> 2 * axis & 1) == (inner.origin[axis] > border[0] + 1e-6)
            assert bool(inner.rim >> 2 * axis + 1 & 1) == (end < border[1] - 1e-6)


def test_grids_move_by_whole_cells_of_the_one_around():
    """A path of the eye in steps of 1/8 of a cell: the inner grid stands still but for one jump of one cell a cell."""
    cell = nested_grids(Focus.on(BOX), 32, 2, np.zeros(3))[0].cell
    eyes = [np.array([12.0 + k * cell / 8.0, 9.0, 5.0]) for k in range(33)]
    lows = np.array([nested_grids(Focus.on(BOX), 32, 2, e)[1].low for e in eyes])
    steps = np.diff(lows[:, 0])
    assert steps.sum() == 4 and set(steps) == {0, 1} and not np.diff(lows[:, 1:], axis=0).any()


def test_grids_follow_the_way_from_surface_to_surface():
    """A room needs one grid; props on a kilometre of ground, whose region is seven times as wide as they are, more. The free path
    of an empty cube of edge a is 4 a³/(6 a²) = ⅔ a, whatever its walls are made of."""
    room = find_focus(scenes.integrating_sphere(radius=1.5))
    assert room.free_path == pytest.approx(2.0, rel=1e-3)
    for scene in (scenes.cornell(), scenes.corner(), scenes.corridor(), scenes.furnace(), scenes.sliding_plate()):
        assert grids_needed(find_focus(scene), 32) == 1
    assert grids_needed(find_focus(props(1000.0)), 32) == 2
    assert grids_needed(find_focus(props(1000.0)), 16) == 3
    flat = scenes.plane_scene(scenes.point_light((0, 0, 1), 1.0))
    assert grids_needed(find_focus(flat), 32) == 1  # light flies nowhere between surfaces of one plane


def test_one_grid_costs_nothing():
    """Where one grid will do, automatic cascades plan the very passes, sizes and programs of a single grid."""
    plans = []
    for cascades in ("AUTO", "1", "2"):
        chosen = Settings()
        chosen.set("technique", "LPV")
        chosen.set("lpv.cascades", cascades)
        plan = inspect(scenes.cornell(), chosen, ("Combined",), resolution=(64, 36))
        plans.append((plan.nbytes(), [(p.title, p.defines()) for p in plan.run]))
    assert plans[0] == plans[1]
    assert plans[2][0] > plans[0][0] and [t for t, _ in plans[2][1]] == [t for t, _ in plans[0][1]]


def test_light_is_the_closed_form_on_both_sides_of_a_rim(gl):
    """A lit floor's light on the wall before it (Lambert's polygon), in columns across the rim of the inner grid, x = ± ½: it
    goes over without a step, within 5 % as one grid's does, and where the cells are half as wide the error is smaller."""
    scene = near_corner()
    exact = np.nan_to_num(wall_reference(scene.camera, (64, 36), _FLOOR, 0.8 * 5.0))
    gains, errors = [], []
    for cascades in ("1", "2"):
        image = indirect(scene, lpv__cascades=cascades)[..., 0]
        seen = exact > 0.0
        gains.append(np.array([(image[:, x][seen[:, x]]).sum() / exact[:, x].sum() for x in np.flatnonzero(seen.any(axis=0))]))
        errors.append(np.mean((image[seen] / exact[seen] - 1.0) ** 2))
    one, two = gains
    middle = slice(len(one) // 2 - 4, len(one) // 2 + 4)
    assert np.abs(two - 1.0).max() < 0.05 and np.abs(np.diff(two)).max() < 0.02
    assert np.abs(two[middle] - 1.0).mean() < 0.75 * np.abs(one[middle] - 1.0).mean()
    np.testing.assert_array_equal(one[:2], two[:2])  # outside of the inner grid it is the outer one's
    assert errors[1] < 0.9 * errors[0]


def test_a_step_of_the_camera_over_a_cell_does_not_flicker(gl):
    """Stability test 8 with an inner grid: as the camera goes a cell along, the light of each place on the wall changes by
    less than .5 % in the mean, and not at all where the grid stands still."""
    cell = nested_grids(find_focus(scenes.corner()), 32, 2, np.zeros(3))[0].cell
    means, places = [], []
    for k in range(3):
        scene = near_corner()
        scene.camera = scenes.orthographic((0.0, 0.6, 0.45), (0.0, 0.0, 0.45), 0.8, aspect=16 / 9)
        # The picture stays, the camera that the grids follow goes along: an orthographic view shifted back.
        matrix = np.asarray(scene.camera.world_from_view, "f8").copy()
        matrix[0, 3] += k * cell / 2.0
        scene.camera.world_from_view = matrix
        projection = np.asarray(scene.camera.clip_from_view, "f8").copy()
        view_from_world = np.linalg.inv(matrix)
        back = view_from_world[:3, :3] @ np.array([k * cell / 2.0, 0.0, 0.0])
        projection[:, 3] += projection[:, :3] @ back
        scene.camera.clip_from_view = projection
        image = indirect(scene, lpv__cascades="2", lpv__directions="48")
        means.append(image.mean())
        places.append(nested_grids(find_focus(scene), 32, 2, matrix[:3, 3])[1].low)
    jumps = np.abs(np.diff(means)) / means[0]
    assert len(set(places)) >= 2
    assert jumps.max() <= 0.005
    assert all(j < 1e-5 for j, a, b in zip(jumps, places[:-1], places[1:], strict=True) if a == b)


def test_props_on_a_kilometre_of_ground_have_the_light_of_a_small_one(gl):
    """Against a ground of 8 m in one fine grid: cascades come nearer than the one grid over the region does."""
    reference = indirect(props(8.0), lpv__resolution=64)
    errors = []
    for cascades in ("1", "3"):
        image = indirect(props(1000.0), lpv__resolution=16, lpv__cascades=cascades)
        errors.append(np.mean((image - reference) ** 2) / np.mean(reference**2))
    assert errors[1] < 0.7 * errors[0], errors


@pytest.mark.parametrize("bounces", [1, 3])
def test_all_that_looks_light_up_knows_all_grids(gl, bounces):
    """A mirror and ambient occlusion in a box with two grids are what they are with one, to 10 %, and nothing is not a number."""
    b = scenes.SceneBuilder("mirror")
    sides = scenes.box_quads((-1, -1, 0), (1, 1, 2), inward=True)
    b.quads(sides[[0, 1, 2, 4, 5]], scenes.diffuse((0.7,) * 3))
    b.quads(sides[[3]], scenes.principled(**{"Base Color": (0.9, 0.9, 0.9, 1.0), "Metallic": 1.0, "Roughness": 0.1}))
    b.quads(scenes.box_quads((0.31, 0.59, 0.0), (0.47, 0.77, 0.33)), scenes.diffuse((0.5,) * 3))
    b.light(scenes.point_light((0.3, 0.2, 1.5), 50.0))
    scene = b.build(scenes.perspective((0.6, 0.3, 0.45), (0.5, 1.0, 0.4), 1.4, clip=(0.01, 10)))
    outputs = ("Glossy Indirect", "Ambient Occlusion")
    one, two = (
        make(scene, *outputs, technique="LPV", samples=2, resolution=(48, 27), bounces=bounces, lpv__resolution=16,
             lpv__cascades=c, ao__distance=0.6).passes
        for c in ("1", "2")
    )  # fmt: skip
    for name in outputs:
        assert np.isfinite(two[name]).all() and two[name].mean() == pytest.approx(one[name].mean(), rel=0.1), name
        assert np.abs(two[name] - one[name]).max() > 0.0


def test_occlusion_sees_a_wall_at_the_border_of_the_inner_grid(gl):
    """A wall just behind the inner grid's border: floor half a metre before it is as open as with one grid."""
    floor, black = np.array([[[-4.0, -4, 0], [4, -4, 0], [4, 4, 0], [-4, 4, 0]]]), scenes.diffuse((0.5,) * 3)
    eye = np.array([-1.9, 0.0, 1.0])

    def scene(x):
        b = scenes.SceneBuilder("border")
        b.quads(floor, black)
        b.quads(np.array([[[x, -4.0, 0], [x, 4, 0], [x, 4, 4], [x, -4, 4]]]), black)
        b.light(scenes.point_light((-1.0, 0.0, 2.0), 10.0))
        return b.build(scenes.perspective(eye, (1.0, 0.0, 0.0), 0.9))

    _, inner = nested_grids(find_focus(scene(1.0)), 16, 2, eye)
    border = inner.origin[0] + inner.size[0] * inner.cell
    assert -1.0 < border < 3.0
    moved = scene(border + 0.2 * inner.cell)
    assert nested_grids(find_focus(moved), 16, 2, eye)[1] == inner
    one, two = (
        make(moved, "Ambient Occlusion", technique="LPV", samples=4, resolution=(48, 27), lpv__resolution=16, lpv__cascades=c,
             ao__distance=3.0).passes["Ambient Occlusion"][..., 0]
        for c in ("1", "2")
    )  # fmt: skip
    middle = (slice(6, 20), slice(12, 36))
    assert one[middle].mean() < 0.93
    assert two[middle].mean() == pytest.approx(one[middle].mean(), abs=0.03)
