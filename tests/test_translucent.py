# SPDX-License-Identifier: GPL-3.0-or-later
"""Light through surfaces that scatter it to their other side."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import make

from gi_addon.compare import scenes
from gi_addon.compare.closed_forms import polygon_form_factor
from gi_addon.engines import TECHNIQUES
from gi_addon.scene import Link, Material, Node, ShaderGraph


def translucent(color):
    return Material("Sheet", ShaderGraph((Node("BSDF_TRANSLUCENT", "Sheet", {"Color": tuple(color)}),), Link(0, "BSDF")))


def sheet(blocked=False):
    """A sheet of 2 m between the camera at y = −3 and a lamp at y = 1; ``blocked`` puts a plate between lamp and sheet."""
    b = scenes.SceneBuilder("sheet")
    square = np.array([[[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]]], "f4")
    b.quads(square, translucent((0.8, 0.4, 0.2)))
    if blocked:
        b.quads(square * 0.9 + np.array([0, 0.5, 0], "f4"), scenes.diffuse((0.0,) * 3))
    b.light(scenes.point_light((0, 1, 0), 40.0))
    return b.build(scenes.perspective((0, -3, 0), (0, 0, 0), 0.3))


@pytest.mark.parametrize("technique", sorted(TECHNIQUES))
def test_a_lamp_behind_a_sheet_shines_through_it(gl, technique):
    """L = ρ E/π with E = Φ/(4π d²) cosθ at d = 1 m."""
    result = make(sheet(), "Combined", technique=technique, samples=32, resolution=(33, 19), use_indirect_diffuse=False)
    center = result.passes["Combined"][8:11, 15:18, :3].mean(axis=(0, 1))
    expected = np.array([0.8, 0.4, 0.2]) * 40.0 / (4.0 * np.pi) / np.pi
    np.testing.assert_allclose(center, expected, rtol=0.03)
    dark = make(sheet(blocked=True), "Combined", technique=technique, samples=32, resolution=(33, 19), use_indirect_diffuse=False)
    assert dark.passes["Combined"][9, 16, :3].max() < 0.02 * expected[0]


def test_a_sheet_shows_the_lit_floor_behind_it_in_lpv(gl):
    """A sheet that the sun touches nowhere has, in Diffuse Indirect, E/π of its far side: ρ E_sun/π times the form factor of the
    floor there, from its middle; within 12 %, the width of LPV's cells. The floor before it is dark."""
    b = scenes.SceneBuilder("sheet over a floor")
    b.quads(np.array([[[-1, 0, 0], [1, 0, 0], [1, 0, 2], [-1, 0, 2]]], "f4"), translucent((0.8, 0.4, 0.2)))
    floor = np.array([[-2.0, 0, 0], [2, 0, 0], [2, 3, 0], [-2, 3, 0]])
    b.quads(floor[None], scenes.diffuse((0.5,) * 3))
    b.light(scenes.sun_light((0.0, 0.0, -1.0), 4.0))
    scene = b.build(scenes.perspective((0, -4, 1), (0, 0, 1), 0.2))
    image = make(scene, "Diffuse Indirect", technique="LPV", samples=4, resolution=(32, 18)).passes["Diffuse Indirect"]
    form = polygon_form_factor(np.array([[0.0, 0, 1]]), np.array([[0.0, 1, 0]]), floor).mean()
    expected = 0.5 * 4.0 / np.pi * form
    np.testing.assert_allclose(image[..., :3].mean(axis=(0, 1)), expected, rtol=0.12)
