# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels, presets, effects' sources, and Compare with Cycles, without a window."""

from __future__ import annotations

import re
import time
import types
from dataclasses import replace

import numpy as np
import pytest

from gi_addon import presets
from gi_addon.compare import exr, exr_plain, flip, scenes, sheet
from gi_addon.compare.page import number
from gi_addon.effects import RESOURCES, in_effect, needs_of, source_of
from gi_addon.engines import TECHNIQUES
from gi_addon.renderer import render
from gi_addon.settings import Settings, walk


class Layout:
    """Stands in for Blender's layout and writes down what panels draw."""

    def __init__(self):
        self.props, self.texts, self.operators = [], [], []

    def prop(self, data, name, **_):
        assert hasattr(data, name), name
        self.props.append((data, name))

    def label(self, text="", **_):
        self.texts.append(text)

    def separator(self, **_):
        pass

    def operator_menu_enum(self, name, _property, **_):
        self.operators.append(name)

    def operator(self, name, **_):
        self.operators.append(name)
        return types.SimpleNamespace()

    def progress(self, text="", **_):
        self.texts.append(text)

    def _same(self, *_, **__):
        return self

    row = column = box = grid_flow = split = _same


def draw(cls, context):
    """What a panel draws, as a Layout; None where it does not show."""
    if not cls.poll(context):
        return None
    layout = Layout()
    panel = types.SimpleNamespace(layout=layout, group=getattr(cls, "group", ""))
    panel._column = lambda: layout
    cls.draw(panel, context)
    return layout


@pytest.fixture
def context(blender):
    """A context as the properties editor has it."""
    from gi_addon.host.build import build

    scene = build(scenes.cornell())
    scene.render.engine = "QUARTET"
    return types.SimpleNamespace(
        engine="QUARTET", scene=scene, window_manager=blender.context.window_manager, view_layer=scene.view_layers[0],
        object=scene.objects[0], light=None,
    )  # fmt: skip


@pytest.mark.blender
def test_every_setting_is_in_a_panel_once(context):
    """No setting that only scripts reach, for any technique; each technique's own settings show with it alone."""
    from gi_addon import ui

    drawn = []
    for technique in TECHNIQUES:
        context.scene.quartet.technique = technique
        names = []
        for cls in ui._classes:
            layout = draw(cls, context) if hasattr(cls, "draw") and cls is not ui.QUARTET_PT_presets else None
            for data, name in layout.props if layout else ():
                if type(data).__name__.startswith("QuartetSettings"):
                    group = type(data).__name__.removeprefix("QuartetSettings").lstrip("_")
                    names.append(f"{group}.{name}" if group else name)
        assert len(names) == len(set(names)), "a setting is drawn twice"
        others = {t.lower() for t in TECHNIQUES if t != technique}
        assert not others & {n.split(".")[0] for n in names}
        drawn += names
    assert set(drawn) == {path for path, _, _ in walk()}


# For each need of a setting: settings under which it is not met.
_UNMET = {"ssdo.shadows=CONTACT": {"ssdo.shadows": "MAPS"}, "volume.density": {"volume.density": 0.0}}


@pytest.mark.parametrize("path", [p for p, _, _ in walk() if needs_of(p)])
def test_what_is_greyed_out_changes_nothing(gl, path):
    """A setting whose panel greys it out is changed: the picture, AO pass and all, stays bit-identical. Changed again with its
    need met it is not greyed."""
    first = path.split(".")[0].upper()
    base = Settings()
    base.technique = first if first in TECHNIQUES else "RSM"
    base.samples, base.lpv.resolution, base.vct.resolution = 4, 16, 32
    base.rsm.resolution = base.shadows.resolution = base.world.resolution = 64
    assert in_effect(path, base) or any("=" in need or need == "volume.density" for need in needs_of(path))
    for need in needs_of(path):
        off = base.copy()
        for name, value in _UNMET.get(need, {need: False}).items():
            off.set(name, value)
        assert not in_effect(path, off)
        changed = off.copy()
        meta, value = next((m, v) for p, v, m in walk() if p == path)
        if meta.choices:
            changed.set(path, next(c[0] for c in meta.choices if c[0] != value))
        else:
            changed.set(path, not value if isinstance(value, bool) else 2 * value if 2 * value <= meta.high and value else 0.5)
        scene = replace(scenes.effect("glossy"), world=scenes.world((0.3, 0.3, 0.4)))
        pictures = [render(scene, s, ("Combined", "Ambient Occlusion"), resolution=(24, 14)).passes for s in (off, changed)]
        for name in pictures[0]:
            assert np.array_equal(pictures[0][name], pictures[1][name]), (need, name)


@pytest.mark.blender
def test_labels_are_wrapped_between_words(blender):
    from gi_addon.ui import lines

    assert lines("one two three four", 9) == ["one two", "three", "four"]
    assert lines("extraordinarily long", 6) == ["extraordinarily", "long"] and lines("", 5) == []


@pytest.mark.blender
def test_the_technique_panel_says_what_is_wrong(context):
    from gi_addon import ui
    from gi_addon.host import status

    status.failed("final", "there is no OpenGL on this machine")
    try:
        assert "there is no OpenGL on this machine" in " ".join(draw(ui.QUARTET_PT_technique, context).texts)
    finally:
        status.resolved("final")
    assert "no OpenGL" not in " ".join(draw(ui.QUARTET_PT_technique, context).texts)


def test_a_viewport_that_goes_on_does_not_hide_why_a_render_failed():
    """Each kind of picture has its own trouble; opening another file forgets all."""
    from gi_addon.host import status

    status.failed("final", "the camera has no lens")
    status.failed("viewport", "the camera has no lens")
    assert status.problem() == "the camera has no lens"
    status.resolved("viewport")
    assert status.problem() == "the camera has no lens"
    status.resolved("final")
    assert status.problem() == ""
    status.failed("final", "out of memory")
    status.forget()
    assert status.problem() == "" and any("out of memory" in line for line in status.log_lines())


@pytest.mark.blender
def test_the_performance_panel_says_what_ran_and_what_did_not(context, gl, blender):
    """Milliseconds and MiB per pass when asked for, reasons of the passes left out, the driver."""
    from gi_addon import ui
    from gi_addon.host import status

    scene = context.scene
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 48, 27, 100
    scene.quartet.samples = 1
    context.window_manager.quartet.measure = True
    blender.ops.render.render()
    context.window_manager.quartet.measure = False
    report = status.latest["final"]
    assert all(row.milliseconds is not None and row.milliseconds > 0.0 for row in report.rows)
    assert report.mib == pytest.approx(sum(row.mib for row in report.rows), rel=1e-6)
    texts = " ".join(draw(ui.QUARTET_PT_performance, context).texts)
    assert "G-buffers Generation" in texts and "ms" in texts and "MiB" in texts and "OpenGL" in texts
    assert "BRDF Tables: no material is glossy" in texts


@pytest.mark.blender
def test_standard_panels_work_for_the_engine(blender):
    """Lights, world, camera, materials, output, object and scene panels of Blender itself show for Quartet."""
    names = {
        p.__name__ for p in blender.types.Panel.__subclasses__() if "QUARTET" in getattr(p, "COMPAT_ENGINES", ())
    }  # fmt: skip
    assert {
        "DATA_PT_EEVEE_light", "DATA_PT_camera_dof", "EEVEE_MATERIAL_PT_context_material", "EEVEE_MATERIAL_PT_surface",
        "EEVEE_WORLD_PT_surface", "RENDER_PT_color_management", "RENDER_PT_format", "RENDER_PT_output", "DATA_PT_lens",
        "VIEWLAYER_PT_layer", "WORLD_PT_context_world", "RENDER_PT_frame_range",
    } <= names  # fmt: skip
    assert not {"VIEWLAYER_PT_layer_passes", "DATA_PT_light"} & names


@pytest.mark.blender
def test_everything_has_a_tooltip(blender):
    """Every setting, every property of the panels and every operator of ours tells what it does."""
    from gi_addon.host import properties

    groups = [*properties._classes, *properties._window_class]
    silent = [
        f"{group.__name__}.{p.identifier}" for group in groups for p in group.bl_rna.properties
        if p.type != "POINTER" and p.identifier not in ("name", "rna_type") and not p.description
    ]  # fmt: skip
    operators = [getattr(blender.ops.quartet, name).get_rna_type() for name in dir(blender.ops.quartet)]
    silent += [operator.identifier for operator in operators if not operator.description]
    assert len(groups) > 5 and len(operators) > 5 and not silent


@pytest.mark.blender
def test_the_operators_are_in_the_render_menu(blender, context):
    """Where Blender's search finds them, for this engine only."""
    from gi_addon import ui

    assert ui._render_menu in blender.types.TOPBAR_MT_render.draw._draw_funcs
    found = {}
    for engine in ("QUARTET", "CYCLES"):
        layout = Layout()
        ui._render_menu(types.SimpleNamespace(layout=layout), types.SimpleNamespace(engine=engine))
        found[engine] = layout.operators
    assert found == {"QUARTET": ["quartet.compare", "quartet.open_page", "quartet.split_view", "quartet.preset"], "CYCLES": []}


@pytest.mark.blender
def test_the_users_presets_are_kept_and_applied(blender, context, tmp_path, monkeypatch):
    """Blender's own preset menu: added by name, applied, removed."""
    import bpy

    def resource(kind, path="", create=False):
        (tmp_path / path).mkdir(parents=True, exist_ok=True)
        return str(tmp_path / path)

    monkeypatch.setattr(bpy.utils, "user_resource", resource)
    monkeypatch.setattr(bpy.utils, "is_path_extension", lambda path: False, raising=False)
    settings = bpy.context.scene.quartet
    settings.samples, settings.rsm.samples = 7, 77
    assert bpy.ops.quartet.add_preset(name="Mine") == {"FINISHED"}
    (path,) = tmp_path.rglob("*.py")
    settings.samples, settings.rsm.samples = 1, 10
    assert bpy.ops.script.execute_preset(filepath=str(path), menu_idname="QUARTET_MT_presets") == {"FINISHED"}
    assert (settings.samples, settings.rsm.samples) == (7, 77)


@pytest.mark.blender
def test_a_preset_sets_the_scene(context, blender):
    from gi_addon.host import properties

    assert blender.ops.quartet.preset(preset="FINAL") == {"FINISHED"}
    scene = blender.context.scene
    assert (scene.quartet.samples, scene.quartet.bounces) == (16, 4)
    settings = properties.read(scene)
    for path, value in presets.apply(Settings(), "FINAL").as_dict().items():
        if path != "technique":
            assert settings.get(path) == (pytest.approx(value) if isinstance(value, float) else value), path


def test_presets_hold_valid_values():
    """Every value fits its setting; the four differ; what a preset names beyond this build belongs to a technique that
    another build has."""
    known = {path for path, _, _ in walk()}
    outcomes = {name: tuple(presets.apply(Settings(), name).as_dict().items()) for name in presets.PRESETS}
    assert len(set(outcomes.values())) == 4
    for preset in presets.PRESETS.values():
        for path in preset.values:
            assert path in known or path.split(".")[0] in ("lpv", "vct", "ssdo"), path


def test_the_paper_preset_leaves_nothing_behind():
    """Every preset of ours names what the paper's changes."""
    for name, preset in presets.PRESETS.items():
        assert name == "PAPER" or set(presets.PRESETS["PAPER"].values) <= set(preset.values), name


@pytest.mark.parametrize("technique", sorted(TECHNIQUES))
def test_every_effect_names_its_source(technique):
    """From the passes themselves: an own or a shared pass that is really there, or why there is none."""
    from gi_addon.outputs import OUTPUTS, film_layers

    titles = [task.title for task in TECHNIQUES[technique](Settings(), film_layers(OUTPUTS))]
    for effect in RESOURCES:
        source = source_of(technique, effect)
        assert (source.kind == "none") == (not any(source.text.startswith(title) for title in titles)), effect
    assert source_of(technique, "use_indirect_diffuse").kind == "own"
    assert source_of(technique, "use_shadows").kind != "none"


@pytest.mark.blender
def test_compare_with_cycles_gives_numbers_pictures_and_a_page(context, gl, blender, tmp_path, monkeypatch):
    """Another process renders both engines; the numbers are those of a lit box: direct light right within 5 % and far
    better than a constant. Each view is an image of the right size. The page holds scores, pictures, times and settings,
    and fetches nothing."""
    from gi_addon.host import comparison

    monkeypatch.setenv("QUARTET_CACHE", str(tmp_path))
    scene = context.scene
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 96, 54, 100
    scene.quartet.samples = 4
    window = blender.context.window_manager.quartet
    window.reference, window.reference_samples, window.compare_percentage = "R1", 16, 50
    assert blender.ops.quartet.compare() == {"FINISHED"}
    assert comparison.running is None
    outcome = comparison.latest
    assert 0.95 < outcome.scores["Diffuse Direct"].gain < 1.05
    assert outcome.scores["Diffuse Direct"].rel_mse < outcome.scores["Diffuse Direct"].constant / 5.0
    assert 0.0 < outcome.scores["Combined"].flip < 1.0
    image = blender.data.images[comparison.IMAGE]
    for view, width in (("SIDES", 2 * 48 + 4), ("WIPE", 48), ("DIFFERENCE", 48), ("FLIP", 48)):
        window.compare_view = view
        assert tuple(image.size) == (width, 27)
    shown = np.empty(48 * 27 * 4, "f4")
    image.pixels.foreach_get(shown)
    flips = outcome.pictures[window.compare_pass, "flip"]
    assert np.allclose(shown.reshape(27, 48, 4)[..., 0], flips, atol=1e-6)
    assert outcome.page.parent == tmp_path / "reports"
    text = outcome.page.read_text(encoding="utf-8")
    for name, score in outcome.scores.items():
        assert f"<td>{name}</td>" in text and number(score.rel_mse) in text
    assert text.count("data:image/png;base64,") >= 4 * len(outcome.scores)
    assert "<td class=text>samples</td><td class=text>4</td>" in text and "G-buffers Generation" in text and " ms</text>" in text
    assert not re.search(r"""(src|href)=["']?(?!data:)\w""", text)


@pytest.mark.blender
def test_a_render_region_is_compared_alone(context, gl, blender, tmp_path, monkeypatch):
    """A quarter of the picture: only its pixels count, black around them would thin every error out."""
    from gi_addon.host import comparison

    monkeypatch.setenv("QUARTET_CACHE", str(tmp_path))
    render = context.scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = 96, 54, 100
    render.use_border, render.use_crop_to_border = True, False
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.25, 0.75, 0.5, 1.0
    context.scene.quartet.samples = 1
    window = blender.context.window_manager.quartet
    window.reference, window.reference_samples, window.compare_percentage = "R1", 4, 100
    assert blender.ops.quartet.compare() == {"FINISHED"}
    reference = comparison.latest.pictures["Combined", "reference"]
    assert reference.shape == (27, 48, 3)
    assert 0.9 < comparison.latest.scores["Diffuse Direct"].gain < 1.1
    assert (reference[:, [0, -1]].sum(axis=-1) > 0.0).mean() > 0.5
    assert not render.use_crop_to_border


def test_png_files_hold_every_pixel():
    """Written by hand, read by an imaging library: the same bytes."""
    import io

    from PIL import Image

    rgb = np.random.default_rng(3).integers(0, 256, (7, 13, 3), np.uint8)
    assert np.array_equal(np.asarray(Image.open(io.BytesIO(sheet.png(rgb)))), rgb)


@pytest.mark.blender
def test_a_comparison_that_fails_says_why(context, blender):
    scene = context.scene
    scene.camera = None
    with pytest.raises(RuntimeError, match="no camera"):
        blender.ops.quartet.compare()


def _pair():
    """A patchwork over three stops and a copy with an offset and grain."""
    rng = np.random.default_rng(7)
    reference = np.kron(rng.random((5, 8, 3)), np.ones((9, 9, 1))) ** 2 * (3.0, 1.0, 0.5)
    return (reference * 1.1 + 0.05 * rng.random(reference.shape)).astype("f4"), reference.astype("f4")


def test_flip_is_the_authors_own():
    """Against the flip-evaluator package: the mean within 1e-3, every pixel within .02 (its white point has other last
    digits than ours)."""
    evaluator = pytest.importorskip("flip_evaluator")
    test, reference = _pair()
    for kind, ours, (a, b) in (
        ("HDR", flip.hdr_flip_map, (test, reference)),
        ("LDR", flip.ldr_flip_map, (np.clip(test, 0, 1), np.clip(reference, 0, 1))),
    ):
        errors, mean, _ = evaluator.evaluate(
            b, a, kind, inputsRGB=False, applyMagma=False, computeMeanError=True, parameters={"ppd": 67.0}
        )
        result = ours(a, b)
        assert result.mean() == pytest.approx(mean, abs=1e-3)
        assert np.abs(result - np.asarray(errors).reshape(result.shape)).max() < 0.02


def test_flip_of_the_same_picture_is_nothing():
    _, reference = _pair()
    assert np.abs(flip.hdr_flip_map(reference, reference)).max() == 0.0


@pytest.mark.parametrize("compression", ["NO_COMPRESSION", "ZIPS_COMPRESSION", "ZIP_COMPRESSION"])
def test_exr_files_are_read_without_their_package(tmp_path, compression):
    """Bit for bit, with a height that fills no whole block."""
    package = pytest.importorskip("OpenEXR")
    rng = np.random.default_rng(3)
    channels = {name: rng.standard_normal((37, 23)).astype(kind) for name, kind in
                (("Layer.Combined.R", "f4"), ("Layer.Combined.G", "f4"), ("Layer.Depth.Z", "f4"), ("half", "f2"))}  # fmt: skip
    path = tmp_path / "x.exr"
    header = {"compression": getattr(package, compression), "type": package.scanlineimage}
    package.File(header, dict(channels)).write(str(path))
    read = exr_plain.read_channels(path)
    assert set(read) == set(channels)
    for name, values in channels.items():
        assert read[name].dtype == values.dtype and np.array_equal(read[name], values)


def test_a_damaged_exr_file_is_an_error(tmp_path):
    path = tmp_path / "x.exr"
    exr.write(path, {"Combined": np.ones((4, 5, 4), "f4")})
    whole = path.read_bytes()
    for cut in (0, 3, 40, len(whole) // 2, len(whole) - 3):
        path.write_bytes(whole[:cut])
        with pytest.raises(exr_plain.EXRError):
            exr_plain.read_channels(path)


@pytest.mark.blender
def test_a_multilayer_file_of_blender_is_read_alike(context, gl, monkeypatch):
    """What Blender writes comes out the same with and without the package."""
    from gi_addon.host.cycles import render_passes

    scene = context.scene
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 40, 30, 100
    scene.quartet.samples = 1
    names = ("Combined", "Depth", "Normal", "Diffuse Indirect")
    with_package = render_passes(scene, names)
    monkeypatch.setattr(exr.importlib.util, "find_spec", lambda name: None)
    without = render_passes(scene, names)
    assert set(names) <= set(without)
    for name in names:
        assert np.array_equal(with_package[name], without[name]), name


def thumbnail(data) -> np.ndarray:
    """(H, W, 4) of the thumbnail that Blender has Quartet render of a material or a light."""
    data.asset_generate_preview()
    preview = data.preview_ensure()
    for _ in range(600):  # the preview job runs beside
        if any(preview.image_pixels_float):
            break
        time.sleep(0.05)
    width, height = preview.image_size
    return np.array(preview.image_pixels_float).reshape(height, width, 4)


@pytest.mark.blender
def test_thumbnails_show_the_material(context, gl, blender):
    """Blender's preview scene rendered by Quartet: a red ball is red, in the middle, before something else."""
    material = blender.data.materials.new("Red")
    from gi_addon.host.compat import node_tree

    node_tree(material).nodes["Principled BSDF"].inputs["Base Color"].default_value = (0.8, 0.02, 0.02, 1.0)
    blender.context.scene.render.engine = "QUARTET"
    pixels = thumbnail(material)
    red, green, _, alpha = pixels[pixels.shape[0] // 2, pixels.shape[1] // 2]
    assert alpha > 0.9 and red > 0.1 and red > 1.5 * green


@pytest.mark.blender
def test_a_lights_thumbnail_is_cycles_own(context, gl, blender):
    """A green lamp of 10 W: the thumbnail's mean colour, after the view transform, is that of Cycles' within 2 %."""
    means = {}
    for engine in ("QUARTET", "CYCLES"):
        blender.context.scene.render.engine = engine
        lamp = blender.data.lights.new(engine, "POINT")
        lamp.energy, lamp.color = 10.0, (0.0, 1.0, 0.0)
        means[engine] = thumbnail(lamp)[..., :3].mean(axis=(0, 1))
    assert means["CYCLES"][1] > 0.1
    assert np.abs(means["QUARTET"] - means["CYCLES"]).max() < 0.02 * means["CYCLES"][1]
