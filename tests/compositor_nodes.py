# SPDX-License-Identifier: GPL-3.0-or-later
"""Build compositor trees of Quartet's passes, in 5.x's node groups and in 4.5's node tree of the scene. Also imported by scripts
that run in the real Blender: nothing here needs pytest."""

from __future__ import annotations

import bpy

from gi_addon.host.compat import node_tree, pass_name
from gi_addon.outputs import OUTPUTS

FIVE = bpy.app.version >= (5, 0, 0)
LOBES = ("Diffuse", "Glossy", "Transmission")
ALONE = ("Emission", "Environment", "Volume Direct")
PARTS = [f"{lobe} {kind}" for lobe in LOBES for kind in ("Direct", "Indirect", "Color")] + list(ALONE)
# A colour that the composed picture is multiplied by: so it can't be the render as it was.
TINT = (0.5, 1.0, 2.0)


def paint(scene):
    """Make the scene's objects glossy, glass and shining by turns, so that every pass has light."""
    meshes = [o for o in scene.objects if o.type == "MESH"]
    for k, o in enumerate(meshes[-2:]):
        material = bpy.data.materials.new("Painted")
        node = node_tree(material).nodes["Principled BSDF"]
        node.inputs["Roughness"].default_value = 0.2
        node.inputs["Transmission Weight"].default_value = float(k)
        node.inputs["Emission Color"].default_value = (0.2, 0.4, 0.1, 1.0)
        node.inputs["Emission Strength"].default_value = 0.5 * (1 - k)
        o.data.materials.clear()
        o.data.materials.append(material)


def compositor(scene):
    """A fresh tree that is the scene's compositor, and its node of the render layer."""
    if FIVE:
        tree = scene.compositing_node_group = bpy.data.node_groups.new("Compositor", "CompositorNodeTree")
    else:
        scene.use_nodes = True
        tree = scene.node_tree
        tree.nodes.clear()
    layers = tree.nodes.new("CompositorNodeRLayers")
    layers.scene = scene
    return tree, layers


def without_compositor(scene):
    """Take the compositor out of the scene."""
    if FIVE:
        scene.compositing_node_group = None
    else:
        scene.use_nodes = False


def result(tree, socket):
    """Make ``socket`` the composite picture."""
    if FIVE:
        tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    node = tree.nodes.new("NodeGroupOutput" if FIVE else "CompositorNodeComposite")
    tree.links.new(socket, node.inputs[0])


def mix(tree, kind, a, b):
    """Sockets ``a`` and ``b`` added or multiplied; ``b`` may be a colour."""
    node = tree.nodes.new("ShaderNodeMix" if FIVE else "CompositorNodeMixRGB")
    node.blend_type = kind
    if FIVE:
        node.data_type = "RGBA"
    factor, *sockets, out = (*(node.inputs[i] for i in ((0, 6, 7) if FIVE else (0, 1, 2))), node.outputs[2 if FIVE else 0])
    factor.default_value = 1.0
    for source, target in zip((a, b), sockets, strict=True):
        if isinstance(source, tuple):
            target.default_value = (*source, 1.0)
        else:
            tree.links.new(source, target)
    return out


def want(view_layer, names):
    """Switch passes on by their names."""
    for name in names:
        owner, _, flag = OUTPUTS[name].flag.rpartition(".")
        setattr(getattr(view_layer, owner) if owner else view_layer, flag, True)


def socket(layers, name):
    """The render layer's socket of a pass, whatever this Blender calls it."""
    return layers.outputs[pass_name(OUTPUTS[name])]


def light_by_passes(tree, layers):
    """Combined put together again from ``PARTS``: Σ (direct + indirect) × colour + what stands alone."""
    terms = [socket(layers, name) for name in ALONE]
    for lobe in LOBES:
        light = mix(tree, "ADD", socket(layers, f"{lobe} Direct"), socket(layers, f"{lobe} Indirect"))
        terms.append(mix(tree, "MULTIPLY", light, socket(layers, f"{lobe} Color")))
    total = terms[0]
    for term in terms[1:]:
        total = mix(tree, "ADD", total, term)
    return total


def exr_file(scene, path):
    """Let the scene write its picture to ``path`` as a 32-bit EXR, through the compositor."""
    image = scene.render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "IMAGE"
    image.file_format, image.color_depth, image.color_mode = "OPEN_EXR", "32", "RGBA"
    scene.render.filepath, scene.render.use_file_extension = str(path), False
    scene.render.use_compositing = True
