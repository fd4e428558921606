# SPDX-License-Identifier: GPL-3.0-or-later
"""A frame as a job: cancelled on the way, and scenes that nobody made for the tests."""

from __future__ import annotations

from dataclasses import replace

import moderngl
import numpy as np
import pytest

from gi_addon.compare import scenes
from gi_addon.gl import CancelToken
from gi_addon.gl.errors import Cancelled
from gi_addon.renderer import Renderer, render
from gi_addon.scene import Instances
from gi_addon.settings import Settings


def test_a_cancelled_frame_stops_after_the_subframe_and_the_renderer_stays_usable(gl):
    settings = Settings()
    settings.samples = 64
    token, seen = CancelToken(), []

    def progress(share: float, text: str) -> None:
        seen.append(share)
        if len(seen) == 2:
            token.cancel()

    def job(g):
        renderer = Renderer(g)
        try:
            with pytest.raises(Cancelled):
                renderer.render(
                    scenes.cornell(), settings, ("Combined",), resolution=(48, 27), progress=progress, cancel=token
                )
            settings.samples = 2
            return renderer.render(scenes.cornell(), settings, ("Combined",), resolution=(48, 27)).passes["Combined"]
        finally:
            renderer.close()

    after = gl(job)
    assert len(seen) == 2
    fresh = render(scenes.cornell(), settings, ("Combined",), resolution=(48, 27)).passes["Combined"]
    np.testing.assert_array_equal(after, fresh)


@pytest.mark.parametrize(("lights", "words"), [(True, set()), (False, {"nothing gives light"})])
def test_a_black_picture_is_explained(gl, lights, words):
    """A scene that nothing lights says so, and one that shows no surface; a lit one says nothing."""
    settings = Settings()
    settings.samples = 1
    scene = scenes.cornell()
    if not lights:
        scene = replace(scene, lights=[])
    notes = render(scene, settings, resolution=(16, 9)).notes
    assert {w for w in ("nothing gives light", "no surface") if any(w in n for n in notes)} == words
    empty = replace(scene, meshes=[], instances=Instances.make([], [], []))
    assert any("no surface" in n for n in render(empty, settings, resolution=(16, 9)).notes)


def test_changes_leave_no_vertex_arrays_behind(gl, monkeypatch):
    """New meshes, transforms and materials ten times over: as many vertex arrays as after the second time, none after
    closing. moderngl frees only what is released by hand."""
    made = []

    def recorded(self, *args, **kwargs):
        made.append(original(self, *args, **kwargs))
        return made[-1]

    original = moderngl.Context.vertex_array
    monkeypatch.setattr(moderngl.Context, "vertex_array", recorded)

    def alive() -> int:
        return sum(not isinstance(vao.mglo, moderngl.InvalidObject) for vao in made)

    def job(g):
        renderer, counts = Renderer(g), []
        settings = Settings()
        settings.samples = 1
        for _ in range(10):
            renderer.begin(scenes.cornell(), settings, resolution=(16, 9))
            renderer.subframe(0)
            counts.append(alive())
        renderer.close()
        return [*counts, alive()]

    counts = gl(job)
    assert counts[1] > 0 and len(set(counts[1:10])) == 1 and counts[10] == 0


def _changes():
    """(name, scene, camera, resolution) one after the other, each one change away from the one before. Every kind of light
    whose maps follow the sub-frame shines: an area light, a soft spot, the sky."""
    box = scenes.cornell()
    size = (32, 18)
    lights = [scenes.area_light((0.3, 0.2, 0.9), (0.0, 0.0, -1.0), 10.0, (0.3, 0.3)),
              scenes.spot_light((-0.5, -0.6, 0.8), (0.0, 0.3, -1.0), 30.0, 1.2, 0.3, radius=0.1)]  # fmt: skip
    base = replace(box, lights=lights, world=scenes.world((0.4, 0.5, 0.7)))
    turned = replace(base.camera, world_from_view=base.camera.world_from_view @ _turn(0.05))
    brighter = replace(base, lights=[lights[0], replace(lights[1], emission=lights[1].emission * 2.0)])
    lifted = lights[1].matrix.copy()
    lifted[2, 3] -= 0.2
    moved = replace(brighter, lights=[lights[0], replace(brighter.lights[1], matrix=lifted)])
    fewer = replace(moved, lights=moved.lights[1:])
    instances = Instances.make([*fewer.instances.mesh], [*fewer.instances.matrix], [*fewer.instances.materials])
    instances.matrix[-1][0, 3] += 0.1
    return [("first", base, base.camera, size), ("turned", base, turned, size), ("larger", base, turned, (48, 27)),
            ("brighter", brighter, turned, (48, 27)), ("light moved", moved, turned, (48, 27)),
            ("light gone", fewer, turned, (48, 27)), ("object moved", replace(fewer, instances=instances), turned, (48, 27)),
            ]  # fmt: skip


def _turn(angle: float) -> np.ndarray:
    out = np.eye(4)
    out[0, 0] = out[2, 2] = np.cos(angle)
    out[0, 2], out[2, 0] = np.sin(angle), -np.sin(angle)
    return out


@pytest.mark.parametrize("technique", ["RSM", "LPV", "VCT", "SSDO"])
def test_what_is_kept_between_changes_is_what_would_be_made_again(gl, technique):
    """First sub-frames after one change each, in one renderer that keeps what it can, and in a new one each: bit-identical."""
    settings = Settings()
    settings.technique, settings.samples = technique, 4
    settings.rsm.resolution, settings.shadows.resolution = 64, 64
    # Which directions the sky's light is drawn by is a matter of noise, and kept when the picture grows.
    settings.world.aimed = False
    settings.lpv.resolution, settings.vct.resolution = 16, 32

    def first(renderer, scene, camera, size):
        renderer.begin(scene, settings, resolution=size, camera=camera)
        renderer.subframe(0)
        return renderer.film()["combined"]

    def job(g):
        kept = Renderer(g)
        try:
            for name, *change in _changes():
                picture, fresh = first(kept, *change), Renderer(g)
                try:
                    yield name, picture, first(fresh, *change)
                finally:
                    fresh.close()
        finally:
            kept.close()

    for name, picture, fresh in gl(lambda g: list(job(g))):
        assert picture.max() > 0.0
        assert np.array_equal(picture, fresh), name


@pytest.fixture
def drawn(monkeypatch):
    """How many tiles of light maps each draw was of."""
    from gi_addon.passes import lights

    counts = []
    draw = lights._draw_tiles

    def counted(*args, tiles, **kwargs):
        counts.append(len(tiles))
        return draw(*args, tiles=tiles, **kwargs)

    monkeypatch.setattr(lights, "_draw_tiles", counted)
    return counts


def test_while_the_view_moves_the_skys_directions_stay_and_so_do_their_maps(gl, drawn):
    """Directions are aimed at what the camera sees: a turned view aims them anew, and draws their maps; a moving one does not,
    and the first frame at rest does."""
    settings = Settings()
    settings.samples = 4
    settings.rsm.resolution = settings.shadows.resolution = settings.world.resolution = 64
    scene = replace(scenes.cornell(), world=scenes.world((0.4, 0.5, 0.7)))
    turned = replace(scene.camera, world_from_view=scene.camera.world_from_view @ _turn(0.4))
    def job(g):
        renderer, counts = Renderer(g), []
        try:
            for camera, moving in ((scene.camera, True), (turned, True), (turned, False)):
                drawn.clear()
                renderer.begin(scene, settings, resolution=(32, 18), camera=camera, moving=moving)
                renderer.subframe(0)
                counts.append(sum(drawn))
            return counts
        finally:
            renderer.close()

    first, moving, rest = gl(job)
    assert first > rest > moving == 0


def test_light_maps_are_drawn_where_a_light_moved_and_nowhere_else(gl, drawn):
    """Tiles drawn for each change: none when the camera turns, the picture grows or a lamp's power changes; the moved lamp's own;
    all when a surface moves."""
    settings = Settings()
    settings.samples = 4
    settings.rsm.resolution, settings.shadows.resolution = 64, 64
    def job(g):
        renderer, counts = Renderer(g), {}
        try:
            for name, scene, camera, size in _changes():
                drawn.clear()
                renderer.begin(replace(scene, world=scenes.world()), settings, resolution=size, camera=camera)
                renderer.subframe(0)
                counts[name] = sum(drawn)
            return counts
        finally:
            renderer.close()

    counts = gl(job)
    assert counts["turned"] == counts["larger"] == counts["brighter"] == 0
    # The spot's shadow map and bounce map.
    assert counts["light moved"] == 2
    assert counts["first"] > counts["object moved"] == 2


@pytest.mark.blender
@pytest.mark.parametrize("name", ["sponza/sponza_crytek", "living_room_bitterli/living_room"])
def test_real_scenes_render_finite_and_lit(blender, gl, shared_scenes, name):
    path = shared_scenes / f"{name}.blend"
    if not path.is_file():
        pytest.skip(f"{path.name} is not here")
    from gi_addon.host import files
    from gi_addon.host.cycles import render_passes

    scene, _ = files.load(path)
    scene.render.engine = "QUARTET"
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 96, 54, 100
    scene.quartet.samples = 1
    for image in render_passes(scene, ("Combined", "Diffuse Indirect")).values():
        assert np.isfinite(image).all()
        assert (image[..., :3].max(axis=-1) > 1e-4).mean() > 0.5
    blender.ops.wm.read_factory_settings(use_empty=True)
