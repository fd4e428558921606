# SPDX-License-Identifier: GPL-3.0-or-later
"""Table 2's bench: the paper's rows, what a frame does, and what is written. Times themselves are never asserted."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest
from click.testing import CliRunner

from gi_addon.compare import bench, scenes
from gi_addon.compare.paper import EFFECTS, FULL_HD, HD, TABLE_1, TABLE_2, Row
from gi_addon.settings import SettingError

SMALL = Row("RSM", "64², 10 samples", (("rsm.resolution", 64), ("rsm.samples", 10)), HD, 226)


def test_the_papers_table_is_whole():
    """16 + 4 + 16 + 8 rows; the three frame rates that the scan lost are the only gaps, and one is marked doubtful."""
    count = {t: sum(r.technique == t for r in TABLE_2) for t in ("RSM", "LPV", "VCT", "SSDO")}
    assert count == {"RSM": 16, "LPV": 4, "VCT": 16, "SSDO": 8}
    assert sum(r.fps is None for r in TABLE_2) == 3
    assert [r.key for r in TABLE_2 if r.doubtful] == ["VCT 64³, continuous on 1280x720"]
    assert {r.resolution for r in TABLE_2} == {HD, FULL_HD}
    assert len({r.key for r in TABLE_2}) == len(TABLE_2)
    by = {r.key: r.fps for r in TABLE_2}
    assert by["RSM 1024², 400 samples 1920x1080"] == 58 and by["VCT 512³, continuous on 1920x1080"] == 52
    assert by["LPV 64³ 1280x720"] == 94 and by["SSDO 400 samples 1280x720"] == 27
    assert all(set(cells) == set(EFFECTS) for cells in TABLE_1.values()) and len(TABLE_1) == 4


def test_only_the_papers_three_effects_are_on():
    settings = bench.bench_settings(SMALL)
    assert settings.use_indirect_diffuse and settings.use_shadows and settings.use_ao
    assert not (settings.use_glossy or settings.use_translucency or settings.use_volumetric)
    assert settings.samples == 1 and settings.get("rsm.samples") == 10
    with pytest.raises(SettingError):
        bench.bench_settings(Row("RSM", "?", (("rsm.nonsense", 1),), HD, 1))


def test_the_benchs_scene_is_lit_by_its_sun_alone():
    scene = scenes.cornell(light="spot")
    scene.lights.append(scenes.sun_light((0, 0, -1), 3.0))
    scene.world = scenes.world((1, 1, 1))
    plain = bench.bench_scene(scene)
    assert [light.kind for light in plain.lights] == ["SUN"] and not plain.world.graph.nodes
    assert len(scene.lights) == 2, "the scene itself is left alone"
    assert [light.kind for light in bench.bench_scene(scenes.cornell()).lights] == ["SPOT"]


def test_a_moving_frame_makes_light_anew_and_a_still_one_keeps_it(gl):
    """A nudged light changes the stamp that light passes hang on, not the picture."""
    scene = scenes.cornell(light="sun")
    one, two = bench.nudged(scene, 1), bench.nudged(scene, 2)
    assert one.stamps()["lights"] != two.stamps()["lights"]
    assert one.stamps()["meshes"] == scene.stamps()["meshes"] and one.stamps()["transforms"] == scene.stamps()["transforms"]
    _, (timing,) = bench.bench(scene, techniques=["RSM"], scale=0.05, frames=2, rows=[SMALL])
    assert not timing.problem and len(timing.moving) == len(timing.still) == 2 and timing.size == (64, 36)
    assert "RSM Generation" in timing.passes and "Shadow Maps" in timing.passes
    assert timing.planned_mib > 1.0 and timing.held_mib > 0.9 * timing.planned_mib


def test_a_row_that_cannot_run_says_why_and_others_go_on(gl):
    impossible = Row("RSM", "too large", (("rsm.resolution", 99999),), HD, 1)
    _, (bad, good) = bench.bench(scenes.cornell(), techniques=["RSM"], scale=0.02, frames=1, rows=[impossible, SMALL])
    assert "99999" in bad.problem and not bad.moving and good.moving and not good.problem
    _, (slow,) = bench.bench(scenes.cornell(), techniques=["RSM"], scale=0.02, frames=1, rows=[SMALL], limit_s=0.0)
    assert "over the limit" in slow.problem


def test_an_interrupted_bench_goes_on_where_it_stopped(gl, tmp_path):
    """What is measured is read back; a row added to it is measured; another limit looks again."""
    other = Row("RSM", "64², 12 samples", (("rsm.resolution", 64), ("rsm.samples", 12)), HD, 1)
    options = {"techniques": ["RSM"], "scale": 0.02, "frames": 2, "cache": tmp_path}
    said = []
    _, (first,) = bench.bench(scenes.cornell(), rows=[SMALL], progress=said.append, **options)
    assert len(said) == 2 and first.visits == 2 and len(first.moving) == 2
    _, (again, added) = bench.bench(scenes.cornell(), rows=[SMALL, other], progress=said.append, **options)
    assert len(said) == 4 and again.moving == first.moving and again.passes == first.passes and len(added.moving) == 2
    _, (slow,) = bench.bench(scenes.corner(), rows=[SMALL], limit_s=0.0, progress=said.append, **options)
    assert "over the limit" in slow.problem and len(said) == 5, "another scene is another result"
    _, (slow,) = bench.bench(scenes.corner(), rows=[SMALL], limit_s=0.0, progress=said.append, **options)
    assert "over the limit" in slow.problem and len(said) == 5, "its first frame is known"
    _, (quick,) = bench.bench(scenes.corner(), rows=[SMALL], progress=said.append, **options)
    assert not quick.problem and len(quick.moving) == 2


def test_a_budget_bounds_the_frames_and_is_said(gl):
    _, (timing,) = bench.bench(scenes.cornell(), techniques=["RSM"], scale=0.02, frames=40, rows=[SMALL], budget_s=0.0)
    (record,) = bench.records(bench.Calibration(1.0, 0.01, 5, 646.27, 25.6), [timing])
    assert record["frames"] == len(timing.moving) == 2 and record["still_frames"] == 2, "one there, one back"


def test_the_calibration_kernel_counts_and_copies(gl):
    """It moves the data it says it moves, and reports a rate that follows from its time."""
    c = gl(lambda g: bench.calibrate(g, invocations=1 << 12, most=6))
    assert 5 <= c.runs <= 6 and c.milliseconds > 0 and c.gbytes > 0
    assert c.gflops == pytest.approx((1 << 12) * 512 * 4 * 4 * 2 / (c.milliseconds * 1e-3) * 1e-9)
    assert c.ratio == pytest.approx(np.sqrt(c.gflops / 6462.7 * c.gbytes / 256.0), rel=1e-3)


def test_ratios_are_frame_rates_over_the_papers():
    c = bench.Calibration(1.0, 0.01, 5, 646.27, 25.6)
    timing = bench.Timing(SMALL, (64, 36), moving=[10.0, 10.0, 40.0], still=[5.0])
    (record,) = bench.records(c, [timing])
    assert c.ratio == pytest.approx(0.1, rel=1e-3)
    assert record["fps"] == pytest.approx(100.0) and record["still_fps"] == pytest.approx(200.0)
    assert record["ratio"] == pytest.approx(100 / 226) and record["ratio_per_hardware"] == pytest.approx(1000 / 226, rel=1e-3)
    assert record["worst"] == 40.0


def test_the_command_writes_json_csv_and_a_page(gl, tmp_path):
    from gi_addon.cli import main

    options = ["bench", "--techniques", "rsm", "--rows", "512², 100 samples 1280x720", "--scale", "0.03", "--frames", "1"]
    result = CliRunner().invoke(main, [*options, "-o", str(tmp_path)])
    assert result.exit_code == 0, result.output
    assert "GTX 1070" in result.output
    data = json.loads((tmp_path / "bench.json").read_text())
    assert len(data["rows"]) == 1 and data["rows"][0]["paper_fps"] == 226 and data["rows"][0]["fps"] > 0
    assert data["calibration"]["hardware_ratio"] > 0 and data["driver"]
    with (tmp_path / "bench.csv").open() as stream:
        assert next(csv.DictReader(stream))["setting"] == "512², 100 samples"
    assert "512², 100 samples" in (tmp_path / "bench.html").read_text()
    assert CliRunner().invoke(main, ["bench", "--rows", "nothing like it"]).exit_code != 0
