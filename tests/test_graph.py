# SPDX-License-Identifier: GPL-3.0-or-later
"""The planner, and the smallest engine that works: the template for a new technique."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import PICTURE

from gi_addon.compare import scenes
from gi_addon.engines import TECHNIQUES
from gi_addon.gl import shared
from gi_addon.gl.context import GL
from gi_addon.graph import Optional, Pass, Texture, Uniform, plan
from gi_addon.passes.gbuffer import GBuffer
from gi_addon.passes.resolve import Resolve
from gi_addon.renderer import Renderer, inspect, render
from gi_addon.settings import Settings


class _Made(Pass):
    def __init__(self, title, reads, writes, absent=None, rate="subframe"):
        self.title, self.reads, self._absent, self._rate = title, reads, absent, rate
        self.writes = tuple(
            Texture(w, w.replace(".", "_"), "a texture of the test", "r32f", lambda f: (4, 4)) for w in writes
        )

    def absent(self, facts):
        return self._absent

    def rate(self, facts):
        return self._rate


def test_only_what_leads_to_an_output_runs():
    p = plan([_Made("a", (), ("x",)), _Made("b", (), ("y",)), _Made("c", ("x",), ("z",))], None, {"z": "test"})
    assert [q.title for q in p.run] == ["a", "c"]
    assert [(t.title, r) for t, r in p.skipped] == [("b", "nothing that runs reads y")]
    assert set(p.resources) == {"x", "z"}
    assert p.run[0].reason == "c reads x" and p.run[1].reason == "for test"


def test_absence_spreads_to_those_who_must_read_and_stops_at_those_who_may():
    tasks = [
        _Made("a", (), ("x",), absent="no light"),
        _Made("b", ("x",), ("y",)),
        _Made("c", (Optional("y"), Optional("x")), ("z",)),
    ]
    p = plan(tasks, None, {"z": "test"})
    assert [q.title for q in p.run] == ["c"]
    assert {t.title: r for t, r in p.skipped} == {"a": "no light", "b": "needs x: no light"}
    assert p.run[0].defines() == {"HAS_X": 0, "HAS_Y": 0, "HAS_Z": 1}


def test_a_texture_that_nobody_reads_is_not_allocated():
    p = plan([_Made("a", (), ("x", "unread")), _Made("b", ("x",), ("z",))], None, {"z": "test"})
    assert "unread" not in p.resources
    assert ("unread", "nothing that runs reads it") in p.unallocated


def test_a_read_for_one_output_only_comes_with_that_output():
    tasks = [_Made("a", (), ("x",)), _Made("b", (Optional("x", ("gloss",)),), ("diffuse", "gloss"))]
    assert [q.title for q in plan(tasks, None, {"diffuse": "t"}).run] == ["b"]
    assert [q.title for q in plan(tasks, None, {"gloss": "t"}).run] == ["a", "b"]


def test_a_pass_that_reads_the_unknown_is_a_programming_error():
    with pytest.raises(ValueError, match="no earlier pass writes"):
        plan([_Made("a", ("nothing",), ("x",))], None, {"x": "t"})
    with pytest.raises(ValueError, match="no pass writes"):
        plan([_Made("a", (), ("x",))], None, {"y": "t"})


def test_inspect_says_what_runs_why_and_how_large():
    p = inspect(scenes.cornell(), resolution=(640, 360))
    text = p.text()
    assert "RSM Generation" in text and "MiB" in text and "left out" in text
    assert "640×360" in text and "because" not in text
    dot = p.graph_text()
    assert dot.startswith("digraph") and '"RSM Generation" -> "RSM Flux"' in dot
    assert p.nbytes() == sum(r.nbytes(p.facts) for r in p.resources.values())


def test_an_unlit_scene_plans_no_light():
    scene = scenes.cornell()
    scene.lights = []
    p = inspect(scene, resolution=(64, 36))
    assert not {"Shadow Maps", "RSM Generation", "Direct Lighting Computation"} & {q.title for q in p.run}
    assert any("no light shines" in reason for _, reason in p.skipped)


# --- the template -----------------------------------------------------------------------------------------------------


class FlatAmbient(Pass):
    """The smallest technique: indirect light is one colour. A pass is its table, a shader and a run()."""

    title = "Flat Ambient"
    reads = ("gbuffer.depth",)
    writes = (
        Texture("indirect.diffuse", "indirect_diffuse", "radiance a white Lambert surface would reflect, W/(m²·sr)",
                "rgba32f", lambda f: f.resolution),
    )  # fmt: skip
    uniforms = (Uniform("ambient", "vec3", "the colour, W/(m²·sr)"),)
    shaders = {"main": {"vertex": "passes/fullscreen_vert.glsl", "fragment": "flat_ambient_frag.glsl"}}

    def run(self, frame, planned):
        program = frame.program(planned, virtual={"flat_ambient_frag.glsl": (
            "void main() { indirect_diffuse = vec4(ambient, 1.0); }"
        )})  # fmt: skip
        frame.set(program, ambient=(0.25, 0.5, 1.0))
        frame.screen(planned, program)


def flat_ambient(settings, layers):
    return [GBuffer(), FlatAmbient(), Resolve(layers)]


def test_a_new_technique_is_a_list_of_passes(gl, monkeypatch):
    monkeypatch.setitem(TECHNIQUES, "RSM", flat_ambient)
    scene = scenes.cornell(blocks=False)
    passes = render(scene, Settings(), ("Diffuse Indirect", "Diffuse Color"), resolution=PICTURE).passes
    lit = passes["Diffuse Color"][..., 0] > 0
    np.testing.assert_allclose(passes["Diffuse Indirect"][lit], np.tile((0.25, 0.5, 1.0), (lit.sum(), 1)), rtol=1e-5)


# --- what a second frame costs ----------------------------------------------------------------------------------------


def _titles_run(renderer: Renderer, scene, settings, **options) -> list[str]:
    result = renderer.render(scene, settings, ("Combined",), resolution=PICTURE, timed=True, **options)
    return list(result.milliseconds)


def test_a_second_frame_redoes_only_what_changed(gl):
    """Maps stay while only the camera moves; a moved light redoes its maps; nothing is compiled again."""
    scene, settings = scenes.cornell(), Settings()
    settings.samples = 1

    def job(g: GL):
        renderer = Renderer(g)
        first = _titles_run(renderer, scene, settings)
        compiled = g.compiled
        scene.camera = scenes.perspective((0.1, -4.2, 1.0), (0, 0, 1.0), 0.85)
        camera = _titles_run(renderer, scene, settings)
        scene.lights[0].matrix = scenes.look_at((0.2, 0, 1.98), (0.2, 0, 0))
        light = _titles_run(renderer, scene, settings)
        after = g.compiled
        renderer.close()
        return first, camera, light, compiled, after

    first, camera, light, compiled, after = shared().call(job)
    maps = {"Shadow Maps", "RSM Generation", "RSM Flux"}
    assert maps <= set(first) and maps <= set(light)
    assert not maps & set(camera)
    assert compiled == after


def test_uploads_follow_the_stamps(gl):
    scene, settings = scenes.cornell(), Settings()
    settings.samples = 1

    def job(g: GL):
        renderer = Renderer(g)
        seen = []
        for change in (lambda: None, lambda: None, lambda: scene.instances.matrix.__setitem__((0, 0, 3), 0.01)):
            change()
            renderer.render(scene, settings, ("Combined",), resolution=PICTURE)
            seen.append(dict(renderer.gpu.uploads))
        renderer.close()
        return seen

    first, same, moved = shared().call(job)
    assert "meshes" in first and "materials" in first
    assert same == {}
    assert set(moved) == {"transforms"}


def test_closing_a_renderer_frees_all_its_memory(gl):
    def job(g: GL):
        before = g.bytes()
        for _ in range(3):
            renderer = Renderer(g)
            renderer.render(scenes.cornell(), Settings(), ("Combined",), resolution=PICTURE, subframes=1)
            renderer.close()
        return before, g.bytes()

    before, after = shared().call(job)
    assert after == before
