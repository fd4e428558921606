# SPDX-License-Identifier: GPL-3.0-or-later
"""What materials ask of the object they are on, and objects that are a volume, against Cycles."""

from __future__ import annotations

import numpy as np
import pytest
from test_materials import agree, cube, material_of, plane

from gi_addon.materials import compile_surface

pytestmark = pytest.mark.blender
COLORS = ((0.8, 0.1, 0.1), (0.1, 0.7, 0.2), (0.1, 0.2, 0.8))


def coloured_by(bpy, kind, name):
    """A diffuse material whose colour is an attribute."""

    def connect(tree, output):
        attribute, shader = tree.nodes.new("ShaderNodeAttribute"), tree.nodes.new("ShaderNodeBsdfDiffuse")
        attribute.attribute_type, attribute.attribute_name = kind, name
        tree.links.new(attribute.outputs["Color"], shader.inputs["Color"])
        tree.links.new(shader.outputs[0], output.inputs["Surface"])

    return material_of(bpy, connect)


@pytest.mark.parametrize("name", ["tint", "color"])
def test_an_attribute_of_the_object_is_its_custom_or_own_property(blender, gl, name):
    """One material on three objects, with a colour of each one's own; one program serves all."""
    from gi_addon.host.sync import SceneSync

    scene = plane(blender)
    material = coloured_by(blender, "OBJECT", name)
    for x, color in zip((-1.2, 0.0, 1.2), COLORS, strict=True):
        obj = cube(blender, scene, (x, 0.0, 0.5), 0.9, material)
        obj["tint"], obj.color = color, (*color, 1.0)
    agree(f"object {name}", scene, ("Diffuse Color",))
    worn = [m for m in SceneSync().read(blender.context.evaluated_depsgraph_get()).materials if m.name == material.name]
    assert len(worn) == 3 and len({compile_surface(m.graph).glsl for m in worn}) == 1


def test_an_instance_takes_the_attribute_of_its_instancer_and_the_scene_gives_its_own(blender, gl):
    bpy = blender
    scene = plane(bpy)
    child = cube(bpy, scene, (0.0, 0.0, 0.0), 0.5, coloured_by(bpy, "INSTANCER", "tint"))
    bpy.ops.mesh.primitive_plane_add(size=2.0, location=(0.0, 0.0, 0.3))
    parent = bpy.context.object
    parent["tint"], parent.instance_type, parent.show_instancer_for_render = COLORS[1], "VERTS", False
    child.parent = parent
    scene["tint"] = COLORS[2]
    cube(bpy, scene, (0.0, 0.0, 0.5), 0.6, coloured_by(bpy, "VIEW_LAYER", "tint"))
    agree("instancer", scene, ("Diffuse Color",))


def test_geometry_nodes_give_each_instance_its_own_attribute_and_random_number(blender, gl):
    """Coloured by an attribute of the instances in one half, by Object Info's Random in the other; two materials serve all."""
    from gi_addon.host.sync import SceneSync

    bpy = blender
    scene = plane(bpy)
    child = cube(bpy, scene, (0.0, 0.0, -9.0), 0.4, coloured_by(bpy, "INSTANCER", "tint"))
    tree = child.data.materials[0].node_tree
    info, mix = tree.nodes.new("ShaderNodeObjectInfo"), tree.nodes.new("ShaderNodeMixRGB")
    attribute, shader = tree.nodes["Attribute"], tree.nodes["Diffuse BSDF"]
    tree.links.new(attribute.outputs["Color"], mix.inputs["Color1"])
    tree.links.new(info.outputs["Random"], mix.inputs["Color2"])
    tree.links.new(mix.outputs["Color"], shader.inputs["Color"])
    bpy.ops.mesh.primitive_plane_add(size=1.0, location=(0.0, 0.0, 0.3))
    nodes = bpy.data.node_groups.new("Instances", "GeometryNodeTree")
    nodes.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    new, end = nodes.nodes.new, nodes.nodes.new("NodeGroupOutput")
    grid, place, store = new("GeometryNodeMeshGrid"), new("GeometryNodeInstanceOnPoints"), new("GeometryNodeStoreNamedAttribute")
    source, number = new("GeometryNodeObjectInfo"), new("FunctionNodeRandomValue")
    for socket, value in zip(grid.inputs, (3.0, 2.0, 4, 3), strict=False):
        socket.default_value = value
    source.inputs["Object"].default_value = child
    store.data_type, store.domain, number.data_type = "FLOAT_COLOR", "INSTANCE", "FLOAT_VECTOR"
    store.inputs["Name"].default_value = "tint"
    links = nodes.links.new
    links(grid.outputs["Mesh"], place.inputs["Points"])
    links(source.outputs["Geometry"], place.inputs["Instance"])
    links(place.outputs[0], store.inputs["Geometry"])
    links(number.outputs[0], next(i for i in store.inputs if i.name == "Value" and i.enabled))
    links(store.outputs[0], end.inputs[0])
    bpy.context.object.modifiers.new("Instances", "NODES").node_group = nodes
    agree("instances", scene, ("Diffuse Color",))
    worn = SceneSync().read(blender.context.evaluated_depsgraph_get())
    assert len({m for used in worn.instances.materials for m in used}) == 3 and len(worn.instances) >= 12


def test_pointiness_is_cycles(blender, gl):
    """Sharp, hollow and flat places of a bent grid."""
    bpy = blender
    scene = plane(bpy)
    bpy.ops.mesh.primitive_monkey_add(size=2.0, location=(0.0, 0.0, 1.0))

    def connect(tree, output):
        geometry, spread = tree.nodes.new("ShaderNodeNewGeometry"), tree.nodes.new("ShaderNodeMapRange")
        shader = tree.nodes.new("ShaderNodeBsdfDiffuse")
        spread.inputs["From Min"].default_value, spread.inputs["From Max"].default_value = 0.4, 0.6
        tree.links.new(geometry.outputs["Pointiness"], spread.inputs["Value"])
        tree.links.new(spread.outputs[0], shader.inputs["Color"])
        tree.links.new(shader.outputs[0], output.inputs["Surface"])

    bpy.context.object.data.materials.append(material_of(bpy, connect))
    test, _ = agree("pointiness", scene, ("Diffuse Color",), rel_mse=0.01)
    assert np.abs(test["Diffuse Color"] - 0.5).max() > 0.4, "no contrast: nothing was tested"


@pytest.mark.parametrize("kind", ["ShaderNodeVolumeScatter", "ShaderNodeVolumeAbsorption"])
def test_a_cube_of_a_volume_scatters_and_absorbs_within_itself(blender, gl, kind):
    """Its hull is not seen; what is behind it shines through, and it shades the ground."""

    def connect(tree, output):
        volume = tree.nodes.new(kind)
        volume.inputs["Density"].default_value = 0.8
        volume.inputs["Color"].default_value = (0.9, 0.6, 0.3, 1.0)
        tree.links.new(volume.outputs[0], output.inputs["Volume"])

    scene = plane(blender)
    cube(blender, scene, (0.0, 0.0, 0.75), 1.5, material_of(blender, connect))
    # Cycles' first bounce inside the volume is the light scattered once.
    agree(kind, scene, ("Combined",), samples=256, bounces=1, rel_mse=0.03, gain=0.03)


def test_several_volumes_turned_boxes_and_balls_each_fill_their_own_place(blender, gl):
    """A box on its corner and a ball that touches it, of different stuff."""

    def filled_with(density, color):
        def connect(tree, output):
            volume = tree.nodes.new("ShaderNodeVolumeScatter")
            volume.inputs["Density"].default_value, volume.inputs["Color"].default_value = density, (*color, 1.0)
            tree.links.new(volume.outputs[0], output.inputs["Volume"])

        return material_of(blender, connect)

    scene = plane(blender)
    box = cube(blender, scene, (-0.7, 0.0, 1.0), 1.0, filled_with(0.9, (0.9, 0.7, 0.5)))
    box.rotation_euler, box.scale = (0.5, 0.6, 0.4), (1.4, 0.8, 1.0)
    blender.ops.mesh.primitive_uv_sphere_add(radius=0.8, location=(0.6, 0.0, 1.0))
    blender.context.object.data.materials.append(filled_with(1.5, (0.3, 0.6, 0.9)))
    agree("volumes", scene, ("Volume Direct", "Diffuse Direct"), samples=256, bounces=1, rel_mse=0.03, gain=0.03)
