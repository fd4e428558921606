# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line, as a user types it."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner
from conftest import ROOT

from gi_addon.compare import exr, scenes
from gi_addon.scene import Scene

EXAMPLE = str(ROOT / "examples" / "cornell.blend")


@pytest.fixture
def quartet(gl, blender):
    from gi_addon.cli import main

    def call(*arguments, code=0):
        result = CliRunner().invoke(main, [str(a) for a in arguments])
        assert result.exit_code == code, result.output + str(result.exception)
        return result.output

    return call


pytestmark = pytest.mark.blender


def test_a_blend_and_its_snapshot_render_the_same(quartet, tmp_path):
    options = ("--resolution", "64x36", "--samples", "2")
    quartet("render", EXAMPLE, *options, "-o", tmp_path / "a.exr")
    quartet("snapshot", EXAMPLE, "--resolution", "64x36", "-o", tmp_path / "s.npz")
    quartet("render", tmp_path / "s.npz", *options, "-o", tmp_path / "b.exr")
    a, b = (exr.read(tmp_path / n)["Combined"] for n in ("a.exr", "b.exr"))
    assert np.array_equal(a, b) and a[..., :3].max() > 0.1


def test_all_passes_go_into_one_file(quartet, tmp_path):
    quartet("render", EXAMPLE, "--resolution", "32x18", "--samples", "1", "--passes", "all", "-o", tmp_path / "a.exr")
    assert {"Combined", "Diffuse Indirect", "Depth", "Normal"} <= set(exr.read(tmp_path / "a.exr"))


@pytest.mark.parametrize("suffix", [".glb", ".obj"])
def test_other_formats_are_read_directly(quartet, blender, tmp_path, suffix):
    from gi_addon.host.build import build

    build(scenes.cornell())
    path = tmp_path / f"box{suffix}"
    if suffix == ".glb":
        blender.ops.export_scene.gltf(filepath=str(path))
    else:
        blender.ops.wm.obj_export(filepath=str(path))
    output = quartet("render", path, "--resolution", "32x18", "--samples", "1", "-o", tmp_path / "o.png")
    assert (tmp_path / "o.png").stat().st_size > 100
    assert suffix == ".glb" or ("no camera" in output and "no light" in output)


def test_inspect_prints_the_plan(quartet, tmp_path):
    text = quartet("inspect", EXAMPLE, "--resolution", "64x36", "--set", "use_shadows=off")
    assert "RSM Generation" in text and "shadows are switched off" in text and "MiB" in text
    assert quartet("inspect", EXAMPLE, "--dot").startswith("digraph")


def test_compare_states_errors_and_keeps_references(quartet, tmp_path, monkeypatch):
    monkeypatch.setenv("QUARTET_CACHE", str(tmp_path / "cache"))
    options = (EXAMPLE, "--resolution", "32x18", "--samples", "2", "--reference-samples", "4", "-o", tmp_path / "out")
    text = quartet("compare", *options)
    assert "Diffuse" in text and "R∞" in text
    results = json.loads((tmp_path / "out" / "cornell-rsm.json").read_text())
    assert 0.5 < results["passes"]["Diffuse Direct"]["R1"]["gain"] < 2.0
    assert len(list((tmp_path / "out").glob("*.png"))) == 2
    kept = sorted((tmp_path / "cache" / "references").glob("*.exr"))
    assert len(kept) == 4
    stamps = [p.stat().st_mtime_ns for p in kept]
    kept[0].write_bytes(b"damaged")
    quartet("compare", *options)
    after = [p.stat().st_mtime_ns for p in sorted((tmp_path / "cache" / "references").glob("*.exr"))]
    assert after[1:] == stamps[1:], "good references are not rendered again"
    assert kept[0].stat().st_size > 100, "a damaged one is"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("render", "nowhere.blend", "-o", "x.png"), "no such file"),
        (("render", "nowhere.npz", "-o", "x.png"), "no such snapshot"),
        (("render", EXAMPLE, "-o", "x.jpg"), ".exr or .png"),
        (("render", EXAMPLE, "--resolution", "12", "-o", "x.png"), "WIDTHxHEIGHT"),
        (("render", EXAMPLE, "--resolution", "0x4", "-o", "x.png"), "no pixels"),
        (("render", EXAMPLE, "--set", "rsm.sampels=3", "-o", "x.png"), "rsm.samples"),
        (("render", EXAMPLE, "--set", "rsm.samples", "-o", "x.png"), "NAME=VALUE"),
        (("render", EXAMPLE, "--technique", "magic", "-o", "x.png"), "none of RSM"),
        (("render", EXAMPLE, "--passes", "Beauty", "-o", "x.exr"), "no pass"),
        (("render", EXAMPLE, "-o", "nowhere/x.png"), "folder"),
        (("render", str(ROOT / "README.md"), "-o", "x.png"), "not scenes"),
    ],
)
def test_mistakes_get_one_line_and_a_failing_exit_code(gl, blender, arguments, message):
    from gi_addon.cli import main

    result = CliRunner().invoke(main, list(arguments))
    assert result.exit_code != 0
    assert message in result.output, result.output
    assert "Traceback" not in result.output


def test_a_damaged_blend_is_said(gl, blender, tmp_path):
    from gi_addon.cli import main

    (tmp_path / "x.blend").write_bytes(b"BLENDER-v999nonsense" * 10)
    result = CliRunner().invoke(main, ["render", str(tmp_path / "x.blend"), "-o", str(tmp_path / "x.png")])
    assert result.exit_code == 1 and "can't be read" in result.output


def test_a_snapshot_of_nothing_renders(quartet, tmp_path):
    scenes.SceneBuilder().build(scenes.perspective((0, -4, 1), (0, 0, 0)), scenes.world((0.5, 0.5, 0.5))).save(tmp_path / "e.npz")
    assert Scene.load(tmp_path / "e.npz").triangle_count() == 0
    quartet("render", tmp_path / "e.npz", "--resolution", "16x9", "-o", tmp_path / "e.png")
