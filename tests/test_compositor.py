# SPDX-License-Identifier: GPL-3.0-or-later
"""Quartet's passes in Blender's compositor.

The sum that is tested is the one that users build for Cycles: (direct + indirect light) × colour for diffuse, glossy and
transmission, and emission, environment and volume. It is Combined, so that the compositor's own answer tells whether every pass
arrived whole, in its place and the right way up.
"""

from __future__ import annotations

import numpy as np
import pytest
from conftest import ROOT
from real_blender import run_window
from test_blender import put

from gi_addon.compare import scenes


def rendered(scene, path):
    """Render as F12 does and read the file that the compositor's picture went to: (height, width, 3)."""
    import bpy
    from compositor_nodes import exr_file

    from gi_addon.compare import exr
    from gi_addon.host.cycles import quiet

    exr_file(scene, path)
    with quiet():
        bpy.ops.render.render(write_still=True, scene=scene.name)
    return exr.read(path)["Combined"][..., :3]


@pytest.fixture
def scene(blender):
    """A Cornell box with a shining glossy and a glass block; its compositor is taken out at the end."""
    from compositor_nodes import paint, without_compositor

    made = put(blender, scenes.cornell(), samples=4)
    paint(made)
    yield made
    without_compositor(made)


@pytest.mark.blender
def test_light_put_together_from_its_passes_is_combined(scene, gl, tmp_path):
    """Σ (direct + indirect) × colour + emission + environment + volume in the compositor, tinted there, is the tinted render.

    A pass is light over colour in 32 bits, so that the product is back within rounding; 1e-3 of the brightest leaves room
    for the compositor's half-float buffers (11 bits, 5e-4)."""
    from compositor_nodes import PARTS, TINT, compositor, light_by_passes, mix, result, want

    plain = rendered(scene, tmp_path / "plain.exr")
    want(scene.view_layers[0], PARTS)
    tree, layers = compositor(scene)
    result(tree, mix(tree, "MULTIPLY", light_by_passes(tree, layers), TINT))
    composed = rendered(scene, tmp_path / "composed.exr")
    assert plain.max() > 0.1
    assert np.abs(composed - plain * TINT).max() <= 1e-3 * (plain * TINT).max()


@pytest.mark.blender
def test_the_denoise_node_takes_our_normals_and_albedo(scene, gl, tmp_path):
    """Guided by Quartet's own passes it smooths and keeps all light: the mean stays within 2 %, and the picture within a
    tenth of its mean."""
    from compositor_nodes import compositor, result, socket, want

    plain = rendered(scene, tmp_path / "plain.exr")
    want(scene.view_layers[0], ["Normal", "Diffuse Color"])
    tree, layers = compositor(scene)
    node = tree.nodes.new("CompositorNodeDenoise")
    for name, place in (("Combined", "Image"), ("Normal", "Normal"), ("Diffuse Color", "Albedo")):
        tree.links.new(layers.outputs["Image"] if name == "Combined" else socket(layers, name), node.inputs[place])
    result(tree, node.outputs["Image"])
    smooth = rendered(scene, tmp_path / "smooth.exr")
    assert np.abs(smooth - plain).max() > 0.0
    assert smooth.mean() == pytest.approx(plain.mean(), rel=0.02)
    assert np.abs(smooth - plain).mean() < 0.1 * plain.mean()


@pytest.mark.blender
def test_a_file_output_node_writes_our_passes(scene, gl, tmp_path):
    """What the node writes of Depth and Diffuse Indirect is what a multilayer file of the render has."""
    from compositor_nodes import FIVE, compositor, result, socket, want

    from gi_addon.compare import exr
    from gi_addon.host.cycles import render_passes

    names = ["Depth", "Diffuse Indirect"]
    expected = render_passes(scene, names)
    want(scene.view_layers[0], names)
    tree, layers = compositor(scene)
    result(tree, layers.outputs["Image"])
    node = tree.nodes.new("CompositorNodeOutputFile")
    if FIVE:
        node.format.media_type = "MULTI_LAYER_IMAGE"
        node.directory, node.file_name = str(tmp_path), "node"
        for name, kind in zip(names, ("FLOAT", "RGBA"), strict=True):
            node.file_output_items.new(kind, name)
    node.format.file_format, node.format.color_depth = "OPEN_EXR_MULTILAYER", "32"
    if not FIVE:
        node.base_path = str(tmp_path / "node")
        node.layer_slots.clear()
        for name in names:
            node.layer_slots.new(name)
    for name in names:
        tree.links.new(socket(layers, name), node.inputs[name])
    rendered(scene, tmp_path / "picture.exr")
    written = exr.read(next(tmp_path.glob("node*")))
    for name in names:
        assert np.array_equal(written[name][..., : expected[name].shape[-1]], expected[name]), name


@pytest.mark.blender
def test_passes_that_quartet_has_not_do_not_break_the_compositor(scene, gl, tmp_path):
    """Cycles' light groups, Cryptomatte and custom passes stay switched on in a file that is changed to Quartet: there are no
    such passes, a Cryptomatte node finds nothing, and the picture is the same."""
    from compositor_nodes import TINT, compositor, mix, result

    plain = rendered(scene, tmp_path / "plain.exr")
    layer = scene.view_layers[0]
    layer.lightgroups.add(name="Key")
    layer.use_pass_cryptomatte_object = layer.use_pass_cryptomatte_material = True
    layer.use_pass_vector = layer.use_pass_mist = layer.use_pass_position = True
    layer.aovs.add().name = "Mask"
    tree, layers = compositor(scene)
    matte = tree.nodes.new("CompositorNodeCryptomatteV2")
    matte.source, matte.scene = "RENDER", scene
    tree.links.new(layers.outputs["Image"], matte.inputs["Image"])
    tree.links.new(matte.outputs["Matte"], tree.nodes.new("CompositorNodeViewer").inputs[0])
    result(tree, mix(tree, "MULTIPLY", layers.outputs["Image"], TINT))
    names = {s.name for s in layers.outputs if s.enabled}
    assert not any("Crypto" in name or name in ("Combined_Key", "Mask", "Mist", "Vector") for name in names), names
    composed = rendered(scene, tmp_path / "same.exr")
    assert np.abs(composed - plain * TINT).max() <= 1e-3 * (plain * TINT).max()


@pytest.mark.realblender
def test_f12_in_the_window_composes_the_passes(tmp_path):
    """F12 in a window renders and composes on the job thread: the tinted sum of the passes is the tinted picture."""
    answer = run_window(
        f"""
sys.path.append({str(ROOT / "tests")!r})
def steps():
    from compositor_nodes import PARTS, TINT, compositor, exr_file, light_by_passes, mix, paint, result, want
    scene = studio()
    paint(scene)
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 96, 54, 100
    scene.quartet.samples = 2
    done, found = [], dict(tint=TINT)
    bpy.app.handlers.render_complete.append(lambda *_: done.append(True))
    def pixels(name):
        path = {str(tmp_path)!r} + "/" + name + ".exr"
        exr_file(scene, path)
        done.clear()
        bpy.ops.render.render("INVOKE_DEFAULT", write_still=True)
        def finished():
            return bool(done)
        yield finished
        yield 0.3
        found[name] = list(bpy.data.images.load(path).pixels)
    yield from pixels("plain")
    want(bpy.context.view_layer, PARTS)
    tree, layers = compositor(scene)
    result(tree, mix(tree, "MULTIPLY", light_by_passes(tree, layers), TINT))
    yield from pixels("composed")
    report(**found)
""",
        tmp_path,
        size="640x440",
    )
    plain, composed = (np.array(answer[name]).reshape(54, 96, 4)[..., :3] for name in ("plain", "composed"))
    assert plain.max() > 0.1
    assert np.abs(composed - plain * answer["tint"]).max() <= 1e-3 * (plain * answer["tint"]).max()
