# SPDX-License-Identifier: GPL-3.0-or-later
"""The comparison report: its arithmetic, its resumption, its page in a browser, the effects table and the certificate."""

from __future__ import annotations

import json
import math
import os
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest
from click.testing import CliRunner
from conftest import ROOT

from gi_addon import presets
from gi_addon.compare import certificate, charts, effects, page, references, report, scenes, study, sweeps
from gi_addon.compare.metrics import score
from gi_addon.compare.references import Halves
from gi_addon.compare.studio import Studio, settings_for, without_pass
from gi_addon.compare.sweeps import Candidate, peer_sweep, technique_sweep
from gi_addon.engines import TECHNIQUES
from gi_addon.settings import Settings

BROWSER = next((p for p in map(shutil.which, ("chromium", "chromium-browser", "google-chrome")) if p), None)


# --- arithmetic ---------------------------------------------------------------------------------------------------------


def test_the_pareto_front_holds_what_nothing_beats():
    points = [(1, 10), (2, 5), (3, 6), (2, 4), (10, 1), (11, 1), (0.5, math.nan), (5, 0.0), (5, -1.0)]
    assert charts.pareto(points) == [0, 3, 4]
    assert charts.pareto([]) == []


def test_the_hypervolume_is_an_area_in_decades():
    """One point two decades faster than the corner and one decade better covers 2; a dominated point adds nothing."""
    corner = (1000.0, 1.0)
    assert charts.hypervolume([(10, 0.1)], corner) == pytest.approx(2.0)
    assert charts.hypervolume([(10, 0.1), (20, 0.2)], corner) == pytest.approx(2.0)
    assert charts.hypervolume([(10, 0.1), (100, 0.01)], corner) == pytest.approx(3.0)
    assert charts.hypervolume([(10, 2.0)], corner) == 0.0, "never better than the constant"


def test_the_bootstrap_interval_covers_the_error_it_is_of():
    """95 % of intervals should hold the true mean; of 40 with independent tiles no fewer than 33 do (p < 0.01 else)."""
    rng = np.random.default_rng(3)
    reference = np.ones((48, 64, 3))
    covered = 0
    for i in range(40):
        tiles = rng.exponential(0.1, (6, 8))
        test = 1.0 + np.sqrt(np.kron(tiles, np.ones((8, 8))))[..., None].repeat(3, -1)
        low, high = study.interval(test, reference, reference, rounds=200, seed=i)
        assert low < high
        covered += low <= 0.1 / 1.01 <= high
    assert covered >= 33


def test_numbers_that_are_not_finite_stay_out_of_json():
    assert json.loads(page.dump({"a": math.nan, "b": [math.inf, np.float32(2.0), np.int64(3)], "c": np.zeros(2)})) == {
        "a": None,
        "b": [None, 2.0, 3],
        "c": [0.0, 0.0],
    }


def test_a_table_escapes_what_it_is_given():
    assert "&lt;b&gt;" in page.table(["x"], [["a <b>"]]) and "<b>ok" in page.table(["x"], [["<b>ok</b>"]])


def test_the_heat_map_is_dark_where_the_error_is_small():
    colors = page.heat(np.array([[1e-9, 1e-4, 1e-1, 1e9]]), 1e-4, 10.0).astype(int).sum(axis=-1)[0]
    assert colors[0] == colors[1] < colors[2] < colors[3]


def test_ready_references_are_averaged_in_blocks(tmp_path):
    """Row 0 of the file is the top; of the picture, the bottom. A size that is no whole share is refused."""
    rows = np.arange(4.0)[:, None, None] + np.zeros((4, 8, 3))
    keys = {f"{kind}.{half}.DiffInd": rows + (half == "B") for kind in ("R1", "Rinf") for half in "AB"}
    np.savez(tmp_path / "room.npz", **keys)
    found = references.ready(tmp_path / "room.npz", (4, 2), ("Combined", "Diffuse Indirect"))
    assert set(found) == {"R1", "Rinf"} and set(found["R1"].a) == {"Diffuse Indirect"}
    assert found["R1"].a["Diffuse Indirect"][:, 0, 0].tolist() == [2.5, 0.5]
    assert found["R1"].mean("Diffuse Indirect").shape == (2, 4, 3) and found["Rinf"].b["Diffuse Indirect"][0, 0, 0] == 3.5
    assert references.ready(tmp_path / "hall.npz", (4, 2), ("Combined",)) is None
    with pytest.raises(ValueError, match="no whole share"):
        references.ready(tmp_path / "room.npz", (3, 2), ("Diffuse Indirect",))


def test_ready_references_of_light_over_colour_are_light_over_colour_when_smaller(tmp_path):
    """A block of one glossy pixel and three that have no lobe shows what the one shows, as a renderer of that size has it."""
    light, color = np.zeros((2, 2, 3), "f2"), np.zeros((2, 2, 3), "f2")
    light[0, 0], color[0, 0] = 0.5, 0.04
    keys = {f"{kind}.{half}.{key}": a for kind in ("R1", "Rinf") for half in "AB"
            for key, a in (("GlossInd", light), ("GlossCol", color))}  # fmt: skip
    np.savez(tmp_path / "room.npz", **keys)
    found = references.ready(tmp_path / "room.npz", (1, 1), ("Glossy Indirect", "Glossy Color"))
    np.testing.assert_allclose(found["R1"].a["Glossy Indirect"], 0.5, rtol=1e-3)
    np.testing.assert_allclose(found["R1"].a["Glossy Color"], 0.01, rtol=1e-3)


# --- sweeps and resumption ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("technique", sorted(TECHNIQUES))
@pytest.mark.parametrize("sweep", ["none", "presets", "samples", "quick", "full"])
def test_every_candidate_of_a_sweep_can_be_set(technique, sweep):
    found = technique_sweep(technique, sweep)
    assert len(found) == len(set(found)) >= {"none": 1, "presets": 3, "samples": 2, "quick": 6, "full": 10}[sweep]
    for candidate in found:
        settings = candidate.settings(Settings())
        chosen = dict(candidate.options)
        chosen = presets.PRESETS[chosen["preset"]].values if "preset" in chosen else chosen
        assert settings.technique == technique and all(settings.get(k) == v for k, v in chosen.items())
    assert len(peer_sweep("cycles", sweep)) >= 4 and len(peer_sweep("eevee", sweep)) >= 2


def test_an_interrupted_sweep_goes_on_where_it_stopped(gl, tmp_path, monkeypatch):
    """Whatever was finished is not rendered again; another setting or another scene is."""
    scene = scenes.cornell()
    candidates = technique_sweep("RSM", "quick")[:2]
    rendered = []
    true = study.visit

    def counting(studio, plain, run, *rest):
        rendered.append(run.candidate)
        if len(rendered) == 2:
            raise KeyboardInterrupt
        true(studio, plain, run, *rest)

    monkeypatch.setattr(study, "visit", counting)
    options = {"base": Settings(), "driver": "test", "cache": tmp_path, "repeats": 1}
    with pytest.raises(KeyboardInterrupt):
        study.measure(scene, "key", (32, 18), candidates, **options)
    assert len(list(tmp_path.glob("*.npz"))) == 1
    runs = study.measure(scene, "key", (32, 18), candidates, **options)
    assert len(rendered) == 2 + 3, "one visit was kept, three were left"
    assert [r.visits for r in runs] == [2, 2] and all(len(r.times) == 2 for r in runs)
    again = study.measure(scene, "key", (32, 18), candidates, **options)
    assert len(rendered) == 5 and np.array_equal(again[0].passes["Combined"], runs[0].passes["Combined"])
    study.measure(scene, "other", (32, 18), candidates[:1], **options)
    assert len(rendered) == 7
    for path in tmp_path.glob("*.npz"):
        path.write_bytes(b"damaged")
    study.measure(scene, "key", (32, 18), candidates[:1], **options)
    assert len(rendered) == 9


def test_a_result_has_the_same_name_in_every_process(tmp_path):
    """Python hashes text differently in each process: no name may depend on that, or a sweep would never be resumed."""
    code = (
        "from gi_addon.compare import scenes, study, sweeps\n"
        "from gi_addon.settings import Settings\n"
        "for name in ('cornell', 'effect-glossy'):\n"
        "    key = scenes.BUILTIN[name]().digest()\n"
        "    for c in sweeps.technique_sweep('VCT', 'quick') + sweeps.peer_sweep('cycles', 'quick'):\n"
        "        chosen = None if c.peer else c.settings(Settings())\n"
        "        print(study.run_key(key, (32, 18), c, chosen, 'driver', study.source_version()))\n"
    )
    said = [
        subprocess.run(
            [sys.executable, "-c", code],
            capture_output=True,
            text=True,
            check=True,
            cwd=ROOT,
            env={**os.environ, "PYTHONHASHSEED": seed},
        ).stdout
        for seed in ("1", "2")
    ]
    assert said[0] == said[1] and len(set(said[0].split())) == len(said[0].split()) > 20


def test_scores_are_kept_beside_their_run(gl, tmp_path, monkeypatch):
    """They are read back for the same references only."""
    scene, size = scenes.cornell(), (32, 18)
    (run,) = study.measure(
        scene, "key", size, [Candidate("RSM", (("samples", 1),))], base=Settings(), driver="test", cache=tmp_path, repeats=1
    )
    noisy = {n: (p * 1.1).astype("f4") for n, p in run.passes.items()}
    references = {"R1": Halves(run.passes, noisy), "Rinf": Halves(noisy, run.passes)}
    first = study.score_run(run, references)
    assert set(first["Diffuse Indirect"]) == {"R1", "Rinf"} and set(first["Diffuse Direct"]) == {"Rinf"}
    monkeypatch.setattr(study, "score", lambda *a, **k: pytest.fail("scored again"))
    assert json.dumps(study.score_run(run, references)) == json.dumps(first)
    with pytest.raises(pytest.fail.Exception, match="scored again"):
        study.score_run(run, {"R1": Halves(noisy, noisy)})


def test_a_slow_candidate_has_fewer_frames(gl, tmp_path):
    """One at least, and their number is in the record."""
    scene, size = scenes.cornell(), (16, 9)
    runs = study.measure(
        scene,
        "key",
        size,
        [Candidate("RSM", (("samples", 1),))],
        base=Settings(),
        driver="test",
        cache=tmp_path,
        repeats=50,
        budget_s=0.0,
    )
    record = study.scene_record("cornell", "key", size, 8, runs, {}, 30)["candidates"][0]
    assert record["frames"] == 2 and record["worst_ms"] >= record["moving_ms"] > 0 and record["p95"] >= record["ms"]


def test_a_peer_is_warmed_up_once_for_each_way_it_renders(gl, tmp_path):
    """A first picture that is not timed for each ray tracing and denoiser, none for another number of samples."""
    asked = []

    def peer(candidate, names):
        asked.append(candidate)
        return {"Combined": np.full((9, 16, 4), 0.5, "f4")}, 0.25

    candidates = peer_sweep("eevee", "quick")
    runs = study.measure(
        scenes.cornell(),
        "key",
        (16, 9),
        candidates,
        base=Settings(),
        driver="test",
        cache=tmp_path,
        peer=peer,
        repeats=1,
        visits=1,
    )
    assert len(asked) == len(candidates) + 2 and asked[0] == asked[1] and asked[2] == asked[3]
    assert all(r.times == [250.0] and r.passes["Combined"].shape == (9, 16, 3) for r in runs)


def test_the_blender_that_eevee_runs_in_is_named_or_found(blender, tmp_path, monkeypatch):
    """The option wins over the environment, that over the path; what is named must be there."""
    from gi_addon.host import eevee

    for folder in ("named", "set", "path"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "blender").write_text("#!/bin/sh\necho Blender 5.2.0 from a test\n")
        (tmp_path / folder / "blender").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path / "path"))
    monkeypatch.delenv("QUARTET_BLENDER", raising=False)
    assert eevee.program() == str(tmp_path / "path" / "blender")
    monkeypatch.setenv("QUARTET_BLENDER", str(tmp_path / "set" / "blender"))
    assert eevee.program() == str(tmp_path / "set" / "blender")
    assert eevee.program(tmp_path / "named" / "blender") == str(tmp_path / "named" / "blender")
    with pytest.raises(RuntimeError, match="no such program"):
        eevee.program(tmp_path / "nowhere")
    with eevee.Eevee(blender.context.scene, eevee.program()) as other:
        assert other.version == "Blender 5.2.0 from a test"


def test_a_candidate_that_fails_is_left_out_and_said(gl, tmp_path):
    said = []
    runs = study.measure(
        scenes.cornell(),
        "key",
        (16, 9),
        [Candidate("Cycles", (("samples", 1),)), Candidate("RSM", (("samples", 1),))],
        base=Settings(),
        driver="test",
        cache=tmp_path,
        repeats=1,
        progress=said.append,
    )
    assert [r.candidate.method for r in runs] == ["RSM"]
    assert any("not open in Blender" in text for text in said)


# --- the page ---------------------------------------------------------------------------------------------------------------


def _measured(tmp_path, name="cornell.blend") -> report.Measured:
    """A comparison of RSM with itself converged, and of a made-up Cycles: everything a page needs, without Blender."""
    scene = scenes.cornell()
    size = (48, 27)
    runs = study.measure(
        scene, "key", size, technique_sweep("RSM", "quick")[:3], base=Settings(), driver="test", cache=tmp_path, repeats=1
    )
    truth = runs[-1].passes
    rng = np.random.default_rng(1)
    halves = [{n: (p * (1.0 + 0.02 * rng.standard_normal(p.shape))).astype("f4") for n, p in truth.items()} for _ in "AB"]
    references = {"R1": Halves(*halves), "Rinf": Halves(*halves)}
    for method, noise, ms in (("Cycles", 0.5, 200.0), ("Cycles + OIDN", 0.2, 300.0)):
        passes = {n: (p * (1.0 + noise * rng.standard_normal(p.shape))).astype("f4") for n, p in truth.items()}
        runs.append(study.Run(Candidate(method, (("samples", 1),)), passes, [ms, ms], visits=2))
    return report.Measured(study.scene_record(name, "key", size, 8, runs, references, 30), runs, references)


HEAD = {"version": "test", "driver": "a driver", "date": "2026-01-01", "sweep": "quick"}


@pytest.fixture(scope="module")
def written(gl, tmp_path_factory):
    pytest.importorskip("plotly")
    folder = tmp_path_factory.mktemp("report")
    measured = _measured(folder / "runs")
    study.write_results(folder, HEAD, [measured.record])
    report.write(folder, HEAD, [measured], images=False)
    return folder, measured


def test_the_report_is_one_file_that_fetches_nothing(written):
    folder, measured = written
    text = (folder / "report.html").read_text()
    body = text[text.index("<body>") :]
    assert not re.search(r'(src|href)\s*=\s*["\']?(https?:)?//', body), "something is fetched"
    assert "<link" not in text[: text.index("<script>")]
    for expected in ("Pareto", "Hypervolume", "noise floor", "shape error", "best constant", "FLIP", "Where the time goes"):
        assert expected in text
    data = json.loads((folder / "results.json").read_text())
    scored = data["scenes"][0]["candidates"][0]["scores"]["Combined"]["Rinf"]
    assert scored["low"] <= scored["rel_mse"] <= scored["high"]
    assert (folder / "results.csv").read_text().count("\n") > 10
    lines = report.verdict_lines(measured.record)
    assert any("Pareto front" in line and "RSM" in line for line in lines)


def test_peers_are_not_blamed_for_bouncing_more_than_once(written):
    _, measured = written
    assert {p["method"] for p in charts.points_of(measured.record, "Combined", "R1", "rel_mse")} == {"RSM"}
    assert {p["method"] for p in charts.points_of(measured.record, "Combined", "Rinf", "rel_mse")} >= {"Cycles", "Cycles + OIDN"}


def test_the_yardstick_is_cycles_at_one_sample_denoised(written):
    _, measured = written
    rows = report.yardstick(measured.record)
    assert rows[0][0] == "Cycles 1 spp + OIDN" and rows[0][1] == "300 ms"
    assert {row[0] for row in rows[1:]} == {"RSM", "Cycles", "Cycles + OIDN"}


def test_presets_are_judged_by_what_they_are_meant_for(written):
    """A preset within its share of the yardstick's time passes by time, one beyond it fails, and so by error."""
    _, measured = written
    record = json.loads(json.dumps(measured.record, default=float))
    unit = next(c for c in record["candidates"] if c["method"] == "Cycles + OIDN" and c["options"]["samples"] == 1)
    mine = next(c for c in record["candidates"] if c["method"] == "RSM")
    error = unit["scores"]["Combined"]["Rinf"]["rel_mse"]
    for share, factor in ((0.5, 0.5), (2.0, 2.0)):
        mine.update(options={"preset": "BALANCED"}, ms=share * unit["ms"])
        mine["scores"]["Combined"]["Rinf"]["rel_mse"] = factor * error
        (row,) = report.preset_rows(record)
        assert row[:2] == ["RSM", "Balanced"]
        assert all(("class=ok" in cell) == (share < 1.0) for cell in (row[3], row[5])), row
    assert report.preset_rows({**record, "candidates": [c for c in record["candidates"] if c is not unit]}) == []


def test_a_preset_of_several_bounces_is_not_compared_with_one(written):
    """What counts is how often a candidate bounces, however it was set."""
    assert sweeps.Candidate("LPV", (("preset", "FINAL"),)).settings().bounces > 1
    _, measured = written
    record = {**measured.record, "candidates": [{**c, "bounces": 3} for c in measured.record["candidates"]]}
    assert charts.points_of(record, "Combined", "R1", "rel_mse") == []
    assert charts.points_of(record, "Combined", "Rinf", "rel_mse")


@pytest.mark.skipif(BROWSER is None, reason="no Chromium here")
def test_the_report_draws_in_a_browser_without_network(written, tmp_path):
    """Headless Chromium, every host unreachable: the script ran to its end, the charts are drawn, the wall shows pictures,
    and the screenshot is not blank."""
    from PIL import Image

    folder, _ = written
    options = [
        BROWSER,
        "--headless=new",
        "--no-sandbox",
        "--disable-gpu",
        "--host-resolver-rules=MAP * ~NOTFOUND",
        "--virtual-time-budget=10000",
        "--window-size=1200,1800",
        f"--user-data-dir={tmp_path / 'profile'}",
    ]
    address = (folder / "report.html").as_uri()
    dom = subprocess.run([*options, "--dump-dom", address], capture_output=True, text=True, timeout=120).stdout
    body = re.search(r"<body[^>]*>", dom).group(0)
    assert 'data-ready="1"' in body
    drawn = int(re.search(r'data-charts="(\d+)"', body).group(1))
    assert drawn == dom.count('class="chart') and drawn >= 5
    assert dom.count('class="top"') == 1 and 'class="top" alt="left" src="data:image/png' in dom
    shot = tmp_path / "shot.png"
    subprocess.run([*options, f"--screenshot={shot}", address], capture_output=True, timeout=120, check=True)
    image = np.asarray(Image.open(shot).convert("RGB")).astype(int)
    assert image.shape == (1800, 1200, 3) and len(np.unique(image.reshape(-1, 3), axis=0)) > 500
    assert (np.ptp(image, axis=-1) > 60).sum() > 1000, "the red and green walls are in the picture"


@pytest.mark.skipif(BROWSER is None, reason="no Chromium here")
def test_charts_come_as_png_and_svg_too(written, tmp_path):
    pytest.importorskip("kaleido")
    _, measured = written
    figure = report.figures([measured])["cornell-combined-Rinf-relmse"]
    files, note = charts.write_images({"chart": figure}, tmp_path)
    assert not note, note
    assert [f.name for f in files] == ["chart.png", "chart.svg"] and files[0].stat().st_size > 5000
    assert files[1].read_text().count("<path") > 10


# --- Table 1, the certificate -------------------------------------------------------------------------------------------------


def test_a_verdict_is_a_threshold():
    reference = np.random.default_rng(2).uniform(0.5, 1.5, (20, 20, 3))
    assert effects.verdict(score(reference, reference), off=1.0) == "Yes"
    assert effects.verdict(score(1.2 * reference, reference), off=1.0) == "Partially", "a wrong gain is not a yes"
    assert effects.verdict(score(1.2 * reference, reference), off=0.01) == "No", "better switched off"
    assert effects.verdict(score(0.0 * reference, reference), off=1.0) == "No"


@pytest.mark.parametrize("technique", sorted(TECHNIQUES))
def test_every_cell_of_the_table_can_be_judged(gl, technique):
    """Against the technique's own converged picture the error is its noise: never No where there is light."""
    plain = scenes.effect("shadows")
    output = effects.JUDGED["shadows"].output
    with Studio() as studio:
        truth = studio.render(plain, settings_for(technique, samples=32), (output,), (48, 27)).passes[output][..., :3]
        cell = effects.judge(technique, "shadows", plain, (48, 27), Halves({output: truth}, {output: truth}), studio)
    assert cell.verdict == "Yes" and cell.off > cell.score.rel_mse and cell.paper in ("Yes", "Partially", "No")
    assert technique in effects.html([cell]) and effects.as_json([cell])["cells"][0]["verdict"] == "Yes"


def test_each_effect_has_a_scene_a_pass_and_a_switch():
    from gi_addon.compare.paper import EFFECTS
    from gi_addon.outputs import OUTPUTS

    for name in EFFECTS:
        assert scenes.effect(name).triangle_count() > 0
        assert effects.JUDGED[name].output in OUTPUTS and Settings().get(effects.JUDGED[name].switch) is True


def test_bounces_follow_from_the_albedo():
    assert certificate.bounces_needed(0.5) == 5  # 2^-5 = 0.031 ≤ 0.05 < 2^-4
    assert certificate.bounces_needed(0.0) == 0 and certificate.bounces_needed(0.04) == 1


def test_walls_are_as_thick_as_they_were_built():
    b = scenes.SceneBuilder()
    b.quads(scenes.box_quads((-1, -0.05, 0), (1, 0.05, 2)), scenes.diffuse((1, 1, 1)))
    found = certificate.wall_thickness(b.build(), points=200)
    assert np.median(found) == pytest.approx(0.1, rel=1e-3) and len(found) == 200


def test_the_ablation_finds_what_every_pass_is_for(gl):
    """On a box against its own picture: the gather and the shadow maps are needed, and a pass that adds nothing is named."""
    scene, size = scenes.cornell(), (48, 27)
    settings = settings_for("RSM", samples=2, rsm__visibility="NONE")
    with Studio() as studio:
        image = studio.render(scene, settings, ("Combined",), size).passes["Combined"][..., :3]
    noise = [(image * (1 + 0.01 * np.random.default_rng(i).standard_normal(image.shape))).astype("f4") for i in range(2)]
    result = certificate.certify(scene, settings, size, {"R1": Halves({"Combined": noise[0]}, {"Combined": noise[1]})})
    by = {r.title: r for r in result.removals}
    assert by["RSM Lighting Computation"].verdict.startswith("needed") and by["Shadow Maps"].verdict.startswith("needed")
    assert by["G-buffers Generation"].rel_mse is None and "no picture" in by["G-buffers Generation"].verdict
    assert "RSM Flux" in by["RSM Generation"].with_it
    assert result.score.gain == pytest.approx(1.0, abs=0.01) and result.low <= result.score.rel_mse <= result.high
    text = result.text()
    assert "bounces" in text and "no BRDF Tables: no material is glossy" in text and "samples 4" in text
    assert any("passes through walls" in f for f in result.failures)


def test_removing_a_pass_leaves_the_technique_as_it_was(gl):
    before = TECHNIQUES["RSM"]
    with pytest.raises(ZeroDivisionError), without_pass("RSM", "Shadow Maps"):
        assert TECHNIQUES["RSM"] is not before
        raise ZeroDivisionError
    assert TECHNIQUES["RSM"] is before


# --- through Blender ------------------------------------------------------------------------------------------------------------


@pytest.mark.blender
def test_the_command_compares_scenes_with_peers(gl, blender, tmp_path, monkeypatch):
    """Two bundled scenes, RSM and Cycles, all the way to the page; then the certificate of one."""
    pytest.importorskip("plotly")
    from gi_addon.cli import main

    monkeypatch.setenv("QUARTET_CACHE", str(tmp_path / "cache"))
    monkeypatch.setitem(sweeps.CYCLES_SAMPLES, "none", (16,))
    monkeypatch.setattr("gi_addon.compare.charts.write_images", lambda figures, folder: ([], "not drawn here"))
    options = ["--techniques", "rsm", "--peers", "cycles", "--resolution", "32x18", "--reference-samples", "4"]
    result = CliRunner().invoke(main, ["compare", "builtin:cornell", "builtin:corridor", *options, "-o", str(tmp_path / "o")])
    assert result.exit_code == 0, result.output
    data = json.loads((tmp_path / "o" / "results.json").read_text())
    assert [s["scene"] for s in data["scenes"]] == ["builtin:cornell", "builtin:corridor"]
    by = {(c["method"], c["label"]): c for c in data["scenes"][0]["candidates"]}
    assert 0.9 < by["Cycles", "samples 16"]["scores"]["Combined"]["Rinf"]["gain"] < 1.1
    assert "R1" not in by["Cycles", "samples 16"]["scores"]["Combined"]
    assert by["RSM", "defaults"]["passes_ms"] and by["RSM", "defaults"]["moving_ms"] > 0
    assert "not drawn here" in result.output
    result = CliRunner().invoke(
        main, ["inspect", "builtin:cornell", "--certify", "--resolution", "32x18", "--reference-samples", "4"]
    )
    assert result.exit_code == 0 and "ablation" in result.output, result.output
    assert CliRunner().invoke(main, ["compare", "builtin:nowhere", "--sweep", "quick"]).exit_code != 0
    assert CliRunner().invoke(main, ["compare"]).exit_code != 0
    assert "cycles and eevee" in CliRunner().invoke(main, ["compare", "builtin:cornell", "--peers", "luxcore"]).output


@pytest.mark.blender
def test_the_command_fills_the_table_of_effects(gl, blender, tmp_path, monkeypatch):
    """Reference, technique, page and JSON of one effect, through Blender."""
    from gi_addon.cli import main

    monkeypatch.setenv("QUARTET_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(effects, "JUDGED", {"shadows": effects.JUDGED["shadows"]})
    options = ["--effects", "--techniques", "ssdo", "--resolution", "32x18", "--reference-samples", "64"]
    result = CliRunner().invoke(main, ["compare", *options, "-o", str(tmp_path / "o")])
    assert result.exit_code == 0, result.output
    (cell,) = json.loads((tmp_path / "o" / "effects.json").read_text())["cells"]
    assert cell["effect"] == "shadows" and cell["gain"] == pytest.approx(1.0, abs=0.1) and cell["off_rel_mse"] > cell["rel_mse"]
    assert "Table 1 with numbers" in (tmp_path / "o" / "report.html").read_text()
