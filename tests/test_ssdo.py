# SPDX-License-Identifier: GPL-3.0-or-later
"""SSDO against closed forms, and the stability tests in their screen-space form. f_s = 1: nothing here is fitted."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import make
from gpu import evaluate

from gi_addon.compare import scenes
from gi_addon.compare.closed_forms import camera_rays, hits
from gi_addon.compare.visible_light import light_unseen, visible_light
from gi_addon.renderer import inspect
from gi_addon.settings import Settings, walk


def ssdo(scene, *outputs, **settings):
    return make(scene, *outputs, technique="SSDO", **settings)


# --- closed forms -------------------------------------------------------------------------------------------------------


def seen_share(camera, points: np.ndarray) -> float:
    """Share of ``points`` (N, 3) that lie inside the picture."""
    clip = np.c_[points, np.ones(len(points))] @ np.linalg.inv(camera.world_from_view).T @ camera.clip_from_view.T
    return float(((np.abs(clip[:, :2]) <= clip[:, 3:]).all(axis=1) & (clip[:, 3] > 0)).mean())


def sphere_hits(lamp, count: int = 200_000) -> np.ndarray:
    """Where the light of a lamp in the unit sphere lands, each point with the same flux."""
    d = np.random.default_rng(0).normal(size=(count, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    lamp = np.asarray(lamp, "f8")
    along = d @ lamp
    return lamp + d * (np.sqrt(along**2 - lamp @ lamp + 1.0) - along)[:, None]


@pytest.mark.parametrize("lamp", [(0.0, 0.0, 0.0), (0.0, 0.8, 0.0)])
def test_sphere_one_bounce_is_the_share_of_lit_surface_on_screen(gl, lamp):
    """Stability test 1. In a sphere every patch lights every point alike, 1/(4πR²) per flux: what the screen shows of the
    flux is what a point gets of E₁ = ρΦ/(4πR²). g = share ± .03."""
    scene = scenes.integrating_sphere(albedo=0.5, power=100.0, light=lamp)
    image = ssdo(scene, "Diffuse Indirect", samples=4, ssdo__margin=0.0).passes["Diffuse Indirect"][..., 0]
    g = image.mean() * np.pi / (0.5 * 100.0 / (4 * np.pi))
    assert g == pytest.approx(seen_share(scene.camera, sphere_hits(lamp)), abs=0.03)


def polygon_irradiance(points: np.ndarray, normal, polygon: np.ndarray) -> np.ndarray:
    """E/L (N,) at points (N, 3) from a Lambertian polygon (K, 3): ½ Σ Θ_i Γ_i·n over its edges (J. Lambert, 1760)."""
    v = polygon[None] - points[:, None]
    v /= np.linalg.norm(v, axis=-1, keepdims=True)
    w = np.roll(v, -1, axis=1)
    cross = np.cross(v, w)
    length = np.linalg.norm(cross, axis=-1)
    angle = np.arctan2(length, (v * w).sum(-1))
    return np.abs(0.5 * (angle * (cross @ np.asarray(normal, "f8")) / np.maximum(length, 1e-12)).sum(-1))


FLOOR = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], "f8")


def corner(camera):
    """A floor under a sun that passes along a wall: the floor's light on the wall is all the wall gets."""
    b = scenes.SceneBuilder()
    b.quads(FLOOR[None], scenes.diffuse((0.8,) * 3))
    b.quads(np.array([[[-1, 1, 0], [1, 1, 0], [1, 1, 1], [-1, 1, 1]]]), scenes.diffuse((0.8,) * 3))
    b.light(scenes.sun_light((0, 0, -1), 5.0))
    return b.build(camera)


def wall_points(camera, shape) -> tuple[np.ndarray, np.ndarray]:
    """Pixels (H, W) that show the wall, and where on it (N, 3)."""
    height, width = shape
    x, y = np.meshgrid((np.arange(width) + 0.5) / width * 2 - 1, (np.arange(height) + 0.5) / height * 2 - 1)
    inverse = camera.world_from_view @ np.linalg.inv(camera.clip_from_view)
    near, far = (np.stack([x, y, np.full_like(x, z), np.ones_like(x)], -1) @ inverse.T for z in (-1.0, 1.0))
    near, far = near[..., :3] / near[..., 3:], far[..., :3] / far[..., 3:]
    p = near + (far - near) * ((1.0 - near[..., 1]) / (far - near)[..., 1])[..., None]
    edge = 0.04  # pixels wholly on the wall
    on = (np.abs(p[..., 0]) < 1 - edge) & (p[..., 2] > edge) & (p[..., 2] < 1 - edge)
    return on, p[on]


def test_a_lit_floor_lights_a_wall_by_its_form_factor(gl):
    """E = ρ E_sun F with Lambert's polygon formula, both surfaces on the screen: the mean to 2 %, three heights of the wall to
    5 %, single pixels to 10 % in the mean."""
    camera = scenes.perspective((0.3, -3.2, 1.8), (0, 0.3, 0.3), 0.9)
    image = ssdo(corner(camera), "Diffuse Indirect", samples=8, gather_scale=1).passes["Diffuse Indirect"][..., 0]  # fmt: skip
    on, points = wall_points(camera, image.shape)
    expected = 0.8 * 5.0 / np.pi * polygon_irradiance(points, (0, -1, 0), FLOOR) / np.pi
    got = image[on]
    assert got.mean() == pytest.approx(expected.mean(), rel=0.02)
    for low, high in ((0.0, 0.3), (0.3, 0.6), (0.6, 1.0)):
        part = (points[:, 2] >= low) & (points[:, 2] < high)
        assert got[part].mean() == pytest.approx(expected[part].mean(), rel=0.05), (low, high)
    assert np.abs(got / expected - 1).mean() < 0.1


def test_brightness_does_not_change_with_zoom_view_or_size(gl):
    """± 3 %: the wall's light seen from near and far, through wide and narrow lenses, in pictures of three sizes, and by
    an orthographic camera; everything stays on the screen. Gathered at every pixel: blocks of four interpolated over a wall
    of a few blocks are another error, 4 %."""
    views = [
        (scenes.perspective((0, -3, 2), (0, 0, 0.3), 1.0), (96, 54)),
        (scenes.perspective((0, -3, 2), (0, 0, 0.3), 1.0), (48, 27)),
        (scenes.perspective((0, -3, 2), (0, 0, 0.3), 1.0), (160, 90)),
        (scenes.perspective((0, -3, 2), (0, 0, 0.3), 1.6), (96, 54)),
        (scenes.perspective((0, -12, 8), (0, 0, 0.3), 0.3), (96, 54)),
        (scenes.orthographic((0, -3, 2), (0, 0, 0.3), 3.4), (96, 54)),
    ]
    gains = []
    for camera, size in views:
        p = ssdo(corner(camera), "Diffuse Indirect", resolution=size, samples=8, gather_scale=1).passes  # fmt: skip
        on, points = wall_points(camera, size[::-1])
        expected = 0.8 * 5.0 / np.pi * polygon_irradiance(points, (0, -1, 0), FLOOR) / np.pi
        gains.append(p["Diffuse Indirect"][..., 0][on].sum() / expected.sum())
    assert np.abs(np.array(gains) - 1).max() <= 0.03, gains


def test_the_low_resolution_gather_changes_little(gl):
    """Smoothed and interpolated over blocks of 4 pixels: the mean within 3 %, and each pixel within 8 % in the mean."""
    scene = corner(scenes.perspective((0.3, -3.2, 1.8), (0, 0.3, 0.3), 0.9))
    full, low = (
        ssdo(scene, "Diffuse Indirect", samples=8, resolution=(160, 90), gather_scale=s,
             ssdo__samples=256).passes["Diffuse Indirect"]
        for s in (1, 4)
    )  # fmt: skip
    assert low.mean() == pytest.approx(full.mean(), rel=0.03)
    assert np.abs(low - full).mean() / full.mean() < 0.08


@pytest.mark.parametrize("bounces", [2, 4])
def test_more_bounces_follow_the_geometric_series(gl, bounces):
    """Stability test 2 in its screen-space form: each bounce brings ρ × (share of the sphere on screen) of the one before."""
    scene = scenes.integrating_sphere(albedo=0.5, power=100.0)
    one, more = (
        ssdo(scene, "Diffuse Indirect", samples=4, bounces=n, ssdo__margin=0.0).passes["Diffuse Indirect"].mean()
        for n in (1, bounces)
    )
    ratio = 0.5 * seen_share(scene.camera, sphere_hits((0, 0, 0)))
    assert more / one == pytest.approx(sum(ratio**k for k in range(bounces)), abs=0.025)


def test_a_flat_plane_never_lights_itself(gl):
    scene = scenes.plane_scene(scenes.point_light((0, 0, 1), 100.0))
    assert ssdo(scene, "Diffuse Indirect", samples=2).passes["Diffuse Indirect"].max() == 0.0


def test_the_world_arrives_through_open_directions(gl):
    """Directional occlusion alone: a plane under a world of radiance L has E/π = L; at the foot of an endless wall half."""
    b = scenes.SceneBuilder()
    b.quads(FLOOR[None] * 3, scenes.diffuse((0.8,) * 3))
    scene = b.build(scenes.perspective((0, -3, 2), (0, 0, 0), 0.8), scenes.world((0.5, 0.6, 0.7)))
    p = ssdo(scene, "Diffuse Direct", "Depth", samples=4, ssdo__sources="SCREEN").passes
    seen = p["Depth"][..., 0] < 1e9
    assert p["Diffuse Direct"][seen].mean(axis=0) == pytest.approx(np.array([0.5, 0.6, 0.7]), rel=0.01)
    b = scenes.SceneBuilder()
    b.quads(FLOOR[None] * 3, scenes.diffuse((0.5,) * 3))
    b.quads(np.array([[[-30, 0, 0], [30, 0, 0], [30, 0, 30], [-30, 0, 30]]]), scenes.diffuse((0.5,) * 3))
    scene = b.build(scenes.orthographic((0, -0.6, 0.6), (0, 0, 0), 0.5), scenes.world((1, 1, 1)))
    p = ssdo(scene, "Diffuse Direct", "Normal", samples=8, ssdo__sources="SCREEN",
             gather_scale=1).passes  # fmt: skip
    floor = (p["Normal"][..., 2] > 0.999) & (p["Diffuse Direct"][..., 0] > 0)
    near = floor & (np.roll(~floor, -2, axis=0))  # two pixels below the wall's foot
    assert p["Diffuse Direct"][near].mean() == pytest.approx(0.5, abs=0.06)


def test_emissive_pixels_light_by_their_form_factor(gl):
    """The floor emits: E on the wall is L × Lambert's polygon formula, 3 %; and it counts as direct light, as in Cycles."""
    camera = scenes.perspective((0.3, -3.2, 1.8), (0, 0.3, 0.3), 0.9)
    scene = corner(camera)
    scene.lights = []
    scene.materials[0] = scenes.emissive((1, 1, 1), 2.0)
    image = ssdo(scene, "Diffuse Direct", samples=16, ssdo__sources="SCREEN").passes["Diffuse Direct"][..., 0]
    on, points = wall_points(camera, image.shape)
    expected = 2.0 * polygon_irradiance(points, (0, -1, 0), FLOOR) / np.pi
    assert image[on].mean() == pytest.approx(expected.mean(), rel=0.03)


# --- the kernels --------------------------------------------------------------------------------------------------------


SLICE = """
Slice slice_of(vec4 x)
{
    vec3 n = vec3(sin(x.x), 0.0, cos(x.x));
    return make_slice(n, vec3(0, 0, 1), vec3(cos(x.y), sin(x.y), 0.0), x.z);
}
"""


@pytest.mark.parametrize("tilt", [0.0, 0.4, 0.9, 1.4])
def test_slices_sectors_fill_the_hemisphere_as_the_cosine_says(gl, tilt):
    """Kernel histogram: with a density cosθ/π about the normal, sin²θ is uniform and so is the azimuth; no elevation is left
    out. Each sector's middle counts as its share of its slice's weight."""
    code = f"""{SLICE}
    vec4 evaluate(vec4 x)
    {{
        vec2 d = slice_middle(slice_of(x), int(x.w));
        vec3 world = vec3(cos(x.y) * d.y, sin(x.y) * d.y, d.x);
        vec3 local = vec3(cos(x.x) * world.x - sin(x.x) * world.z, world.y, sin(x.x) * world.x + cos(x.x) * world.z);
        return vec4(local, slice_of(x).weight);
    }}
    """
    phi, sector = np.meshgrid(np.pi * (np.arange(256) + 0.5) / 256, np.arange(32), indexing="ij")
    shift = np.repeat(np.random.default_rng(2).random(256) * 0.99, 32)
    x = np.c_[np.full(phi.size, tilt), phi.ravel(), shift, sector.ravel()]
    d = gl(evaluate, code, x, "engines/ssdo/slice_lib.glsl")
    for values in (d[:, 0] ** 2 + d[:, 1] ** 2, np.arctan2(d[:, 1], d[:, 0]) / (2 * np.pi) + 0.5):
        counts, _ = np.histogram(values, 8, (0.0, 1.0), weights=d[:, 3])
        assert np.abs(counts / (len(x) / 8) - 1).max() < 0.08


def test_slices_weigh_one_in_the_mean_and_their_sectors_tile(gl):
    """For any normal the mean of |n'| ∫ cos(θ − γ)|sin θ| dθ over slices is 1; and neighbouring intervals share no sector."""
    code = f"""{SLICE}
    vec4 evaluate(vec4 x)
    {{
        Slice slice = slice_of(x);
        vec2 d = vec2(cos(x.w), sin(x.w));
        uint a = sectors_between(slice, vec2(-slice.normal.y, slice.normal.x), d);
        uint b = sectors_between(slice, d, vec2(slice.normal.y, -slice.normal.x));
        return vec4(slice.weight, float(bitCount(a & b)), float(bitCount(a | b)), float(bitCount(a)));
    }}
    """
    rng = np.random.default_rng(1)
    tilts = np.repeat([0.0, 0.4, 0.9, 1.4], 512)
    phi = np.tile(np.pi * (np.arange(512) + 0.5) / 512, 4)
    theta = rng.uniform(-3.1, 3.1, 2048)
    out = gl(evaluate, code, np.c_[tilts, phi, rng.random(2048) * 0.99, theta], "engines/ssdo/slice_lib.glsl")
    for k in range(4):
        assert out[512 * k : 512 * (k + 1), 0].mean() == pytest.approx(1.0, abs=0.01)
    assert out[:, 1].max() == 0 and out[:, 2].min() == 32
    # What is behind the surface counts as the horizon of its own side, however far the normal leans over.
    assert (out[theta > np.pi / 2 + 1.4, 3] == 0).all() and (out[theta < -np.pi / 2 - 1.4, 3] == 32).all()


@pytest.mark.parametrize("shift", [-0.17, -0.13, 0.0, 0.3])
def test_a_pixel_at_the_foot_of_a_wall_gets_half_the_floors_light_wherever_it_is(gl, shift):
    """Planes meet between pixels: E/π goes to half the floor's radiance at the edge, be the pixel a hundredth of its own
    width above it. To 10 %: slices nearly along the edge leave the wall's row of pixels late, which costs 9 % there."""
    scene = scenes.corner()
    scene.camera = scenes.perspective((0.0, 3.0, 1.7), (0.0, 0.3, 0.35), 0.85)
    scene.camera.clip_from_view[1, 2] = 2.0 * shift / 36
    p = ssdo(scene, "Diffuse Indirect", "Normal", samples=1, resolution=(64, 36), gather_scale=1, use_ao=False).passes
    column = p["Diffuse Indirect"][:, 32, 0][p["Normal"][:, 32, 1] > 0.99]
    assert column[:2].max() == pytest.approx(0.5 * 0.8 * 5.0 / np.pi, rel=0.1)
    assert column[0] > 0.9 * column[1]


# --- stability ----------------------------------------------------------------------------------------------------------


def test_light_is_linear_in_power(gl):
    """Stability test 17: power × k scales every light pass by k, 1e-3; two lights are the sum of each."""
    names = ("Combined", "Diffuse Direct", "Diffuse Indirect")
    settings = {"samples": 2, "resolution": (64, 36)}
    a, b = (ssdo(scenes.cornell(power=p), *names, **settings).passes for p in (60.0, 60e3))
    for name in names:
        assert np.abs(a[name][..., :3] * 1e3 - b[name][..., :3]).max() <= 1e-3 * b[name][..., :3].max(), name
    lights = [scenes.point_light((-0.4, 0, 1.5), 40.0), scenes.spot_light((0.3, 0, 1.9), (0, 0, 0), 90.0, 1.4, 0.3)]

    def box(*chosen):
        scene = scenes.cornell(blocks=False)
        scene.lights = list(chosen)
        return ssdo(scene, "Diffuse Indirect", **settings).passes["Diffuse Indirect"]

    total = box(lights[0]) + box(lights[1])
    assert np.abs(box(*lights) - total).max() <= 1e-3 * total.max()


def test_the_same_input_gives_the_same_picture_bit_for_bit(gl):
    """Stability test 16."""
    scene = scenes.cornell()
    a, b = (ssdo(scene, "Combined", samples=2, bounces=2).passes["Combined"] for _ in range(2))
    assert np.array_equal(a, b)


def test_a_margin_brings_in_what_lies_just_outside(gl):
    """Stability test 9: the lit floor leaves the picture, and half of its light with it; with a margin it still counts."""
    whole = scenes.perspective((0, -4, 1.5), (0, 1, 0.5), 1.2)
    near = scenes.perspective((0, -4, 1.5), (0, 1, 0.9), 0.34)  # the wall's upper part

    def wall(camera, **settings):
        p = ssdo(corner(camera), "Diffuse Indirect", samples=8, **settings).passes["Diffuse Indirect"][..., 0]
        on, points = wall_points(camera, p.shape)
        inside = (np.abs(points[:, 0]) < 0.5) & (points[:, 2] > 0.75)
        return p[on][inside].mean()

    reference = wall(whole)
    without, with_margin = wall(near, ssdo__margin=0.0), wall(near, ssdo__margin=1.0)
    assert without < 0.6 * reference
    assert with_margin == pytest.approx(reference, rel=0.1)


def test_a_layer_behind_brings_in_what_something_hides(gl):
    """A black card before the lit floor hides it from the camera, not from the wall above: with two layers the wall has the
    floor's light by Lambert's polygon formula, 4 %; with one, what is hidden sends none."""
    camera = scenes.perspective((0, -3.2, 0.6), (0, 0.3, 0.6), 0.9)
    scene = corner(camera)
    b = scenes.SceneBuilder()
    card = np.array([[[-1.5, -1.02, -0.2], [1.5, -1.02, -0.2], [1.5, -1.02, 0.3], [-1.5, -1.02, 0.3]]])
    b.quads(card, scenes.diffuse((0,) * 3))
    b.quads(FLOOR[None], scenes.diffuse((0.8,) * 3))
    b.quads(np.array([[[-1, 1, 0], [1, 1, 0], [1, 1, 1], [-1, 1, 1]]]), scenes.diffuse((0.8,) * 3))
    b.light(scene.lights[0])
    scene = b.build(camera)

    def wall(layers):
        image = ssdo(scene, "Diffuse Indirect", samples=8, gather_scale=1, ssdo__layers=layers).passes["Diffuse Indirect"][..., 0]
        on, points = wall_points(camera, image.shape)
        seen = points[:, 2] > 0.55  # above the card, as the camera sees it
        expected = 0.8 * 5.0 / np.pi * polygon_irradiance(points, (0, -1, 0), FLOOR) / np.pi
        return image[on][seen].sum() / expected[seen].sum()

    one, two = wall(1), wall(2)
    assert one < 0.5
    assert two == pytest.approx(1.0, abs=0.04)


def settings_of(**values) -> Settings:
    settings = Settings()
    for path, value in {"technique": "SSDO", **values}.items():
        settings.set(path.replace("__", "."), value)
    return settings


def test_what_the_screen_knows_of_the_light_is_measured(gl):
    """In the sphere each sender counts by its flux: known is the share of the lit surface that the picture shows, and nothing is
    hidden. In the Cornell box a layer more knows more, and three with a margin know all but edges."""
    scene = scenes.integrating_sphere(light=(0.0, 0.8, 0.0))
    share = visible_light(scene, settings_of(ssdo__margin=0.0))
    assert share.known == pytest.approx(seen_share(scene.camera, sphere_hits((0.0, 0.8, 0.0))), abs=0.03)
    assert share.hidden < 0.01 and share.known + share.hidden + share.outside == pytest.approx(1.0)
    one, two, three = (visible_light(scenes.cornell(), settings_of(ssdo__layers=n)).known for n in (1, 2, 3))
    assert one + 0.1 < two < three - 0.05 and three > 0.97


def test_what_is_missing_of_the_light_is_what_the_screen_does_not_know(gl):
    """The black card of the layers' test: with one layer all of the wall's light is missing, and said to be."""
    camera = scenes.perspective((0, -3.2, 0.6), (0, 0.3, 0.6), 0.9)
    b = scenes.SceneBuilder()
    card = np.array([[[-1.5, -1.02, -0.2], [1.5, -1.02, -0.2], [1.5, -1.02, 0.3], [-1.5, -1.02, 0.3]]])
    b.quads(card, scenes.diffuse((0,) * 3))
    b.quads(FLOOR[None], scenes.diffuse((0.8,) * 3))
    b.quads(np.array([[[-1, 1, 0], [1, 1, 0], [1, 1, 1], [-1, 1, 1]]]), scenes.diffuse((0.8,) * 3))
    b.light(scenes.sun_light((0, 0, -1), 5.0))
    scene = b.build(camera)
    one, two = (visible_light(scene, settings_of(ssdo__layers=n)) for n in (1, 2))
    assert one.hidden > 0.95 and two.known > 0.95
    lines = light_unseen(scene, settings_of(ssdo__layers=1))
    assert lines[0] == one.text() and "ssdo.layers 3 it would be 0 %" in lines[1]


def test_layers_know_how_thick_a_box_is(gl):
    """With one layer the light around the boxes depends on how thick they are guessed to be; with two on nothing guessed."""
    def light(layers, thickness):
        return ssdo(scenes.cornell(), "Diffuse Indirect", samples=2, resolution=(64, 36), ssdo__layers=layers,
                    ssdo__thickness=thickness).passes["Diffuse Indirect"]  # fmt: skip

    apart = [np.abs(light(n, 0.02) - light(n, 1.0)).sum() / light(n, 0.02).sum() for n in (1, 2)]
    assert apart[0] > 0.02 and apart[1] < 0.002, apart


def test_one_layer_costs_nothing_of_the_others(gl):
    """No pass and no texture of layers behind, nor with indirect light switched off."""
    def titles(**values):
        settings = Settings()
        settings.set("technique", "SSDO")
        for path, value in values.items():
            settings.set(path.replace("__", "."), value)
        return [p.title for p in inspect(scenes.cornell(), settings, resolution=(64, 36)).run]

    assert not [t for t in titles(ssdo__layers=1) if "Layer" in t]
    assert not [t for t in titles(ssdo__layers=3, use_indirect_diffuse=False) if "Layer" in t]
    assert len([t for t in titles(ssdo__layers=3) if "Layer" in t]) == 6


def test_a_margin_leaves_the_picture_where_it_was(gl):
    """Direct light and depth are the same with and without one, to the rounding of a longer projection."""
    scene = scenes.cornell()
    a, b = (ssdo(scene, "Diffuse Direct", "Depth", samples=2, ssdo__margin=m).passes for m in (0.0, 0.2))
    assert a["Depth"].shape == b["Depth"].shape
    assert np.median(np.abs(a["Depth"] / b["Depth"] - 1)) < 1e-5
    assert np.mean(np.abs(a["Diffuse Direct"] - b["Diffuse Direct"])) < 0.01 * a["Diffuse Direct"].mean()


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_a_scene_in_millimetres_or_kilometres_looks_alike(gl, scale):
    """Stability test 12: lengths × s and power × s² leave radiance alone; relMSE ≤ 1e-4."""
    def box(s):
        scene = scenes.cornell(power=60.0 * s * s)
        scene.instances.matrix = np.diag([s, s, s, 1.0]) @ scene.instances.matrix
        for light in scene.lights:
            light.matrix = light.matrix.copy()
            light.matrix[:3, 3] *= s
        camera = scene.camera
        camera.world_from_view[:3, 3] *= s
        near, far = camera.clip_start * s, camera.clip_end * s
        camera.clip_from_view[2] = [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)]
        camera.clip_start, camera.clip_end = near, far
        scene.world.ao_distance *= s
        return ssdo(scene, "Combined", samples=2, resolution=(64, 36)).passes["Combined"][..., :3]

    one, other = box(1.0), box(scale)
    assert np.mean((other - one) ** 2 / (one**2 + (0.1 * one.mean()) ** 2)) <= 1e-4


def test_what_is_switched_off_does_not_run(gl):
    """Off costs nothing: without indirect light no pass of the technique is left."""
    settings = Settings()
    settings.set("technique", "SSDO")
    settings.set("use_indirect_diffuse", False)
    plan = inspect(scenes.cornell(), settings, resolution=(64, 36))
    assert not [p.title for p in plan.run if p.title.startswith("SSDO")]
    assert not [name for name in plan.resources if name.startswith("ssdo")]


def everything():
    """Gloss, glass, light below the surface, emission, air and a world."""
    scene = scenes.cornell()
    scene.materials[0] = scenes.principled(Base_Color=(*scenes.WHITE, 1), Roughness=0.3)
    scene.materials.append(scenes.principled(Transmission_Weight=0.8, Roughness=0.1))
    scene.materials.append(scenes.principled(Subsurface_Weight=1.0, Subsurface_Scale=0.1))
    scene.materials.append(scenes.emissive((1, 1, 1), 2.0))
    for k in range(3):
        scene.instances.materials[-1 - k] = (len(scene.materials) - 1 - k,)
    scene.world = scenes.world((0.3, 0.4, 0.5))
    return scene


@pytest.mark.parametrize(("switch", "passes"), [
    ("use_glossy", {"SSDO Reflections"}), ("use_translucency", {"SSDO Refraction", "SSDO Subsurface Scattering"}),
    ("use_ao", {"SSDO AO Generation"}), ("use_volumetric", {"SSDO Volumetric Light by Radial Blur"}),
    ("use_area_lights", set()),
])  # fmt: skip
def test_every_effect_goes_with_its_switch(gl, switch, passes):
    """Its passes run while it is on, and neither they nor their textures are there when it is off."""
    settings = Settings()
    for path, value in (("technique", "SSDO"), ("volume.density", 0.05), ("ssdo.volumetric", "RADIAL"),
                        ("ssdo.occlusion", "BITMASK"), ("ssdo.sources", "SCREEN")):  # fmt: skip
        settings.set(path, value)
    outputs = ("Combined", "Ambient Occlusion")
    on = inspect(everything(), settings, outputs, resolution=(64, 36))
    settings.set(switch, False)
    off = inspect(everything(), settings, outputs, resolution=(64, 36))
    assert passes <= {p.title for p in on.run}
    assert not passes & {p.title for p in off.run}
    assert off.nbytes() < on.nbytes() or not passes


@pytest.mark.parametrize("sources", ["MAPS", "SCREEN"])
def test_every_pass_is_finite_whatever_the_scene(gl, sources):
    """Stability test 18: everything at once, an empty scene, degenerate triangles, zero normals, a camera along a plane."""
    from gi_addon.outputs import OUTPUTS

    def check(scene):
        for name, image in ssdo(scene, *OUTPUTS, samples=1, resolution=(32, 18), bounces=2, ssdo__margin=0.1,
                                ssdo__sources=sources, ssdo__shadows="CONTACT", volume__density=0.05).passes.items():  # fmt: skip
            assert np.isfinite(image).all(), name

    check(everything())
    camera = scenes.perspective((0, -4, 0), (0, 0, 0), 0.8)  # looks along the floor
    check(scenes.SceneBuilder().build(camera, scenes.world((1, 1, 1))))
    mesh = scenes.mesh_from_quads(scenes.box_quads((-0.5, -0.5, 0), (0.5, 0.5, 1)))
    mesh.normals = np.zeros_like(mesh.normals)
    b = scenes.SceneBuilder()
    b.quads(FLOOR[None] * 2, scenes.diffuse((1, 1, 1)))
    b.add(mesh, scenes.principled(Metallic=0.5, Roughness=0.0))
    b.add(scenes.mesh_from_quads(np.zeros((1, 4, 3))), scenes.diffuse((1, 1, 1)))
    b.light(scenes.point_light((0.5, -0.5, 0.5), 10.0))  # on the box's edge
    check(b.build(camera, scenes.world((0.2, 0.2, 0.2))))
    check(b.build(scenes.orthographic((0, -4, 0), (0, 0, 0), 3.0), scenes.world((0.2, 0.2, 0.2))))


OTHER = {
    "ssdo.samples": 64, "ssdo.steps": 4, "ssdo.radius": 0.2, "ssdo.thickness": 0.02,
    "ssdo.margin": 0.0, "ssdo.sources": "SCREEN", "ssdo.occlusion": "BITMASK", "ssdo.shadows": "SCREEN",
    "ssdo.contact": 0.5, "ssdo.volumetric": "RADIAL", "ssdo.layers": 1,
}  # fmt: skip


@pytest.mark.parametrize("path", [p for p, _, _ in walk() if p.startswith("ssdo.")])
def test_every_setting_of_the_technique_changes_the_picture(gl, path):
    scene = scenes.cornell()
    scene.world = scenes.world((0.3, 0.4, 0.5))
    on = {"ssdo.volumetric": {"volume__density": 0.05}, "ssdo.contact": {"ssdo__shadows": "CONTACT"},
          "ssdo.thickness": {"ssdo__layers": 1}}.get(path, {})  # fmt: skip
    a, b = (
        ssdo(scene, "Combined", "Ambient Occlusion", samples=2, resolution=(64, 36), **on, **s).passes
        for s in ({}, {path.replace(".", "__"): OTHER[path]})
    )
    assert any(not np.array_equal(a[name], b[name]) for name in a)


# --- effects ------------------------------------------------------------------------------------------------------------


def mirror(roughness: float, **settings):
    """A mirror floor before a wall of even brightness: (reflected radiance, the wall's own), at pixels that reflect it."""
    b = scenes.SceneBuilder()
    b.quads(FLOOR[None], scenes.principled(Metallic=1.0, Roughness=roughness, Base_Color=(1, 1, 1, 1)))
    b.quads(np.array([[[-1, 1, 0], [1, 1, 0], [1, 1, 1], [-1, 1, 1]]]), scenes.diffuse((0.8,) * 3))
    b.light(scenes.sun_light((0, 1, -1), 5.0))
    scene = b.build(scenes.perspective((0, -3.2, 1.0), (0, 0.3, 0.4), 0.9))
    p = ssdo(scene, "Glossy Indirect", "Glossy Color", "Normal", samples=4, use_indirect_diffuse=False, **settings).passes
    lit = (p["Glossy Indirect"] * p["Glossy Color"])[..., 0]
    height, width = lit.shape
    inner = lit[height // 8 : height // 3, int(width * 0.4) : int(width * 0.6)]
    return inner, 0.8 * 5.0 / np.sqrt(2.0) / np.pi


def test_a_mirror_shows_the_wall_behind_it_as_bright_as_it_is(gl):
    """What a perfect mirror reflects is the wall's own radiance, ρ E/π, at every pixel that reflects it."""
    seen, wall = mirror(0.0)
    assert seen == pytest.approx(np.full_like(seen, wall), rel=0.01)


def test_a_mirror_shows_the_wall_down_to_its_foot(gl):
    """In the last pixels of the floor the ray is behind the wall's plane as soon as it enters the wall's pixel: it met it within
    one, and does not pass behind it."""
    b = scenes.SceneBuilder()
    b.quads(FLOOR[None], scenes.principled(Metallic=1.0, Roughness=0.0, Base_Color=(1, 1, 1, 1)))
    b.quads(np.array([[[-1, 1, 0], [1, 1, 0], [1, 1, 1], [-1, 1, 1]]]), scenes.diffuse((0.8,) * 3))
    b.light(scenes.sun_light((0, 1, -1), 5.0))
    scene = b.build(scenes.perspective((0, -3.2, 1.0), (0, 0.3, 0.4), 0.9))
    p = ssdo(scene, "Glossy Indirect", "Glossy Color", "Normal", samples=1, use_indirect_diffuse=False).passes
    lit = (p["Glossy Indirect"] * p["Glossy Color"])[..., 0]
    floor = p["Normal"][..., 2] > 0.99
    foot = (floor & ~np.roll(floor, -1, axis=0))[:, 30:66]  # row 0 at the bottom: the floor's highest pixels
    assert foot.sum() >= 30
    assert lit[:, 30:66][foot] == pytest.approx(0.8 * 5.0 / np.sqrt(2.0) / np.pi, rel=0.02)


def test_a_mirror_shows_a_lamps_light_where_it_falls(gl):
    """A lamp near a wall lights it ever less from pixel to pixel. What the mirror floor shows of each point is that point's
    own ρ E/π, not the nearest pixel's."""
    b = scenes.SceneBuilder()
    b.quads(FLOOR[None], scenes.principled(Metallic=1.0, Roughness=0.0, Base_Color=(1, 1, 1, 1)))
    wall, across, up = np.array([-1.0, 1.0, 0.0]), np.array([2.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    b.quads(np.array([[wall, wall + across, wall + across + up, wall + up]]), scenes.diffuse((0.8,) * 3))
    lamp, power = np.array([0.1, 0.8, 0.4]), 10.0
    b.light(scenes.point_light(tuple(lamp), power))
    scene = b.build(scenes.perspective((0, -3.2, 1.0), (0, 0.3, 0.4), 0.9))
    p = ssdo(scene, "Glossy Indirect", "Glossy Color", samples=1, use_indirect_diffuse=False, use_shadows=False).passes
    lit = (p["Glossy Indirect"] * p["Glossy Color"])[..., 0]
    eye, d = camera_rays(scene.camera, lit.shape[::-1])
    t, _, _ = hits(eye, d, FLOOR[0], FLOOR[1] - FLOOR[0], FLOOR[3] - FLOOR[0])
    at = eye + np.where(np.isfinite(t), t, 0.0)[..., None] * d
    s, u, v = hits(at, d * [1, 1, -1], wall, across, up)
    inside = np.isfinite(t) & np.isfinite(s) & (np.abs(u - 0.5) < 0.45) & (v > 0.05) & (v < 0.9)
    assert inside.sum() > 100
    to_lamp = lamp - (wall + u[..., None] * across + v[..., None] * up)
    d2 = (to_lamp**2).sum(-1)
    exact = 0.8 / np.pi * power / (4.0 * np.pi) * -to_lamp[..., 1] / d2**1.5
    # At the last pixels of the wall's foot a ray may end a pixel early.
    assert np.quantile(np.abs(lit[inside] / exact[inside] - 1.0), 0.99) < 0.02


def test_a_mirrored_sheet_is_as_wide_as_it_is(gl):
    """Rays that run along a sheet's edge pass behind it, as near as they do: what a mirror floor shows of two narrow sheets has
    the area of the exact picture, 3 %."""
    b = scenes.SceneBuilder()
    b.quads(FLOOR[None], scenes.principled(Metallic=1.0, Roughness=0.0, Base_Color=(1, 1, 1, 1)))
    sheets = [np.array([-0.9, 0.5, 0.0]), np.array([0.6, 0.7, 0.0])]
    across, up = np.array([0.1, 0.0, 0.0]), np.array([0.0, 0.0, 1.2])
    for corner_ in sheets:
        b.quads(np.array([[corner_, corner_ + across, corner_ + across + up, corner_ + up]]), scenes.diffuse((0.8,) * 3))
    b.light(scenes.sun_light((0, 1, 0), 5.0))
    scene = b.build(scenes.perspective((-0.3, -3.2, 1.4), (0, 0.3, 0.4), 0.9))
    p = ssdo(scene, "Glossy Indirect", "Glossy Color", samples=16).passes
    light = (p["Glossy Indirect"] * p["Glossy Color"])[..., 0]
    fine = (8 * light.shape[1], 8 * light.shape[0])
    eye, d = camera_rays(scene.camera, fine)
    t, _, _ = hits(eye, d, FLOOR[0], FLOOR[1] - FLOOR[0], FLOOR[3] - FLOOR[0])
    near = [hits(eye, d, c, across, up)[0] for c in sheets]
    seen = np.isfinite(t) & (t < np.minimum(*near))
    at, mirrored_way = eye + np.where(seen, t, 0.0)[..., None] * d, d * [1, 1, -1]
    shown = seen & np.any([np.isfinite(hits(at, mirrored_way, c, across, up)[0]) for c in sheets], axis=0)
    assert light.mean() / (0.8 * 5.0 / np.pi) == pytest.approx(shown.mean(), rel=0.03)


@pytest.mark.parametrize("gathered", [True, False])
def test_a_mirror_behind_a_box_shows_its_back(gl, gathered):
    """The second layer is what the mirror sees and the eye does not: the back's own radiance, ρ E/π, 1 %, at every pixel that
    mirrors it, with or without the gather."""
    b = scenes.SceneBuilder()
    glass, across, up = np.array([-2.0, 1.0, 0.0]), np.array([4.0, 0.0, 0.0]), np.array([0.0, 0.0, 2.0])
    b.quads(np.array([[glass, glass + across, glass + across + up, glass + up]]),
            scenes.principled(Metallic=1.0, Roughness=0.0, Base_Color=(1, 1, 1, 1)))  # fmt: skip
    b.quads(scenes.box_quads((-0.8, -0.6, 0.0), (0.8, -0.2, 1.0)), scenes.diffuse((0.8,) * 3))
    b.light(scenes.sun_light((0, -1, -2.2), 5.0))
    scene = b.build(scenes.perspective((0, -3.2, 2.2), (0, 0.3, 0.9), 0.9))

    def shown():
        p = ssdo(scene, "Glossy Indirect", "Glossy Color", "Depth", samples=1, use_indirect_diffuse=gathered).passes
        light, depth = (p["Glossy Indirect"] * p["Glossy Color"])[..., 0], p["Depth"][..., 0]
        eye, d = camera_rays(scene.camera, light.shape[::-1])
        t, _, _ = hits(eye, d, glass, across, up)
        at = eye + np.where(np.isfinite(t), t, 0.0)[..., None] * d
        _, x, z = hits(at, d * [1, -1, 1], np.array([-0.8, -0.2, 0.0]), np.array([1.6, 0, 0]), np.array([0, 0, 1.0]))
        # A sub-frame's pixels are half a pixel off: none at the edges of what is mirrored.
        inside = (np.abs(x - 0.5) < 0.45) & (np.abs(z - 0.5) < 0.4) & (depth > 4.0) & np.isfinite(t)
        assert inside.sum() > 100
        return light[inside]

    radiance, back = 0.8 * 5.0 / np.hypot(1.0, 2.2) / np.pi, shown()
    assert back == pytest.approx(np.full_like(back, radiance), rel=0.01)


def test_a_rough_mirror_reflects_less_of_a_small_wall(gl):
    """A wide lobe looks past the wall: dimmer, not darker than half; and off is off."""
    seen, wall = mirror(0.35)
    assert 0.4 * wall < seen.mean() < 0.95 * wall
    seen, _ = mirror(0.0, use_glossy=False)
    assert seen.max() == 0.0


def test_the_world_is_in_the_mirror_where_rays_find_nothing(gl):
    """With the world taken from the screen, a mirror under it shows its radiance: Glossy Direct, as in Cycles."""
    b = scenes.SceneBuilder()
    b.quads(FLOOR[None] * 3, scenes.principled(Metallic=1.0, Roughness=0.0, Base_Color=(1, 1, 1, 1)))
    scene = b.build(scenes.perspective((0, -3, 2), (0, 0, 0), 0.8), scenes.world((0.5, 0.6, 0.7)))
    p = ssdo(scene, "Glossy Direct", "Glossy Color", "Depth", samples=1, ssdo__sources="SCREEN").passes
    seen = p["Depth"][..., 0] < 1e9
    light = (p["Glossy Direct"] * p["Glossy Color"])[seen]
    assert light.mean(axis=0) == pytest.approx(np.array([0.5, 0.6, 0.7]), rel=0.01)


def occluder(**settings):
    """A slab above a floor under a sun: Shadow (H, W) and the scene's settings."""
    b = scenes.SceneBuilder()
    b.quads(FLOOR[None], scenes.diffuse((0.8,) * 3))
    b.quads(scenes.box_quads((-0.3, -0.3, 0.0), (0.3, 0.3, 0.5)), scenes.diffuse((0.8,) * 3))
    b.light(scenes.sun_light((0.7, 0.3, -1), 5.0))
    return ssdo(b.build(scenes.perspective((0, -3.2, 2.4), (0, 0, 0.2), 0.8)), "Diffuse Direct", samples=4, **settings)


def test_screen_rays_throw_the_shadow_that_the_map_throws(gl):
    """An occluder wholly on the screen: the two agree but for its rim and the side that the camera does not see."""
    by_map, by_rays = (occluder(ssdo__shadows=s).passes["Diffuse Direct"][..., 0] for s in ("MAPS", "SCREEN"))
    dark = by_map < 0.1 * by_map.max()
    agree = (by_rays < 0.5 * by_map.max()) == (by_map < 0.5 * by_map.max())
    assert dark.sum() > 50 and agree.mean() > 0.95


def test_screen_shadows_need_no_shadow_map_and_contacts_mend_a_coarse_one(gl):
    """Of a map of 64 texels short rays over it leave less error against one of 1024; they only ever darken."""
    assert "Shadow Maps" not in [p.title for p in occluder(ssdo__shadows="SCREEN").plan.run]
    b = scenes.SceneBuilder()
    post = scenes.box_quads((-0.03, -0.03, 0.0), (0.03, 0.03, 0.3))  # half a texel thick
    # One mesh: a floor by itself would be a backdrop, and the post have a map of its own (gi_addon/focus.py).
    b.quads(np.concatenate([FLOOR[None] * 4, post]), scenes.diffuse((0.8,) * 3))
    b.light(scenes.sun_light((0.7, 0.3, -1), 5.0))
    scene = b.build(scenes.perspective((0, -1.2, 0.9), (0, 0, 0.1), 0.7))
    coarse = {"shadows__resolution": 64, "ssdo__contact": 0.1, "samples": 4}
    fine = ssdo(scene, "Diffuse Direct", samples=4).passes["Diffuse Direct"]
    maps, contacts = (ssdo(scene, "Diffuse Direct", ssdo__shadows=s, **coarse).passes["Diffuse Direct"]
                      for s in ("MAPS", "CONTACT"))  # fmt: skip
    assert (contacts <= maps + 1e-6).all()
    assert np.square(contacts - fine).mean() < 0.9 * np.square(maps - fine).mean()


def glass(ior: float, **settings):
    """A pane of glass before a wall whose right half is dark."""
    b = scenes.SceneBuilder()
    for x0, x1, color in ((-3, 0, 0.8), (0, 3, 0.0)):
        b.quads(np.array([[[x0, 1, -2], [x1, 1, -2], [x1, 1, 2], [x0, 1, 2]]]), scenes.diffuse((color,) * 3))
    b.quads(scenes.box_quads((-1, -0.5, -0.6), (1, 0.0, 0.6)),
            scenes.principled(Transmission_Weight=1.0, Roughness=0.0, IOR=ior, Base_Color=(1, 1, 1, 1)))  # fmt: skip
    b.light(scenes.sun_light((0, 1, -3), 5.0))  # steep: the pane's own shadow falls below the picture
    scene = b.build(scenes.perspective((-1.2, -3.5, 0), (-0.1, 0, 0), 0.55))
    return ssdo(scene, "Transmission Indirect", "Transmission Color", samples=1, use_indirect_diffuse=False, resolution=(160, 90),
                **settings).passes  # fmt: skip


def test_a_pane_moves_what_is_behind_it_by_snells_law(gl):
    """A plane-parallel pane of depth D shifts the ray sideways by D (tan θ − tan θ'), sin θ = n sin θ': so the wall's edge
    moves by that much of a pixel count in the picture; with n = 1 not at all."""
    def edge(ior):
        p = glass(ior)
        row = (p["Transmission Indirect"] * p["Transmission Color"])[45, :, 0]
        lit = np.flatnonzero(row > 0.5 * row.max())
        return lit.max()

    eye, wall = np.array([-1.2, -3.5]), np.array([0.0, 1.0])
    # The ray that reaches the edge enters the pane's face at y = −0.5; n = 1.5.
    tan = (wall[0] - eye[0]) / (wall[1] - eye[1])
    for _ in range(50):
        sin = tan / np.hypot(1.0, tan) / 1.5
        tan = (wall[0] - eye[0] - 0.5 * sin / np.sqrt(1 - sin * sin)) / (wall[1] - eye[1] - 0.5)
    forward = np.arctan2(1.1, 3.5)
    to_pixel = 160 / (2 * np.tan(0.275))
    moved = (np.tan(np.arctan(tan) - forward) - np.tan(np.arctan(1.2 / 4.5) - forward)) * to_pixel
    assert edge(1.5) - edge(1.0001) == pytest.approx(moved, abs=1.6)
    assert abs(moved) > 2


def test_light_below_the_surface_crosses_a_shadows_edge_and_keeps_its_sum(gl):
    """A half-lit wall that scatters over 0.1 m: light where the shadow is, and as much missing before it."""
    def wall(weight):
        b = scenes.SceneBuilder()
        b.quads(np.array([[[-2, 1, -2], [2, 1, -2], [2, 1, 2], [-2, 1, 2]]]),
                scenes.principled(Base_Color=(0.8, 0.8, 0.8, 1), Subsurface_Weight=weight, Subsurface_Scale=0.1,
                                  Subsurface_Radius=(1.0, 1.0, 1.0)))  # fmt: skip
        b.quads(np.array([[[0, -3, -2], [3, -3, -2], [3, -3, 2], [0, -3, 2]]]), scenes.diffuse((0.5,) * 3), visibility=32)
        b.light(scenes.sun_light((0, 1, 0), 5.0))
        scene = b.build(scenes.perspective((0, -2.5, 0), (0, 0, 0), 0.5))
        return ssdo(scene, "Diffuse Direct", samples=8, use_indirect_diffuse=False).passes["Diffuse Direct"][..., 0]

    hard, soft = wall(0.0), wall(1.0)
    middle = hard.shape[1] // 2
    dark = slice(middle + 2, middle + 6)
    assert hard[:, dark].max() < 0.05 * hard.max()
    assert soft[:, dark].mean() > 0.1 * hard.max()
    assert soft.mean() == pytest.approx(hard.mean(), rel=0.03)


def test_radial_blur_shows_beams_of_a_light_in_the_picture_and_says_when_it_is_not(gl):
    b = scenes.SceneBuilder()
    b.quads(np.array([[[-3, 2, -2], [3, 2, -2], [3, 2, 2], [-3, 2, 2]]]), scenes.diffuse((0.1,) * 3))
    b.quads(scenes.box_quads((0.5, -0.3, -0.3), (0.9, 0.1, 0.3)), scenes.diffuse((0.1,) * 3))
    b.light(scenes.point_light((0, 0.5, 0), 50.0))
    scene = b.build(scenes.perspective((0, -4, 0), (0, 0, 0), 0.8))
    radial, march = (
        ssdo(scene, "Volume Direct", samples=4, volume__density=0.1, ssdo__volumetric=v) for v in ("RADIAL", "MARCH")
    )
    a, c = radial.passes["Volume Direct"][..., 0], march.passes["Volume Direct"][..., 0]
    # Left of the lamp nothing is in the way: the same light. Right of the box, its shadow.
    assert a[:, :40].mean() == pytest.approx(c[:, :40].mean(), rel=0.05)
    assert a[27, 80:].mean() < 0.75 * a[27, :16].mean()
    assert not [n for n in radial.notes if "radial blur" in n]
    scene.lights = [scenes.point_light((0, -6, 0), 50.0)]
    result = ssdo(scene, "Volume Direct", samples=1, volume__density=0.1, ssdo__volumetric="RADIAL")
    assert [n for n in result.notes if "outside the picture" in n]
    assert result.passes["Volume Direct"].max() == 0.0
