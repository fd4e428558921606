# SPDX-License-Identifier: GPL-3.0-or-later
"""The stability suite, and proof that it can tell good from bad. The fast tests run here for every technique."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner

from gi_addon.compare import scenes, stability, stability_checks  # noqa: F401 — the last fills the registry
from gi_addon.compare.closed_forms import camera_rays, hits, polygon_form_factor, visible_share
from gi_addon.compare.stability import ERROR, FAIL, KNOWN, NATURE, PASS, TESTS, Finding, Quantity, Suite, at_most, run_one
from gi_addon.compare.studio import without_pass
from gi_addon.engines import TECHNIQUES


@pytest.fixture(scope="module", params=sorted(TECHNIQUES))
def suite(request, gl):
    suite = Suite(request.param)
    yield suite
    suite.close()


def test_the_registry_holds_the_protocols_eighteen():
    assert set(TESTS) == {str(i) for i in range(1, 19)} | {"4b"}


@pytest.mark.parametrize("key", [k for k, t in TESTS.items() if t.fast])
def test_a_technique_passes_or_its_failure_is_known(suite, key):
    """A failure that nobody has written down with its cause is a regression."""
    finding = run_one(suite, key)
    assert finding.verdict != ERROR, finding.note
    missed = [f"{q.name} = {q.value:.5g}, limit {q.limit}" for q in finding.quantities if q.limited and not q.holds]
    if finding.verdict == FAIL:
        assert (suite.technique, key) in KNOWN, f"{suite.technique} fails {key} {TESTS[key].title}: {'; '.join(missed)}"
    if finding.verdict == NATURE:
        assert finding.nature and missed


@pytest.mark.parametrize(("removed", "key"), [("RSM Lighting Computation", "15"), ("RSM Generation", "11")])
def test_the_suite_notices_a_technique_without_light(gl, removed, key):
    """Sabotage: without its gather RSM has no gain, and the tests of gain must say so."""
    with without_pass("RSM", removed):
        suite = Suite("RSM")
        try:
            assert run_one(suite, key).verdict == FAIL
        finally:
            suite.close()


def test_no_light_is_no_tight_wall(gl, monkeypatch):
    """Where nothing reaches the lit room nothing leaks: a failure, and of screen space what it cannot be asked."""
    monkeypatch.setattr(Suite, "indirect", lambda self, scene, **values: np.zeros((self.size[1], self.size[0], 3)))
    for technique, verdict in (("LPV", FAIL), ("SSDO", stability.NOT_APPLICABLE)):
        suite = Suite(technique)
        assert run_one(suite, "5").verdict == verdict
        suite.close()


def test_the_suite_notices_a_factor_of_two(gl, monkeypatch):
    suite = Suite("RSM")
    true = suite.indirect
    monkeypatch.setattr(suite, "indirect", lambda *a, **k: 2.0 * true(*a, **k))
    try:
        assert [run_one(suite, key).verdict for key in ("1", "9")] == [FAIL] * 2
    finally:
        suite.close()


def test_an_exception_is_a_finding(gl, monkeypatch):
    def broken(suite):
        raise ValueError("a broken check")

    monkeypatch.setitem(TESTS, "1", stability.Test("1", "Broken", "", broken))
    suite = Suite("RSM")
    finding = run_one(suite, "1")
    suite.close()
    assert finding.verdict == ERROR and "a broken check" in finding.note


def test_verdicts_follow_from_quantities():
    assert Finding([at_most("x", 1.0, 2.0)]).judge().verdict == PASS
    assert Finding([at_most("x", 3.0, 2.0)]).judge().verdict == FAIL
    assert Finding([at_most("x", 3.0, 2.0)], nature="why").judge().verdict == NATURE
    assert Finding([at_most("x", float("nan"), 2.0)]).judge().verdict == FAIL, "not a number never passes"
    assert Finding([Quantity("x", 3.0)]).judge().verdict == stability.REPORTED
    assert Finding().judge().verdict == stability.NOT_APPLICABLE


def test_lamberts_polygon_matches_the_rectangle_of_the_catalogue():
    """Parallel square of half side a at distance c above: Howell B-4 × 4; a square seen edge-on from its plane gives 0."""
    half, distance = 0.3, 0.7
    square = np.array([[-half, -half, distance], [half, -half, distance], [half, half, distance], [-half, half, distance]])
    a = half / distance
    q = a / np.sqrt(1 + a * a)
    expected = 4.0 / (2.0 * np.pi) * 2.0 * q * np.arctan(q)
    up = np.array([[0.0, 0.0, 1.0]])
    assert polygon_form_factor(np.zeros((1, 3)), up, square)[0] == pytest.approx(expected, rel=1e-9)
    assert polygon_form_factor(np.array([[5.0, 0, distance]]), up, square)[0] == pytest.approx(0.0, abs=1e-12)


def test_rays_meet_what_the_camera_looks_at():
    camera = scenes.perspective((0.0, 3.0, 1.7), (0.2, 0.0, 0.5), 0.85)
    origin, direction = camera_rays(camera, (65, 37))
    distance, s, t = hits(origin, direction, np.array([-1.0, 0, 0]), np.array([2.0, 0, 0]), np.array([0, 0, 1.0]))
    assert (2.0 * s[18, 32] - 1.0, t[18, 32]) == (pytest.approx(0.2), pytest.approx(0.5))
    assert np.isfinite(distance[18, 32]) and np.isinf(distance[0, 0])


def test_a_camera_that_sees_half_the_sphere_sees_half_its_light():
    """An orthographic camera in the middle, wide enough, looks at one half of the sphere about it."""
    camera = scenes.orthographic((0, 0, 0), (0, 1, 0), 4.0, aspect=1.0)
    # Orthographic clip space has no front: count what lies before the camera by the wide perspective instead.
    wide = scenes.perspective((0, 0, 0), (0, 1, 0), fov=np.pi - 1e-3, aspect=1.0)
    assert visible_share(wide, 1.0, 100.0, np.zeros(3)) == pytest.approx(0.5, abs=1e-2)
    assert visible_share(camera, 1.0, 100.0, np.zeros(3)) == pytest.approx(1.0)


def test_a_transformed_scene_keeps_its_picture(gl):
    """Turned, moved and scaled as a whole with its camera: the same picture, power scaled by s²."""
    suite = Suite("RSM")
    turn = np.eye(4)
    turn[:3, :3] = 2.0 * np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    turn[:3, 3] = (5, -3, 2)
    a = suite.indirect(scenes.cornell(), samples=4, use_ao=False)
    b = suite.indirect(scenes.transformed(scenes.cornell(), turn), samples=4, use_ao=False)
    suite.close()
    assert b.mean() == pytest.approx(a.mean(), rel=0.01)


def test_the_command_writes_a_page_and_json(gl, tmp_path):
    from gi_addon.cli import main

    result = CliRunner().invoke(main, ["stability", "--techniques", "rsm", "--tests", "2,12", "-o", str(tmp_path)])
    assert result.exit_code == 0, result.output
    data = json.loads((tmp_path / "stability.json").read_text())
    found = data["techniques"]["RSM"]
    assert found["2"]["verdict"] == PASS and found["2"]["quantities"][0]["value"] == pytest.approx(0.25, abs=0.025)
    assert found["2"]["curves"][0]["lines"]["measured"]
    page = (tmp_path / "stability.html").read_text()
    assert "Multi-bounce" in page and "Scale" in page and "http-equiv" not in page
    strict = CliRunner().invoke(main, ["stability", "--tests", "99"])
    assert strict.exit_code != 0 and "no test 99" in strict.output


def test_strict_fails_on_a_failure(gl, tmp_path, monkeypatch):
    from gi_addon.cli import main

    monkeypatch.setitem(TESTS, "1", stability.Test("1", "Fails", "", lambda suite: Finding([at_most("x", 2.0, 1.0)])))
    options = ["stability", "--techniques", "rsm", "--tests", "1", "-o", str(tmp_path)]
    assert CliRunner().invoke(main, options).exit_code == 0
    result = CliRunner().invoke(main, [*options, "--strict"])
    assert result.exit_code == 1 and "RSM 1" in result.output


def test_an_interrupted_suite_goes_on_where_it_stopped(gl, tmp_path, monkeypatch):
    """What ended is read back with its pictures and plots, an exception is tried again, another source is another result."""
    ran = []
    true = stability.run_one

    def counting(suite, key):
        ran.append(key)
        if len(ran) == 2:
            raise KeyboardInterrupt
        return true(suite, key)

    monkeypatch.setattr(stability, "run_one", counting)
    keys = ["15", "16"]
    with pytest.raises(KeyboardInterrupt):
        stability.run(["SSDO"], keys, cache=tmp_path)
    found = stability.run(["SSDO"], keys, cache=tmp_path)["SSDO"]
    assert ran == ["15", "16", "16"]
    again = stability.run(["SSDO"], keys, cache=tmp_path)["SSDO"]
    assert len(ran) == 3
    assert again["15"].quantities == found["15"].quantities and again["15"].curves == found["15"].curves
    assert np.array_equal(again["16"].pictures["first"], found["16"].pictures["first"].astype("f4"))
    monkeypatch.setattr(stability, "source_version", lambda: "another")
    stability.run(["SSDO"], ["15"], cache=tmp_path)
    assert ran[3:] == ["15"]
    for path in tmp_path.glob("*.npz"):
        path.write_bytes(b"damaged")
    stability.run(["SSDO"], ["16"], cache=tmp_path)
    assert ran[4:] == ["16"]


def test_a_mirrored_scene_looks_mirrored(gl):
    """Reflections are among test 4b's 48: light must not care that triangles and axes are inside out."""
    suite = Suite("LPV")
    plain = suite.indirect(scenes.cornell(light="point"), samples=4)
    mirrored = suite.indirect(scenes.transformed(scenes.cornell(light="point"), np.diag([-1.0, 1, 1, 1])), samples=4)
    suite.close()
    assert np.abs(mirrored[:, ::-1] - plain).mean() < 0.02 * plain.mean()
