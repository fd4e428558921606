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
