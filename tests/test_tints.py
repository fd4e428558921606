# SPDX-License-Identifier: GPL-3.0-or-later
"""What is coloured and see-through, lights with a falloff of their own, and means of materials: closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import make

from gi_addon.compare import scenes
from gi_addon.emitters import Emitters
from gi_addon.engines import TECHNIQUES
from gi_addon.materials import mean_albedo
from gi_addon.scene import Link, Material, Node, ShaderGraph

FILM, OTHER = np.array([0.9, 0.3, 0.1]), np.array([0.2, 0.6, 0.8])
RESOLUTION = (33, 19)


def film(kind, color):
    node = Node(kind, "Film", {"Color": tuple(color), "Roughness": 0.0, "IOR": 1.0})
    return Material("Film", ShaderGraph((node,), Link(0, "BSDF")))


def films(kind="BSDF_TRANSPARENT", between=False):
    """A white wall at y = 1 that the sun shines on from above through two coloured films; ``between``: with the camera below
    them, so that it sees the wall as it is, else through them."""
    b = scenes.SceneBuilder("films")
    square = np.array([[[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]]], "f4")
    b.quads(4.0 * square + np.array([0, 1, 0], "f4"), scenes.diffuse((1.0, 1.0, 1.0)))
    for y, color in ((0.0, FILM), (-0.3, OTHER)):
        b.quads(square + np.array([0, y, 0], "f4"), film(kind, color))
    b.light(scenes.sun_light((0.0, 1.0, 0.0), 2.0))
    return b.build(scenes.perspective((0, 0.4, 0) if between else (0, -3, 0), (0, 1, 0), 0.3))


def center(scene, **settings):
    result = make(scene, "Combined", samples=32, resolution=RESOLUTION, use_indirect_diffuse=False, **settings)
    return result.passes["Combined"][6:13, 12:21, :3].mean(axis=(0, 1))


@pytest.mark.parametrize("technique", sorted(TECHNIQUES))
def test_light_through_coloured_films_has_their_colours_product(gl, technique):
    """E/π × both tints; seen through them once more, × both again."""
    lit = 2.0 / np.pi * FILM * OTHER
    np.testing.assert_allclose(center(films(between=True), technique=technique), lit, rtol=0.06)
    np.testing.assert_allclose(center(films(), technique=technique), lit * FILM * OTHER, rtol=0.1)


def test_light_through_coloured_glass_has_its_colour(gl):
    """Refraction by an index of 1 is none: the light is that of the transparent film."""
    np.testing.assert_allclose(center(films("BSDF_REFRACTION", between=True)), 2.0 / np.pi * FILM * OTHER, rtol=0.06)


def test_a_films_own_front_is_not_tinted_by_it(gl):
    """What stands between lamp and film is lit by the lamp as it is."""
    scene = films()
    scene.instances.matrix[0][1, 3] -= 2.0  # the wall before both films
    np.testing.assert_allclose(center(scene), 2.0 / np.pi, rtol=0.02)


@pytest.mark.parametrize(("power", "smooth"), [(1.0, 0.0), (2.0, 0.0), (0.0, 4.0)])
def test_a_lights_falloff_is_by_its_own_power_of_the_distance(gl, power, smooth):
    """E = I d^p / d² × d²/(d² + s) at d = 2 m."""
    light = scenes.point_light((0.0, 0.0, 0.0), 40.0)
    light.falloff, light.falloff_smooth = power, smooth
    b = scenes.SceneBuilder("falloff")
    square = np.array([[[-1, 2, -1], [1, 2, -1], [1, 2, 1], [-1, 2, 1]]], "f4")
    b.quads(square, scenes.diffuse((1.0, 1.0, 1.0)))
    b.light(light)
    scene = b.build(scenes.perspective((0, 1, 0), (0, 2, 0), 0.3))
    expected = 40.0 / (4.0 * np.pi) * 2.0**power / (4.0 + smooth) / np.pi
    np.testing.assert_allclose(center(scene), expected, rtol=0.02)


def graph(*nodes):
    return ShaderGraph(tuple(nodes), Link(len(nodes) - 1, "BSDF" if nodes[-1].kind.startswith("BSDF") else "Shader"))


def test_a_one_sided_wall_reflects_on_its_front_alone():
    """Mixed by Backfacing with a transparent shader, as importers of games' files do."""
    wall = graph(
        Node("BSDF_DIFFUSE", "", {"Color": (0.8, 0.4, 0.2)}), Node("BSDF_TRANSPARENT", "", {"Color": (1.0,) * 3}),
        Node("NEW_GEOMETRY", "", {}),
        Node("MIX_SHADER", "", {"Fac": Link(2, "Backfacing"), "Shader": Link(0, "BSDF"), "Shader_001": Link(1, "BSDF")}),
    )  # fmt: skip
    np.testing.assert_allclose(mean_albedo(wall, []), (0.8, 0.4, 0.2))
    np.testing.assert_allclose(mean_albedo(wall, [], back=True), 0.0)


@pytest.mark.parametrize(
    ("node", "output", "expected"),
    [
        (Node("COMBINE_COLOR", "", {"Red": 0.1, "Green": 0.5, "Blue": 0.9}), "Color", (0.1, 0.5, 0.9)),
        (Node("COMBINE_COLOR", "", {"Red": 0.0, "Green": 1.0, "Blue": 0.6}, {"mode": "HSV"}), "Color", (0.6, 0.0, 0.0)),
        (Node("GAMMA", "", {"Color": (0.25, 0.5, 1.0), "Gamma": 2.0}), "Color", (0.0625, 0.25, 1.0)),
        (Node("INVERT", "", {"Color": (0.25, 0.5, 1.0), "Fac": 1.0}), "Color", (0.75, 0.5, 0.0)),
        (Node("BRIGHTCONTRAST", "", {"Color": (0.25, 0.5, 1.0), "Bright": 0.1, "Contrast": 0.2}), "Color", (0.3, 0.6, 1.2)),
        (Node("HUE_SAT", "", {"Color": (0.2, 0.4, 0.4), "Saturation": 0.0}), "Color", (0.4, 0.4, 0.4)),
        (Node("VECT_MATH", "", {"Vector": (0.2, 0.4, 0.6), "Scale": 0.5}, {"operation": "SCALE"}), "Vector", (0.1, 0.2, 0.3)),
        (Node("MAP_RANGE", "", {"Value": 0.5, "To Min": 0.2, "To Max": 0.4}), "Result", (0.3,) * 3),
        (Node("CLAMP", "", {"Value": 2.0, "Max": 0.7}), "Result", (0.7,) * 3),
        (Node("FRESNEL", "", {"IOR": 1.0}), "Fac", (0.0,) * 3),
        (Node("FRESNEL", "", {"IOR": 1.5}), "Fac", (0.0918,) * 3),
    ],
    ids=lambda v: v.kind if isinstance(v, Node) else None,
)
def test_a_mean_colour_follows_the_nodes(node, output, expected):
    """Numbers through a node are what the node makes of them; a dielectric of index 1.5 reflects .0918 of diffuse light."""
    material = graph(node, Node("BSDF_DIFFUSE", "", {"Color": Link(0, output)}))
    np.testing.assert_allclose(mean_albedo(material, []), np.clip(expected, 0.0, 1.0), atol=5e-4)


def ball_and_receivers(receivers):
    mesh = scenes.sphere(1.0, 24, 12)
    corners = mesh.positions[mesh.triangles].astype("f8")
    corners = corners[Emitters(corners, corners[:, 0]).areas() > 0.0]  # the poles have triangles without area
    return Emitters(corners, np.ones((len(corners), 3)), np.ones(len(corners)), np.asarray(receivers, "f8"))


def test_points_of_a_far_ball_are_drawn_from_the_side_that_shines_here():
    """Seen from far away every guided point gives the same: power/share × cosθ is constant over the near half."""
    ball = ball_and_receivers([(0.0, 0.0, 1000.0)])
    normal = np.cross(ball.corners[:, 1] - ball.corners[:, 0], ball.corners[:, 2] - ball.corners[:, 0])
    up = normal[:, 2] / np.linalg.norm(normal, axis=1)
    assert ball.share.sum() == pytest.approx(1.0)
    # A quarter is by power: half of that goes to the side turned away.
    assert ball.share[up < 0.0].sum() == pytest.approx(0.125, abs=0.01)
    value = ball.areas() * np.maximum(up, 0.0) / ball.share
    spread = np.sqrt((ball.share * value**2).sum() / (ball.share * value).sum() ** 2 - 1.0)
    assert spread < 0.5  # by power alone: 1.29
    assert (ball.share * value).sum() == pytest.approx(np.pi, rel=0.03)


def test_what_closes_a_volume_is_known_by_its_edges():
    scene = scenes.furnace()  # of an emissive ball, seen from within
    emission = [np.ones(3)] * len(scene.materials)
    closed = Emitters.of(scene, emission)
    assert set(np.abs(closed.outward)) == {1.0}
    scene.meshes[0].slots = np.array([[0, 0, len(scene.meshes[0].triangles) - 1]])
    assert set(Emitters.of(scene, emission).outward) == {0.0}


def test_what_rough_glass_reflects_has_its_share_of_the_sub_frames(gl):
    """Its refraction may pass all light while it reflects besides: by the rest alone, the reflection was drawn in next to no
    sub-frame, and a thousand times too bright there (Glossy Color is at most 1 in expectation)."""
    b = scenes.SceneBuilder("rough glass")
    node = Node("BSDF_PRINCIPLED", "Glass", {"Base Color": (1.0,) * 3, "Transmission Weight": 1.0, "Roughness": 0.7, "IOR": 1.5})
    b.add(scenes.sphere(1.0, 48, 24), Material("Glass", ShaderGraph((node,), Link(0, "BSDF"))))
    b.light(scenes.sun_light((0.0, 1.0, -0.5), 1.0))
    scene = b.build(scenes.perspective((0, -4, 0), (0, 0, 0), 0.6))
    p = make(scene, "Glossy Color", samples=4, resolution=(64, 36), use_indirect_diffuse=False).passes
    assert p["Glossy Color"].max() < 4.0
