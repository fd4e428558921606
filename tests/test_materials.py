# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes as artists make them, against Cycles: alpha, visibility, lenses, moving things, lights, strange geometry."""

from __future__ import annotations

import math

import numpy as np
import pytest
from conftest import pictures_to
from test_blender import cycles, diffuse, put, quartet, tree_of

from gi_addon.compare import scenes
from gi_addon.compare.metrics import score
from gi_addon.frame import lens_point
from gi_addon.materials import mean_emission
from gi_addon.scene import Camera, Link, Node, ShaderGraph

pytestmark = pytest.mark.blender
SIZE = (64, 36)


def plane(bpy, size=SIZE, samples=16, light=None):
    """A plane under a sun, and its scene."""
    scene = put(bpy, scenes.plane_scene(light or scenes.sun_light((0.3, 0.5, -1.0), 3.0)), size=size, samples=samples)
    return scene


def cube(bpy, scene, location=(0.0, 0.0, 0.5), size=1.0, material=None):
    bpy.ops.mesh.primitive_cube_add(size=size, location=location)
    obj = bpy.context.object
    obj.data.materials.append(material or diffuse(bpy, "C", (0.8, 0.3, 0.1)))
    return obj


def material_of(bpy, connect):
    """A material whose tree ``connect(tree, output)`` fills."""
    material = bpy.data.materials.new("M")
    tree = tree_of(material)
    tree.nodes.clear()
    connect(tree, tree.nodes.new("ShaderNodeOutputMaterial"))
    return material


def agree(name, scene, passes, samples=48, bounces=0, rel_mse=0.02, gain=0.03, **looser):
    """Render with both and compare; returns both."""
    test, reference = quartet(scene, *passes), cycles(scene, *passes, samples=samples, bounces=bounces)
    for p in passes:
        t, r = test[p][..., :3], reference[p][..., :3]
        s = score(t, r)
        pictures_to("materials", f"{name}-{p}", test=t, reference=r)
        assert abs(s.gain - 1.0) <= looser.get("gain_of", {}).get(p, gain), f"{p}: {s.text()}"
        assert s.rel_mse <= looser.get("rel_mse_of", {}).get(p, rel_mse), f"{p}: {s.text()}"
    return test, reference


# --- what is seen -----------------------------------------------------------------------------------------------------


def test_alpha_is_coverage_in_picture_and_shadow(blender, gl):
    """A half transparent box, and a tinted one: what shines through, and the shade they throw."""
    scene = plane(blender, samples=48)

    def half(tree, out):
        mix, a, b = (tree.nodes.new("ShaderNode" + k) for k in ("MixShader", "BsdfTransparent", "BsdfDiffuse"))
        mix.inputs[0].default_value = 0.4
        a.inputs[0].default_value = (1.0, 1.0, 1.0, 1.0)
        for k, node in ((1, a), (2, b)):
            tree.links.new(node.outputs[0], mix.inputs[k])
        tree.links.new(mix.outputs[0], out.inputs[0])

    cube(blender, scene, material=material_of(blender, half))
    agree("alpha", scene, ("Diffuse Color", "Diffuse Direct"), rel_mse_of={"Diffuse Direct": 0.05})


def test_many_coloured_panes_tint_as_in_cycles_at_few_subframes(blender, gl):
    """Twelve panes that refract red alone: no sub-frame is brighter than the world behind them. (By the mean of the channels the
    red tint was 3 in a third of the sub-frames, and 3^12 where twelve of them met.)"""
    bpy = blender
    scene = plane(bpy, samples=4)
    scene.world = bpy.data.worlds.new("Sky")
    tree_of(scene.world).nodes["Background"].inputs["Color"].default_value = (0.5, 0.5, 0.5, 1.0)

    def connect(tree, output):
        glass = tree.nodes.new("ShaderNodeBsdfRefraction")
        glass.inputs["Color"].default_value, glass.inputs["IOR"].default_value = (1.0, 0.05, 0.05, 1.0), 1.0
        tree.links.new(glass.outputs[0], output.inputs["Surface"])

    material = material_of(bpy, connect)
    for k in range(12):
        bpy.ops.mesh.primitive_plane_add(size=30.0, location=(0.0, -1.0 + 0.05 * k, 0.0), rotation=(math.pi / 2, 0.0, 0.0))
        bpy.context.object.data.materials.append(material)
    picture = quartet(scene, "Combined")["Combined"][..., :3]
    assert picture.max() <= 4.0, picture.max()
    sky = picture[-4:]
    assert np.allclose(sky[..., 0], 0.5, atol=0.01) and sky[..., 1:].max() < 0.05


def test_a_sheet_that_scatters_below_is_no_brighter_for_a_lamp_behind_it(blender, gl):
    """A walk that enters a sheet without thickness finds no other side, as in Cycles. (Where the map of the lamp behind showed
    one, walks left at once, as bright as the lamp in front makes the sheet, over its albedo.)"""
    bpy = blender
    plain = scenes.plane_scene(scenes.sun_light((0.0, -1.0, -0.4), 3.0))
    plain.lights.append(scenes.sun_light((0.2, 1.0, -0.4), 2.0))
    scene = put(bpy, plain, size=SIZE, samples=16)

    def connect(tree, output):
        leaf = tree.nodes.new("ShaderNodeBsdfPrincipled")
        leaf.inputs["Base Color"].default_value = (0.8, 0.3, 0.05, 1.0)
        leaf.inputs["Subsurface Weight"].default_value, leaf.inputs["Subsurface Scale"].default_value = 1.0, 0.05
        tree.links.new(leaf.outputs[0], output.inputs["Surface"])

    bpy.ops.mesh.primitive_plane_add(size=2.0, location=(0.0, 0.0, 1.0), rotation=(math.pi / 2 - 0.2, 0.0, 0.3))
    bpy.context.object.data.materials.append(material_of(bpy, connect))
    passes = ("Diffuse Direct", "Diffuse Color")
    test, reference = quartet(scene, *passes), cycles(scene, *passes, samples=64)
    leaf = reference["Diffuse Color"][..., 2] < 0.3
    assert leaf.sum() > 50, "nothing was tested"
    light, theirs = (p["Diffuse Direct"][..., :3][leaf].mean(axis=0) for p in (test, reference))
    assert np.allclose(light, theirs, rtol=0.1), (light, theirs)


def test_ray_visibility_holdout_and_indirect_only(blender, gl):
    """Per object and per collection: who sees it decides; a hole has no alpha and still throws its shadow."""
    bpy = blender
    scene = plane(bpy, size=(96, 54), samples=16)
    xs = iter(np.linspace(-3.0, 3.0, 5))
    for change in ({"visible_camera": False}, {"visible_shadow": False}, {"is_holdout": True}):
        obj = cube(bpy, scene, (next(xs), 0.3, 0.4), 0.8)
        for name, value in change.items():
            setattr(obj, name, value)
    for name in ("indirect_only", "holdout"):
        collection = bpy.data.collections.new(name)
        scene.collection.children.link(collection)
        obj = cube(bpy, scene, (next(xs), 0.3, 0.4), 0.8)
        for c in obj.users_collection:
            c.objects.unlink(obj)
        collection.objects.link(obj)
        setattr(bpy.context.view_layer.layer_collection.children[name], name, True)
    test, reference = agree("visibility", scene, ("Combined", "Diffuse Direct"), rel_mse_of={"Combined": 0.05})
    alpha, expected = test["Combined"][..., 3], reference["Combined"][..., 3]
    assert np.abs(alpha - expected).mean() < 0.01 and expected.min() == 0.0


def test_an_invisible_world_lights_but_does_not_show(blender, gl):
    plain = scenes.plane_scene(scenes.sun_light((0.3, 0.5, -1.0), 1.0))
    plain.world = scenes.world((0.5, 0.6, 0.9))
    scene = put(blender, plain, size=SIZE, samples=8)
    scene.camera.rotation_euler.x += 0.25
    scene.world.cycles_visibility.camera = False
    agree("world", scene, ("Combined",), rel_mse=0.05, gain=0.06)


def test_the_camera_sees_another_world_than_lights_the_scene(blender, gl):
    """Mixed by the Light Path node, as backdrops are; a transparent film keeps the pass and empties the picture."""
    plain = scenes.plane_scene(scenes.sun_light((0.3, 0.5, -1.0), 1.0))
    plain.world = scenes.world((0.5, 0.6, 0.9))
    scene = put(blender, plain, size=SIZE, samples=8)
    scene.camera.rotation_euler.x += 0.25
    scene.render.film_transparent = True
    tree = scene.world.node_tree
    path, mix, seen = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("LightPath", "MixShader", "Background"))
    seen.inputs["Color"].default_value = (0.9, 0.1, 0.1, 1.0)
    lights = next(n for n in tree.nodes if n.type == "BACKGROUND" and n != seen)
    tree.links.new(path.outputs["Is Camera Ray"], mix.inputs[0])
    tree.links.new(lights.outputs[0], mix.inputs[1])
    tree.links.new(seen.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], next(n for n in tree.nodes if n.type == "OUTPUT_WORLD").inputs["Surface"])
    agree("backdrop", scene, ("Combined", "Diffuse Direct", "Environment"), rel_mse=0.05, gain=0.06)


def test_portals_and_a_layer_without_sky_give_no_light(blender, gl):
    """An area light that is a portal, and a world that the view layer leaves out: what is lit is what the sun lights."""
    plain = scenes.plane_scene(scenes.sun_light((0.3, 0.5, -1.0), 1.0))
    plain.world = scenes.world((0.5, 0.6, 0.9))
    scene = put(blender, plain, size=SIZE, samples=8)
    data = blender.data.lights.new("portal", "AREA")
    data.energy, data.cycles.is_portal = 500.0, True
    portal = blender.data.objects.new("portal", data)
    portal.location = (0.0, 0.0, 2.0)
    scene.collection.objects.link(portal)
    scene.camera.rotation_euler.x += 0.25
    blender.context.view_layer.use_sky = False
    agree("portal", scene, ("Combined",), samples=16)


def test_light_sees_only_the_lobes_it_may(blender, gl):
    """A light off for diffuse, one off for glossy."""
    bpy = blender
    plain = scenes.plane_scene(scenes.point_light((1, -1, 2), 100.0, 0.2), material=scenes.principled(Roughness=0.4))
    plain.lights.append(scenes.point_light((-1, -1, 2), 100.0, 0.2))
    scene = put(bpy, plain, size=SIZE, samples=16)
    lamps = [o for o in scene.objects if o.type == "LIGHT"]
    lamps[0].visible_diffuse = False
    lamps[1].visible_glossy = False
    agree("light visibility", scene, ("Diffuse Direct", "Glossy Direct"))


def test_what_is_not_followed_is_said(blender, gl):
    """A panoramic camera, an unknown node: a note each, and a picture all the same."""
    from gi_addon.host.sync import SceneSync
    from gi_addon.materials import compile_surface

    bpy = blender
    scene = plane(bpy, samples=1)
    scene.camera.data.type = "PANO"

    def gabor(tree, out):
        node = tree.nodes.new("ShaderNodeTexGabor")
        bsdf = tree.nodes.new("ShaderNodeBsdfDiffuse")
        tree.links.new(node.outputs["Value"], bsdf.inputs["Color"])
        tree.links.new(bsdf.outputs[0], out.inputs[0])

    next(o for o in scene.objects if o.type == "MESH").material_slots[0].material = material_of(bpy, gabor)
    plain = SceneSync().read(bpy.context.evaluated_depsgraph_get(), resolution=SIZE)
    notes = " | ".join(plain.notes)
    assert "panoramic" in notes
    said = [text for m in plain.materials for text in compile_surface(m.graph, plain.images).approximated]
    assert any("TEX_GABOR" in text for text in said)
    assert quartet(scene, "Combined")["Combined"][..., :3].max() > 0.0


# --- lenses and time --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("blades", [0, 3, 6])
def test_lens_points_fill_the_iris_evenly(blades):
    """Area of the polygon: ½ n sin(2π/n); the mean of points is the centre, their second moment is the polygon's."""
    camera = Camera(np.eye(4), np.eye(4), aperture=1.0, blades=blades)
    u = (np.stack(np.meshgrid(np.arange(48), np.arange(48)), -1).reshape(-1, 2) + 0.5) / 48
    p = np.array([lens_point(camera, v) for v in u])
    n = blades or 10_000
    # Polar moment of a regular polygon of circumradius 1 over its area: (2 + cos(2π/n)) / 6.
    assert np.abs(p.mean(axis=0)).max() < 2e-3
    assert (p * p).sum(axis=1).mean() == pytest.approx((2.0 + math.cos(2.0 * math.pi / n)) / 6.0, rel=3e-3)
    assert np.linalg.norm(p, axis=1).max() <= 1.0 + 1e-9


@pytest.mark.parametrize("kind", ["disc", "blades", "ortho"])
def test_depth_of_field_blurs_as_in_cycles(blender, gl, kind):
    """Emissive bars at three depths; one is in focus."""
    bpy = blender
    scene = plane(bpy, size=(96, 54), samples=64)
    camera = scene.camera.data
    for k, y in enumerate((-2.0, 0.0, 4.0)):
        bar = cube(bpy, scene, (-1.5 + 1.5 * k, y, 0.6), 0.5, diffuse(bpy, f"B{k}", (0.9, 0.3 * k, 0.1)))
        bar.scale.z = 3.0
    if kind == "ortho":
        camera.type, camera.ortho_scale = "ORTHO", 6.0
    camera.dof.use_dof = True
    camera.dof.focus_object = scene.objects[-2]
    camera.dof.aperture_fstop = 0.1 if kind != "ortho" else 3.0
    camera.dof.aperture_blades = 5 if kind == "blades" else 0
    camera.dof.aperture_rotation, camera.dof.aperture_ratio = 0.3, 1.5
    agree(f"dof-{kind}", scene, ("Diffuse Color",), rel_mse=0.01, gain=0.02)


@pytest.mark.parametrize("position", ["CENTER", "START"])
def test_motion_blur_streaks_what_moves_and_deforms(blender, gl, position):
    """A box that slides, one that grows by a shape key, and the camera that turns."""
    bpy = blender
    scene = plane(bpy, size=(96, 54), samples=64)
    slide = cube(bpy, scene, (-1.0, 0.0, 0.5))
    for frame, x in ((1, -2.0), (3, 0.4)):
        slide.location.x = x
        slide.keyframe_insert("location", frame=frame)
    grow = cube(bpy, scene, (1.5, 0.0, 0.4), 0.8, diffuse(bpy, "G", (0.1, 0.6, 0.2)))
    grow.shape_key_add(name="Basis")
    key = grow.shape_key_add(name="Up")
    for point in key.data:
        point.co.z *= 3.0
    for frame, value in ((1, 0.0), (3, 1.0)):
        key.value = value
        key.keyframe_insert("value", frame=frame)
    scene.frame_set(2)
    scene.render.use_motion_blur = True
    scene.render.motion_blur_shutter, scene.render.motion_blur_position = 0.8, position
    scene.quartet.motion_steps = 16
    test, _ = agree(f"motion-{position}", scene, ("Diffuse Color",), samples=96, rel_mse=0.012, gain=0.02)
    scene.render.use_motion_blur = False
    sharp = quartet(scene, "Diffuse Color")["Diffuse Color"]
    assert np.abs(sharp - test["Diffuse Color"]).mean() > 0.01, "the scene must move for this test to mean something"


# --- geometry ---------------------------------------------------------------------------------------------------------


def test_huge_offsets_keep_their_shape(blender, gl):
    """A scene ten kilometres from the origin, camera and light with it, is the same picture."""
    scene = plane(blender, samples=4)
    cube(blender, scene)
    near = quartet(scene, "Combined")["Combined"]
    for obj in scene.objects:
        obj.location.x += 10_000.0
    far = quartet(scene, "Combined")["Combined"]
    # Floats have a millimetre there.
    assert np.abs(far - near).mean() < 0.02 * near[..., :3].mean()


def test_colour_attributes_of_any_domain_and_name(blender, gl):
    bpy = blender
    scene = plane(bpy)
    obj = next(o for o in scene.objects if o.type == "MESH")
    mesh = obj.data
    rng = np.random.default_rng(3)
    for domain in ("POINT", "CORNER"):
        for kind in ("FLOAT_COLOR", "BYTE_COLOR"):
            layer = mesh.color_attributes.new(f"{domain} {kind}", kind, domain)
            layer.data.foreach_set("color", rng.random(4 * len(layer.data)).astype("f4"))

    def connect(tree, out):
        sums = None
        for k, layer in enumerate(mesh.color_attributes):
            node = tree.nodes.new("ShaderNodeAttribute" if k % 2 else "ShaderNodeVertexColor")
            setattr(node, "attribute_name" if k % 2 else "layer_name", layer.name)
            scale = tree.nodes.new("ShaderNodeVectorMath")
            scale.operation = "MULTIPLY_ADD"
            scale.inputs[1].default_value = (0.25,) * 3
            tree.links.new(node.outputs["Color"], scale.inputs[0])
            if sums is not None:
                tree.links.new(sums, scale.inputs[2])
            sums = scale.outputs[0]
        bsdf = tree.nodes.new("ShaderNodeBsdfDiffuse")
        tree.links.new(sums, bsdf.inputs[0])
        tree.links.new(bsdf.outputs[0], out.inputs[0])

    obj.material_slots[0].material = material_of(bpy, connect)
    agree("colour attributes", scene, ("Diffuse Color",), rel_mse=0.002, gain=0.005)


def test_hair_curves_and_points_cover_what_cycles_rounds_cover(blender, gl):
    """Particle hair with children, hair curves with a radius, a point cloud: the share of the picture they take, and their
    shade. Three-sided strands and twenty-sided points are not round, so pixels differ; means do not."""
    bpy = blender
    scene = plane(bpy, size=(96, 54), samples=32)
    red, green, blue = (diffuse(bpy, f"H{k}", c) for k, c in enumerate(((0.9, 0.1, 0.1), (0.1, 0.9, 0.1), (0.1, 0.1, 0.9))))
    obj = cube(bpy, scene, (-2.0, 0.0, 0.2), 0.5, red)
    obj.modifiers.new("hair", "PARTICLE_SYSTEM")
    settings = obj.particle_systems[0].settings
    settings.type, settings.count, settings.hair_length = "HAIR", 60, 0.8
    settings.child_type, settings.rendered_child_count, settings.radius_scale = "SIMPLE", 3, 0.05
    curves = bpy.data.hair_curves.new("C")
    rng = np.random.default_rng(1)
    sizes = [4, 6, 5] * 12
    curves.add_curves(sizes)
    points = np.concatenate([
        np.cumsum(np.vstack([rng.uniform((-0.6, -0.6, 0.0), (0.6, 0.6, 0.0)), rng.uniform((-0.1, -0.1, 0.1), (0.1, 0.1, 0.4),
                  (n - 1, 3))]), axis=0) for n in sizes
    ])  # fmt: skip
    curves.attributes["position"].data.foreach_set("vector", points.astype("f4").ravel())
    curves.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", np.full(len(points), 0.03, "f4"))
    curves.materials.append(green)
    scene.collection.objects.link(bpy.data.objects.new("C", curves))
    cloud = bpy.data.pointclouds.new("P")
    if hasattr(cloud, "resize"):
        cloud.resize(30)
        at = rng.uniform((1.4, -0.7, 0.2), (2.6, 0.7, 1.2), (30, 3)).astype("f4")
        cloud.attributes["position"].data.foreach_set("vector", at.ravel())
        cloud.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", np.full(30, 0.12, "f4"))
        cloud.materials.append(blue)
        scene.collection.objects.link(bpy.data.objects.new("P", cloud))
    names = ("Diffuse Color", "Diffuse Direct")
    test, reference = quartet(scene, *names), cycles(scene, *names, samples=48)
    pictures_to("materials", "hair", test=test["Diffuse Color"], reference=reference["Diffuse Color"])
    ground = reference["Diffuse Color"][2, 48]
    for k in range(3 if hasattr(cloud, "resize") else 2):
        shown, expected = (np.clip(p["Diffuse Color"][..., k] - p["Diffuse Color"][..., (k + 1) % 3], 0.0, None).sum()
                           for p in (test, reference))  # fmt: skip
        assert expected > 3.0 and shown / expected == pytest.approx(1.0, abs=0.06), f"colour {k}, ground {ground}"
    assert score(test["Diffuse Direct"], reference["Diffuse Direct"]).gain == pytest.approx(1.0, abs=0.03)


# --- closures ---------------------------------------------------------------------------------------------------------


def test_sheen_and_coat_give_back_no_more_than_cycles(blender, gl):
    """Balls of the Principled BSDF with sheen or a coat, and the Sheen shader: the colours, which are albedos, and what a sun
    makes of them. Sheen is Lambert's here and the coat shares the base's lobe: the totals hold, the shapes less."""
    bpy = blender
    scene = plane(bpy, size=(120, 40), samples=16)

    def principled(**inputs):
        def connect(tree, out):
            node = tree.nodes.new("ShaderNodeBsdfPrincipled")
            for name, value in inputs.items():
                socket = node.inputs[name.replace("_", " ")]
                socket.default_value = (*value, 1.0) if isinstance(value, tuple) else value
            tree.links.new(node.outputs[0], out.inputs[0])

        return material_of(bpy, connect)

    def cloth(tree, out):
        node = tree.nodes.new("ShaderNodeBsdfSheen")
        node.inputs["Color"].default_value = (0.9, 0.5, 0.3, 1.0)
        node.inputs["Roughness"].default_value = 0.6
        tree.links.new(node.outputs[0], out.inputs[0])

    kinds = (
        principled(Base_Color=(0.1, 0.2, 0.5), Sheen_Weight=1.0, Sheen_Roughness=0.5, Roughness=0.6),
        principled(Base_Color=(0.5, 0.1, 0.1), Sheen_Weight=0.5, Sheen_Roughness=0.9, Sheen_Tint=(0.2, 1.0, 0.4)),
        material_of(bpy, cloth),
        principled(Base_Color=(0.6, 0.2, 0.1), Coat_Weight=1.0, Coat_Roughness=0.3, Roughness=0.5),
    )
    for k, material in enumerate(kinds):
        bpy.ops.mesh.primitive_uv_sphere_add(radius=0.6, location=(-2.4 + 1.6 * k, 0.0, 0.6), segments=48, ring_count=24)
        bpy.ops.object.shade_smooth()
        bpy.context.object.data.materials.append(material)
    # The two lobes of a coat as one are brighter along the rim, in a pixel's width of the balls.
    agree("sheen", scene, ("Diffuse Color", "Glossy Color", "Diffuse Direct"), rel_mse=0.02, gain=0.03,
          gain_of={"Glossy Color": 0.05}, rel_mse_of={"Glossy Color": 0.2, "Diffuse Direct": 0.06})  # fmt: skip


def test_metals_by_index_and_by_colour_reflect_as_in_cycles(blender, gl):
    """Gold by its index and extinction, and a metal by its colour: Glossy Color is the albedo of the lobe."""
    bpy = blender
    if not hasattr(bpy.types, "ShaderNodeBsdfMetallic"):
        pytest.skip("this Blender has no Metallic BSDF")
    scene = plane(bpy, size=(80, 40), samples=16)
    for k, kind in enumerate(("PHYSICAL_CONDUCTOR", "F82")):

        def connect(tree, out, kind=kind):
            node = tree.nodes.new("ShaderNodeBsdfMetallic")
            node.fresnel_type = kind
            for name, value in (("IOR", (0.18, 0.42, 1.37)), ("Extinction", (3.42, 2.35, 1.77))):
                if kind == "PHYSICAL_CONDUCTOR":
                    next(s for s in node.inputs if s.identifier == name).default_value = value
            node.inputs["Roughness"].default_value = 0.3
            tree.links.new(node.outputs[0], out.inputs[0])

        bpy.ops.mesh.primitive_uv_sphere_add(radius=0.8, location=(-1.0 + 2.0 * k, 0.0, 0.8), segments=48, ring_count=24)
        bpy.ops.object.shade_smooth()
        bpy.context.object.data.materials.append(material_of(bpy, connect))
    agree("metal", scene, ("Glossy Color",), rel_mse=0.01, gain=0.02)


def test_a_checkers_mean_emission_is_the_mean_of_its_colours():
    """What a lamp of emissive checkers casts has their mean colour, not grey."""
    nodes = (
        Node("TEX_CHECKER", "Checker", {"Color1": (1.0, 0.1, 0.05, 1.0), "Color2": (0.0, 0.0, 0.0, 1.0), "Scale": 4.0}),
        Node("EMISSION", "Emission", {"Color": Link(0, "Color"), "Strength": 5.0}),
    )
    np.testing.assert_allclose(mean_emission(ShaderGraph(nodes, Link(1, "Emission")), []), (2.5, 0.25, 0.125))
