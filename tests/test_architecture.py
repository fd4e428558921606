# SPDX-License-Identifier: GPL-3.0-or-later
"""The rules that hold the house up."""

from __future__ import annotations

import ast
import re
import subprocess
import sys

import pytest
from conftest import ROOT, make

from gi_addon.compare import scenes
from gi_addon.engines import TECHNIQUES
from gi_addon.outputs import OUTPUTS, film_layers
from gi_addon.settings import Settings, walk

PACKAGE = ROOT / "gi_addon"
SHADERS = PACKAGE / "glsl"
_ROLES = ("_vert.glsl", "_frag.glsl", "_geom.glsl", "_comp.glsl", "_test.glsl")


def test_the_core_never_imports_bpy():
    """Only host/, ui.py and functions of __init__.py may; the core runs from a snapshot on any machine."""
    for path in PACKAGE.rglob("*.py"):
        relative = path.relative_to(PACKAGE)
        if relative.parts[0] == "host" or relative.name == "ui.py":
            continue
        tree = ast.parse(path.read_text())
        inside = {id(n) for f in ast.walk(tree) if isinstance(f, ast.FunctionDef) for n in ast.walk(f)}
        for node in ast.walk(tree):
            names = []
            if isinstance(node, ast.Import):
                names = [a.name for a in node.names]
            elif isinstance(node, ast.ImportFrom):
                names = [node.module or ""]
            if any(n.split(".")[0] in ("bpy", "mathutils") for n in names):
                assert id(node) in inside and relative.name == "__init__.py", f"{relative} imports bpy"


def test_the_core_runs_without_bpy_on_the_path():
    """Importing and planning must not pull bpy in through the back door."""
    code = (
        "import sys; sys.modules['bpy'] = None\n"
        "from gi_addon.renderer import inspect\nfrom gi_addon.compare import scenes\n"
        "print(len(inspect(scenes.cornell(), resolution=(64, 36)).run))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 5


@pytest.mark.parametrize("path", sorted(SHADERS.rglob("*.glsl")), ids=lambda p: str(p.relative_to(SHADERS)))
def test_a_shader_files_name_says_its_role(path):
    """Only _vert, _frag, _geom, _comp and _test have main; every file opens with what it is."""
    text = path.read_text()
    # A variant of another stage defines its names anew and includes it.
    has_main = re.search(r"\bvoid\s+main\s*\(|#include \"[^\"]+_(vert|frag|geom|comp)\.glsl\"", text) is not None
    assert has_main == path.name.endswith(_ROLES)
    assert text.startswith("// "), "no header comment"
    assert "#if 0" not in text


@pytest.mark.parametrize("technique", sorted(TECHNIQUES))
def test_every_pass_tells_what_its_resources_are(technique):
    """Names are unique; each texture and buffer says what a texel or element is."""
    seen = {}
    for task in TECHNIQUES[technique](Settings(), film_layers(OUTPUTS)):
        assert task.title
        for write in task.writes:
            assert write.name not in seen, f"{task.title} and {seen.get(write.name)} both write {write.name}"
            assert len(write.doc) > 10
            seen[write.name] = task.title
    assert {"gbuffer.depth", "indirect.diffuse", "direct.diffuse", "film"} <= set(seen)


def test_every_setting_has_help_and_a_range():
    for path, default, meta in walk():
        assert meta.help and meta.label, path
        if isinstance(default, (int, float)) and not isinstance(default, bool):
            assert meta.low is not None and meta.high is not None, path
            assert meta.low <= default <= meta.high, path


def test_a_box_with_one_spot_runs_no_more_than_it_needs(gl):
    """'Model no more than a scene needs': no world, no emission, no glossy lobe, no alpha."""
    result = make(scenes.cornell(blocks=False), samples=1)
    ran = {p.title for p in result.plan.run}
    assert "BRDF Tables" not in ran
    resources = result.plan.resources
    assert not {"gbuffer.emission", "gbuffer.specular", "gbuffer.lobe", "direct.glossy"} & set(resources)
    assert {reason for task, reason in result.plan.skipped if task.title == "BRDF Tables"} == {"no material is glossy"}


@pytest.mark.parametrize("off", ["use_indirect_diffuse", "use_shadows"])
def test_a_switched_off_effect_costs_nothing(gl, off):
    scene = scenes.cornell()
    on, without = make(scene, samples=1), make(scene, samples=1, **{off: False})
    assert len(without.plan.run) < len(on.plan.run)
    assert without.plan.nbytes() < on.plan.nbytes()
    assert any("switched off" in reason for _, reason in without.plan.skipped)


@pytest.mark.parametrize("technique", list(TECHNIQUES))
def test_mirrors_show_lit_surfaces_without_indirect_diffuse_light(gl, technique):
    """A switch takes its own passes away. What is lit by lamps is in mirrors still; what is lit by it may be missing there."""
    scene = scenes.effect("glossy")
    on, off = (
        make(scene, "Diffuse Indirect", "Glossy Indirect", resolution=(32, 18), technique=technique, samples=4,
             use_indirect_diffuse=switch).passes
        for switch in (True, False)
    )  # fmt: skip
    assert not off["Diffuse Indirect"].any()
    assert on["Glossy Indirect"].mean() >= off["Glossy Indirect"].mean() > 0.5 * on["Glossy Indirect"].mean()
