# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes far from the origin, where 32-bit coordinates are coarse."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import make

from gi_addon.compare import scenes
from gi_addon.engines import TECHNIQUES
from gi_addon.scene import Link, Material, Node, ShaderGraph

PASSES = ("Combined", "Diffuse Direct", "Diffuse Indirect")
# Whole powers of two, so that nothing is rounded before Quartet has it.
FAR = np.array([2.0**17, -(2.0**16), 2.0**15])


@pytest.mark.parametrize("technique", sorted(TECHNIQUES))
def test_a_scene_131_km_away_renders_as_at_home(gl, technique):
    """Light knows no places: what is moved as a whole looks the same, to the rounding of 64-bit matrices. 32-bit
    coordinates there are 8 mm apart, and shadows and bounces of a 2 m room would be ruled by that."""
    near = scenes.cornell(light="spot")
    options = {"technique": technique, "samples": 2, "resolution": (48, 27)}
    at_home = make(near, *PASSES, **options).passes
    away = make(near.moved(FAR), *PASSES, **options).passes
    for name in PASSES:
        scale = at_home[name].mean()
        assert scale > 0.0
        # A few pixels on edges may round to the other side.
        assert np.abs(away[name] - at_home[name]).mean() < 2e-3 * scale, name


def test_materials_still_see_the_world_where_it_is(gl):
    """A plane that emits its Position: 1/4096 of x, y in metres, at 131 km."""
    graph = ShaderGraph(
        (
            Node("NEW_GEOMETRY", "Geometry", {}),
            Node("VECT_MATH", "Scale", {"Vector": Link(0, "Position"), "Scale": 2.0**-12}, {"operation": "SCALE"}),
            Node("EMISSION", "Emission", {"Color": Link(1, "Vector"), "Strength": 1.0}),
        ),
        Link(2, "Emission"),
    )
    b = scenes.SceneBuilder("far")
    b.quads(np.array([[[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]], "f4"), Material("Where", graph))
    scene = b.build(scenes.perspective((0, -0.01, 3), (0, 0, 0), 0.5)).moved(np.array([2.0**17, 2.0**16, 0.0]))
    color = make(scene, "Emission", samples=1, resolution=(9, 5)).passes["Emission"]
    np.testing.assert_allclose(color[2, 4, :2], (32.0, 16.0), atol=2e-3)


def test_near_scenes_are_left_where_they_are():
    """Within 16 radii nothing moves, so that pictures stay the same to the bit."""
    scene = scenes.cornell(light="spot")
    assert not scene.far_origin().any()
    assert not scene.moved(np.array([10.0, 0.0, 0.0])).far_origin().any()
    origin = scene.moved(FAR).far_origin()
    low, high = scene.moved(FAR).bounds()
    radius = 0.5 * np.linalg.norm(high - low)
    assert np.abs((low + high) / 2.0 - origin).max() <= 16.0 * radius
