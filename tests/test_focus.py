# SPDX-License-Identifier: GPL-3.0-or-later
"""Small things on a huge ground: what the grids and maps are for."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import make

from gi_addon.compare import scenes
from gi_addon.engines import TECHNIQUES
from gi_addon.focus import _distance, find_focus

SUN = np.array([0.6, 0.0, -0.8])  # leans along x, so that shadows are ¾ of what throws them long


def props(ground: float, lamp=None):
    """A 0.4 m cube and a wall 1 m wide that the sun lights, on a square ``ground`` m wide, seen from above."""
    b = scenes.SceneBuilder("props")
    h = ground / 2.0
    b.quads(np.array([[[-h, -h, 0], [h, -h, 0], [h, h, 0], [-h, h, 0]]], "f4"), scenes.diffuse((0.5,) * 3))
    b.quads(scenes.box_quads((-0.2, -0.2, 0.0), (0.2, 0.2, 0.4)), scenes.diffuse((0.6,) * 3))
    b.quads(np.array([[[1.0, -0.5, 0], [1.0, -0.5, 1], [1.0, 0.5, 1], [1.0, 0.5, 0]]], "f4"), scenes.diffuse((0.8, 0.2, 0.1)))
    b.light(lamp or scenes.sun_light(SUN, 3.0))
    return b.build(scenes.perspective((0.0, -3.0, 2.5), (0.3, 0.0, 0.2), 0.7))


def test_a_huge_ground_is_no_part_of_the_region_but_a_room_is():
    small = find_focus(props(4.0))
    assert not small.narrow
    wide = find_focus(props(1000.0))
    assert wide.narrow and np.allclose(wide.core, [[-0.2, -0.5, 0.0], [1.0, 0.5, 1.0]], atol=1e-6)
    assert np.linalg.norm(wide.region[1] - wide.region[0]) < 20.0
    b = scenes.SceneBuilder("room")
    b.quads(scenes.box_quads((-5.0, -5.0, 0.0), (5.0, 5.0, 4.0), inward=True), scenes.diffuse((0.5,) * 3))
    b.quads(scenes.box_quads((-0.1, -0.1, 1.0), (0.1, 0.1, 1.2)), scenes.diffuse((0.5,) * 3))
    assert not find_focus(b.build(scenes.perspective((0, -3, 1), (0, 0, 1), 1.0))).narrow
    # A plate far off a small receiver is what lights it, not a backdrop.
    assert not find_focus(scenes.two_patches(distance=1.0, size=0.5)).narrow


def test_distances_to_triangles_are_to_their_insides_edges_and_corners():
    plane = np.array([[[-1, -1, 2], [3, -1, 2], [-1, 3, 2]]], "f8")
    assert _distance(plane) == pytest.approx(2.0)
    assert _distance(plane + np.array([0, 2.0, 0])) == pytest.approx(np.sqrt(5.0))  # edge y = 1
    assert _distance(plane + np.array([2.0, 2.0, 0])) == pytest.approx(np.sqrt(6.0))  # corner (1, 1)


@pytest.mark.parametrize("technique", sorted(TECHNIQUES))
def test_light_does_not_know_how_far_the_ground_goes(gl, technique):
    """A ground of 1 km looks as one of 8 m does: of the light that the wall gets from the ground, what lies beyond 4 m adds
    less than 5 % (a floor's view factor from a point at height h of a wall, ½ (1 − h/√(h² + R²))-like, ends there)."""
    passes = ("Diffuse Direct", "Diffuse Indirect")
    # RSM's few virtual lights near the wall are ± 15 % in 4 sub-frames.
    options = {"technique": technique, "samples": 16 if technique == "RSM" else 4, "resolution": (64, 36)}
    near, far = (make(props(size), *passes, **options).passes for size in (8.0, 1000.0))
    # The cube's and the wall's shadows, to the pixel.
    assert np.abs(near["Diffuse Direct"] - far["Diffuse Direct"]).mean() < 0.01 * near["Diffuse Direct"].mean()
    assert (far["Diffuse Direct"].max(axis=-1) < 1e-3).mean() > 0.01
    gain = far["Diffuse Indirect"].sum() / near["Diffuse Indirect"].sum()
    assert 0.85 < gain < 1.2, gain


def test_a_lamp_above_a_huge_ground_still_sees_what_is_near_it(gl):
    """A plate 0.3 m below a lamp throws its shadow, however far the ground goes."""
    b = scenes.SceneBuilder("plate")
    b.quads(np.array([[[-500, -500, 0], [500, -500, 0], [500, 500, 0], [-500, 500, 0]]], "f4"), scenes.diffuse((0.5,) * 3))
    b.quads(scenes.box_quads((-0.1, -0.1, 0.69), (0.1, 0.1, 0.7)), scenes.diffuse((0.5,) * 3))
    b.light(scenes.point_light((0, 0, 1), 50.0))
    scene = b.build(scenes.perspective((0.0, -2.0, 0.4), (0.0, 0.0, 0.0), 0.3))
    direct = make(scene, "Diffuse Direct", samples=4, resolution=(33, 19)).passes["Diffuse Direct"]
    assert direct[9, 16].max() < 1e-3


def test_a_negative_lamp_takes_light_away(gl):
    """Cycles' lights of negative power subtract: two that cancel leave nothing, at every point."""
    at = ((0.0, 0.0, 1.0), (0.0, 0.0, 1.0))
    lamps = [scenes.point_light(p, power) for p, power in zip(at, (80.0, -30.0), strict=True)]
    both, single = scenes.plane_scene(lamps[0]), scenes.plane_scene(scenes.point_light(at[0], 50.0))
    both.lights.append(lamps[1])
    a, b = (make(s, "Diffuse Direct", samples=2, resolution=(32, 18)).passes["Diffuse Direct"] for s in (both, single))
    np.testing.assert_allclose(a, b, rtol=1e-4, atol=1e-5)
