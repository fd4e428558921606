# SPDX-License-Identifier: GPL-3.0-or-later
"""Shader nodes against Cycles, value by value.

Each tile of a grid is a plane that emits what one node (or three numbers of three) gives; both engines render the grid with
one sample at the pixels' centres. Where a pattern has an edge the sample's place decides, so the error of a tile is its 98th
percentile, as a share of the range.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from conftest import pictures_to

pytestmark = pytest.mark.blender
TILE = 13  # pixels


class Grid:
    """Tiles to be filled: ``color(name, make)`` and ``number(name, make)``; ``make(tree)`` returns an output socket."""

    def __init__(self, bpy) -> None:
        self.bpy = bpy
        self.colors: list[tuple[str, object]] = []
        self.numbers: list[tuple[str, object]] = []

    def color(self, name: str, make) -> None:
        self.colors.append((name, make))

    def number(self, name: str, make) -> None:
        self.numbers.append((name, make))

    def build(self):
        """(scene, labels): a scene with a tile per colour and per three numbers."""
        from gi_addon.host.compat import node_tree

        bpy = self.bpy
        bpy.ops.wm.read_factory_settings(use_empty=True)
        scene = bpy.context.scene
        groups = [[c] for c in self.colors]
        groups += [self.numbers[i : i + 3] for i in range(0, len(self.numbers), 3)]
        columns = math.ceil(math.sqrt(1.6 * len(groups)))
        rows = math.ceil(len(groups) / columns)
        for i, group in enumerate(groups):
            x, y = i % columns, i // columns
            mesh = bpy.data.meshes.new(f"tile{i}")
            # A little relief under a tilt, so that no coordinate is constant.
            corners = [(-0.5, -0.5, -0.1), (0.5, -0.5, 0.15), (0.5, 0.5, 0.35), (-0.5, 0.5, 0.1)]
            mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
            uv = mesh.uv_layers.new(name="UVMap")
            for k, co in enumerate(((0, 0), (1, 0), (1, 1), (0, 1))):
                uv.data[k].uv = co
            obj = bpy.data.objects.new(f"tile{i}", mesh)
            obj.location = (x, y, 0.0)
            scene.collection.objects.link(obj)
            material = bpy.data.materials.new(f"tile{i}")
            mesh.materials.append(material)
            tree = node_tree(material)
            tree.nodes.clear()
            out, emission = tree.nodes.new("ShaderNodeOutputMaterial"), tree.nodes.new("ShaderNodeEmission")
            tree.links.new(emission.outputs[0], out.inputs[0])
            # Kept positive: emission below zero is not the nodes' business.
            scale = tree.nodes.new("ShaderNodeVectorMath")
            scale.operation = "MULTIPLY_ADD"
            scale.inputs[1].default_value, scale.inputs[2].default_value = (0.25,) * 3, (1.0,) * 3
            tree.links.new(scale.outputs[0], emission.inputs["Color"])
            if len(group) == 1 and group[0] in self.colors:
                tree.links.new(group[0][1](tree), scale.inputs[0])
            else:
                combine = tree.nodes.new("ShaderNodeCombineXYZ")
                for k, (_, make) in enumerate(group):
                    tree.links.new(make(tree), combine.inputs[k])
                tree.links.new(combine.outputs[0], scale.inputs[0])
        camera = bpy.data.cameras.new("C")
        camera.type, camera.ortho_scale, camera.sensor_fit = "ORTHO", float(columns), "HORIZONTAL"
        eye = bpy.data.objects.new("C", camera)
        eye.location = (columns / 2 - 0.5, rows / 2 - 0.5, 5.0)
        scene.collection.objects.link(eye)
        scene.camera = eye
        scene.render.resolution_x, scene.render.resolution_y = columns * TILE, rows * TILE
        return scene, groups, columns

    def errors(self, name: str) -> dict[str, float]:
        """Render with both engines; 98th percentile of each case's error."""
        scene, groups, columns = self.build()
        test, reference = both(scene)
        pictures_to("nodes", name, test=test, reference=reference)
        found = {}
        for i, group in enumerate(groups):
            x, y = (i % columns) * TILE, (i // columns) * TILE
            # Off the tile's border: there a neighbour may be seen.
            part = (slice(y + 1, y + TILE - 1), slice(x + 1, x + TILE - 1))
            t, r = test[part].reshape(-1, 3), reference[part].reshape(-1, 3)
            colored = len(group) == 1 and group[0] in self.colors
            for k, (label, _) in enumerate(group):
                a, b = (t, r) if colored else (t[:, k], r[:, k])
                spread = max(float(np.ptp(b)), 0.05)
                found[label] = float(np.percentile(np.abs(a - b), 98)) / spread
        return found


def both(scene) -> tuple[np.ndarray, np.ndarray]:
    """The Emission pass by Quartet and by Cycles, one sample at the pixels' centres."""
    from gi_addon.host.cycles import Reference, render_passes, set_up

    scene.render.engine = "QUARTET"
    scene.quartet.samples = 1
    test = render_passes(scene, ["Emission"])["Emission"]
    set_up(scene, Reference(0, 1, 1))
    scene.cycles.max_bounces = 0
    scene.cycles.filter_width = 0.01
    return test, render_passes(scene, ["Emission"])["Emission"]


def make(tree, kind: str, output, sockets=(), **settings):
    """A node with settings and socket values by name; returns an output."""
    node = tree.nodes.new("ShaderNode" + kind)
    for name, value in settings.items():
        setattr(node, name, value)
    for name, value in dict(sockets).items():
        socket = next(s for s in node.inputs if s.identifier == name or (s.name == name and s.enabled))
        if hasattr(value, "is_output"):
            tree.links.new(value, socket)
        else:
            socket.default_value = value
    return next(s for s in node.outputs if s.identifier == output)


def case(kind: str, output: str, sockets=(), **settings):
    """A maker of that node, fed with object coordinates where it takes a Vector and none is given."""

    def maker(tree):
        given = {k: v(tree) if callable(v) else v for k, v in dict(sockets).items()}
        probe = tree.nodes.new("ShaderNode" + kind)
        takes = any(s.identifier == "Vector" for s in probe.inputs)
        tree.nodes.remove(probe)
        if takes and "Vector" not in given:
            given["Vector"] = make(tree, "TexCoord", "Object")
        return make(tree, kind, output, given, **settings)

    return maker


def coordinate(output: str = "Object", scale: float = 1.0, offset=(0.0, 0.0, 0.0)):
    """A maker of scaled texture coordinates."""

    def maker(tree):
        return make(tree, "VectorMath", "Vector", {
            "Vector": make(tree, "TexCoord", output), "Vector_001": (scale,) * 3, "Vector_002": offset,
        }, operation="MULTIPLY_ADD")  # fmt: skip

    return maker


def ramp(axis: str = "X", scale: float = 1.0, offset: float = 0.0):
    """A maker of a number that grows along one axis of the tile."""

    def maker(tree):
        v = make(tree, "SeparateXYZ", axis, {"Vector": make(tree, "TexCoord", "UV")})
        return make(tree, "Math", "Value", {"Value": v, "Value_001": scale, "Value_002": offset}, operation="MULTIPLY_ADD")

    return maker


def hues(tree):
    """A colour that differs all over the tile."""
    return make(tree, "MapRange", "Vector", {
        "Vector": make(tree, "TexCoord", "UV"), "From_Max_FLOAT3": (1.0, 1.0, 1.0), "To_Min_FLOAT3": (0.05, 0.9, 0.3),
        "To_Max_FLOAT3": (1.1, 0.1, 0.7),
    }, data_type="FLOAT_VECTOR")  # fmt: skip


def check(grid: Grid, name: str, tolerance: float = 2e-3, **looser: float) -> None:
    errors = grid.errors(name)
    wrong = {k: round(v, 5) for k, v in errors.items() if not v <= looser.get(k, tolerance)}
    assert not wrong, f"{len(wrong)} of {len(errors)} differ from Cycles: {wrong}"


# --- textures ---------------------------------------------------------------------------------------------------------


def test_noise_is_cycles_own_in_every_dimension_and_type(blender, gl):
    """Types × dimensions as numbers, with a fraction of an octave; colours, distortion, no octave, no normalisation."""
    grid = Grid(blender)
    types = ("FBM", "MULTIFRACTAL", "HYBRID_MULTIFRACTAL", "RIDGED_MULTIFRACTAL", "HETERO_TERRAIN")
    for kind, d in itertools.product(types, ("1D", "2D", "3D", "4D")):
        sockets = {"Scale": 3.0, "Detail": 2.6, "Roughness": 0.6, "Lacunarity": 2.2, "Offset": 0.3, "Gain": 1.4}
        sockets["W"] = ramp("Y", 1.5, 0.2)
        grid.number(f"{kind} {d}", case("TexNoise", "Fac", sockets, noise_dimensions=d, noise_type=kind))
    for d in ("1D", "2D", "3D", "4D"):
        sockets = {"Scale": 3.0, "Detail": 1.0, "W": ramp("X", 2.0), "Distortion": 0.7}
        grid.color(f"colour {d}", case("TexNoise", "Color", sockets, noise_dimensions=d))
    grid.number("raw", case("TexNoise", "Fac", {"Detail": 3.0}, normalize=False))
    grid.number("one octave", case("TexNoise", "Fac", {"Detail": 0.0, "Scale": -4.0}))
    grid.number("linked detail", case("TexNoise", "Fac", {"Detail": ramp("X", 5.0)}))
    check(grid, "noise")


@pytest.mark.parametrize("dimensions", ["1D", "2D", "3D", "4D"])
def test_voronoi_is_cycles_own(blender, gl, dimensions):
    """Features × metrics, fractal and normalised."""
    grid = Grid(blender)
    base = {"Scale": 3.0, "W": ramp("Y", 1.5, 0.2), "Randomness": 0.9}
    metrics = ("EUCLIDEAN",) if dimensions in ("1D", "4D") else ("EUCLIDEAN", "MANHATTAN", "CHEBYCHEV", "MINKOWSKI")
    for feature, metric in itertools.product(("F1", "F2", "SMOOTH_F1"), metrics):
        sockets = base | {"Exponent": 1.7, "Smoothness": 0.6}
        settings = {"feature": feature, "distance": metric, "voronoi_dimensions": dimensions}
        grid.number(f"{feature} {metric}", case("TexVoronoi", "Distance", sockets, **settings))
        if metric == "EUCLIDEAN":
            grid.color(f"{feature} colour", case("TexVoronoi", "Color", sockets, **settings))
            place = "W" if dimensions == "1D" else "Position"
            (grid.number if place == "W" else grid.color)(f"{feature} place", case("TexVoronoi", place, sockets, **settings))
    for feature, output in (("DISTANCE_TO_EDGE", "Distance"), ("N_SPHERE_RADIUS", "Radius")):
        grid.number(feature, case("TexVoronoi", output, base, feature=feature, voronoi_dimensions=dimensions))
    fractal = base | {"Detail": 1.4, "Roughness": 0.6, "Lacunarity": 1.9}
    settings = {"normalize": True, "voronoi_dimensions": dimensions}
    for feature in ("F1", "F2", "DISTANCE_TO_EDGE"):
        grid.number(f"fractal {feature}", case("TexVoronoi", "Distance", fractal, feature=feature, **settings))
    check(grid, f"voronoi-{dimensions}")


def test_gradient_wave_magic_brick_checker_and_white_noise(blender, gl):
    grid = Grid(blender)
    for kind in ("LINEAR", "QUADRATIC", "EASING", "DIAGONAL", "SPHERICAL", "QUADRATIC_SPHERE", "RADIAL"):
        grid.number(f"gradient {kind}", case("TexGradient", "Fac", {"Vector": coordinate("Object", 1.3)}, gradient_type=kind))
    for wave, axis in itertools.product(("BANDS", "RINGS"), range(4)):
        name = ("X", "Y", "Z", "DIAGONAL" if wave == "BANDS" else "SPHERICAL")[axis]
        profile = ("SIN", "SAW", "TRI", "SIN")[axis]
        settings = {"wave_type": wave, "wave_profile": profile, f"{wave.lower()}_direction": name}
        sockets = {"Scale": 0.8, "Distortion": 2.0 if axis == 3 else 0.0, "Detail": 1.5, "Phase Offset": 0.3}
        grid.number(f"wave {wave} {name}", case("TexWave", "Fac", sockets, **settings))
    for depth in (0, 2, 6, 10):
        grid.color(f"magic {depth}", case("TexMagic", "Color", {"Scale": 1.2, "Distortion": 1.3}, turbulence_depth=depth))
    grid.color("brick", case("TexBrick", "Color", {"Scale": 3.7, "Mortar": (0, 0.2, 1, 1), "Mortar Smooth": 0.0}))
    grid.number("brick smooth", case("TexBrick", "Fac", {"Scale": 3.0, "Mortar Size": 0.1, "Mortar Smooth": 1.0},
                                     offset=0.3, squash=1.5, squash_frequency=3, offset_frequency=2))  # fmt: skip
    grid.color("checker", case("TexChecker", "Color", {"Scale": 4.7}))

    def snapped(tree):
        return make(tree, "VectorMath", "Vector", {"Vector": coordinate("Object", 5.0, (0.31, 0.17, 0.23))(tree)},
                    operation="FLOOR")  # fmt: skip

    for d in ("1D", "2D", "3D", "4D"):
        whole = lambda tree: make(tree, "Math", "Value", {"Value": ramp("X", 5.3)(tree)}, operation="FLOOR")  # noqa: E731
        sockets = {"Vector": snapped, "W": whole}
        sockets = {k: v for k, v in sockets.items() if (k == "W") == (d == "1D") or d == "4D"}
        grid.color(f"white {d}", case("TexWhiteNoise", "Color", sockets, noise_dimensions=d))
        grid.number(f"white value {d}", case("TexWhiteNoise", "Value", sockets, noise_dimensions=d))
    check(grid, "textures")


# --- colour -----------------------------------------------------------------------------------------------------------


def test_mix_modes_are_cycles_own(blender, gl):
    grid = Grid(blender)
    modes = [i.identifier for i in blender.types.ShaderNodeMix.bl_rna.properties["blend_type"].enum_items]
    for mode in modes:
        sockets = {"Factor_Float": ramp("Y", 0.8, 0.1), "A_Color": hues, "B_Color": (0.7, 0.3, 0.15, 1.0)}
        grid.color(mode, case("Mix", "Result_Color", sockets, data_type="RGBA", blend_type=mode))
    grid.number("float", case("Mix", "Result_Float", {"Factor_Float": ramp("X", 2.0, -0.5), "A_Float": 0.2, "B_Float": 0.9}))
    grid.number("unclamped", case("Mix", "Result_Float", {"Factor_Float": ramp("X", 2.0, -0.5), "A_Float": 0.2,
                                                          "B_Float": 0.9}, clamp_factor=False))  # fmt: skip
    vectors = {"Factor_Vector": coordinate("UV"), "A_Vector": (0.1, 0.5, 1.0), "B_Vector": (1.0, 0.0, 0.3)}
    grid.color("vector", case("Mix", "Result_Vector", vectors, data_type="VECTOR", factor_mode="NON_UNIFORM"))
    check(grid, "mix")


def curve(kind: str, output: str, extend: str, source):
    def maker(tree):
        socket = make(tree, kind, output, {"Value" if kind == "FloatCurve" else
                                           "Color" if kind == "RGBCurve" else "Vector": source(tree)})  # fmt: skip
        mapping = socket.node.mapping
        mapping.extend = extend
        for k, one in enumerate(mapping.curves):
            one.points.new(0.4, 0.15 + 0.15 * k)
            one.points[-1].location = (0.9, 0.8)
        mapping.update()
        return socket

    return maker


def color_ramp(mode: str, output: str = "Color"):
    def maker(tree):
        socket = make(tree, "ValToRGB", output, {"Fac": ramp("X", 1.2, -0.1)(tree)})
        elements = socket.node.color_ramp
        elements.interpolation = mode
        for at, color in ((0.35, (0.9, 0.1, 0.2, 0.3)), (0.6, (0.1, 0.7, 0.3, 0.9))):
            elements.elements.new(at).color = color
        return socket

    return maker


def test_colour_nodes_ramps_and_curves(blender, gl):
    grid = Grid(blender)
    for mode in ("LINEAR", "EASE", "CONSTANT", "B_SPLINE", "CARDINAL"):
        grid.color(f"ramp {mode}", color_ramp(mode))
    grid.number("ramp alpha", color_ramp("LINEAR", "Alpha"))
    for extend in ("EXTRAPOLATED", "HORIZONTAL"):
        grid.number(f"float curve {extend}", curve("FloatCurve", "Value", extend, ramp("X", 1.4, -0.2)))
        grid.color(f"rgb curves {extend}", curve("RGBCurve", "Color", extend, hues))
        grid.color(f"vector curves {extend}", curve("VectorCurve", "Vector", extend, coordinate("UV", 1.4, (-0.2,) * 3)))
    grid.color("hue saturation", case("HueSaturation", "Color", {"Hue": 0.7, "Saturation": 1.3, "Value": 0.8, "Fac": 0.9,
                                                                 "Color": hues}))  # fmt: skip
    grid.color("gamma", case("Gamma", "Color", {"Color": hues, "Gamma": 2.2}))
    grid.color("gamma 0", case("Gamma", "Color", {"Color": hues, "Gamma": 0.0}))
    grid.color("bright contrast", case("BrightContrast", "Color", {"Color": hues, "Bright": 0.1, "Contrast": 0.4}))
    grid.color("invert", case("Invert", "Color", {"Color": hues, "Fac": 0.8}))
    grid.number("grey", case("RGBToBW", "Val", {"Color": hues}))
    for mode in ("RGB", "HSV", "HSL"):
        for axis in ("Red", "Green", "Blue"):
            grid.number(f"separate {mode} {axis}", case("SeparateColor", axis, {"Color": hues}, mode=mode))
        sockets = {"Red": ramp("X"), "Green": ramp("Y"), "Blue": 0.4}
        grid.color(f"combine {mode}", case("CombineColor", "Color", sockets, mode=mode))
    grid.color("blackbody", case("Blackbody", "Color", {"Temperature": ramp("X", 7000.0, 1000.0)}))
    grid.color("wavelength", case("Wavelength", "Color", {"Wavelength": ramp("X", 420.0, 370.0)}))
    # Planck's law against Blender's fit of it.
    check(grid, "colour", blackbody=0.012)


# --- numbers and vectors ----------------------------------------------------------------------------------------------


def test_math_is_cycles_own(blender, gl):
    grid = Grid(blender)
    for item in blender.types.ShaderNodeMath.bl_rna.properties["operation"].enum_items:
        operation = item.identifier
        sockets = {"Value": ramp("X", 2.31, -0.913), "Value_001": ramp("Y", 1.73, -0.557), "Value_002": 0.3}
        if operation == "TANGENT":
            sockets["Value"] = ramp("X", 2.0, -1.0)
        grid.number(operation, case("Math", "Value", sockets, operation=operation))
    # Near their poles these magnify the hundredth of a pixel between the samples' places.
    check(grid, "math", 5e-3, DIVIDE=0.02, INVERSE_SQRT=0.02)


def test_vector_math_is_cycles_own(blender, gl):
    grid = Grid(blender)
    for item in blender.types.ShaderNodeVectorMath.bl_rna.properties["operation"].enum_items:
        operation = item.identifier
        sockets = {"Vector": coordinate("Object", 2.03, (0.117, -0.213, 0.331)), "Vector_001": (0.6, -0.7, 0.45),
                   "Vector_002": (0.2, 0.9, -0.4), "Scale": 0.7}  # fmt: skip
        output = "Value" if operation in ("DOT_PRODUCT", "DISTANCE", "LENGTH") else "Vector"
        (grid.number if output == "Value" else grid.color)(operation, case("VectorMath", output, sockets, operation=operation))
    check(grid, "vector-math")


def test_map_range_clamp_rotate_mapping_and_transform(blender, gl):
    grid = Grid(blender)
    for kind, clamp in itertools.product(("LINEAR", "STEPPED", "SMOOTHSTEP", "SMOOTHERSTEP"), (True, False)):
        sockets = {"Value": ramp("X", 1.6, -0.3), "From Min": 0.1, "From Max": 0.8, "To Min": 1.0, "To Max": -0.5,
                   "Steps": 3.0}  # fmt: skip
        grid.number(f"map {kind} {clamp}", case("MapRange", "Result", sockets, interpolation_type=kind, clamp=clamp))
        sockets = {"Vector": coordinate("UV", 1.63, (-0.317, -0.211, 0.4)), "From_Min_FLOAT3": (0.1,) * 3,
                   "From_Max_FLOAT3": (0.8, 0.7, 0.9), "To_Min_FLOAT3": (1.0, 0.0, 0.2), "To_Max_FLOAT3": (-0.5, 1.0, 0.6),
                   "Steps_FLOAT3": (3.0, 2.0, 4.0)}  # fmt: skip
        settings = {"interpolation_type": kind, "clamp": clamp, "data_type": "FLOAT_VECTOR"}
        grid.color(f"map vector {kind} {clamp}", case("MapRange", "Vector", sockets, **settings))
    for kind in ("MINMAX", "RANGE"):
        grid.number(f"clamp {kind}", case("Clamp", "Result", {"Value": ramp("X", 1.5, -0.2), "Min": 0.8, "Max": 0.3},
                                          clamp_type=kind))  # fmt: skip
    for kind, invert in itertools.product(("AXIS_ANGLE", "X_AXIS", "Y_AXIS", "Z_AXIS", "EULER_XYZ"), (False, True)):
        sockets = {"Center": (0.2, -0.1, 0.3), "Axis": (0.3, 1.0, -0.4), "Angle": 0.8, "Rotation": (0.4, -0.7, 1.1)}
        sockets = {k: v for k, v in sockets.items() if k == "Center" or ((k == "Rotation") == (kind == "EULER_XYZ")
                   and (k != "Axis" or kind == "AXIS_ANGLE"))}  # fmt: skip
        grid.color(f"rotate {kind} {invert}", case("VectorRotate", "Vector", sockets, rotation_type=kind, invert=invert))
    for kind in ("POINT", "TEXTURE", "VECTOR", "NORMAL"):
        sockets = {"Location": (0.2, -0.3, 0.1), "Rotation": (0.4, -0.7, 1.1), "Scale": (1.5, 0.6, -0.8)}
        if kind in ("VECTOR", "NORMAL"):
            sockets.pop("Location")
        grid.color(f"mapping {kind}", case("Mapping", "Vector", sockets, vector_type=kind))
    spaces = ("WORLD", "OBJECT", "CAMERA")
    for a, b, kind in itertools.product(spaces, spaces, ("POINT", "VECTOR", "NORMAL")):
        if a != b:
            sockets = {"Vector": coordinate("Object", 0.5, (0.3, 0.2, 0.4))}
            grid.color(f"{kind} {a} to {b}", case("VectorTransform", "Vector", sockets, vector_type=kind, convert_from=a,
                                                  convert_to=b))  # fmt: skip
    check(grid, "vectors")


def test_inputs_are_cycles_own(blender, gl):
    """Coordinates, geometry, camera, angles of view, colours of objects."""
    grid = Grid(blender)
    for output in ("Generated", "Normal", "UV", "Object", "Camera", "Window", "Reflection"):
        grid.color(f"coordinate {output}", case("TexCoord", output))
    for output in ("Position", "Normal", "True Normal", "Incoming"):
        grid.color(output, case("NewGeometry", output))
    grid.number("Backfacing", case("NewGeometry", "Backfacing"))
    for output in ("View Z Depth", "View Distance"):
        grid.number(output, case("CameraData", output))
    grid.color("view vector", case("CameraData", "View Vector"))
    grid.color("location", case("ObjectInfo", "Location"))
    grid.color("object colour", case("ObjectInfo", "Color"))
    grid.number("random", case("ObjectInfo", "Random"))
    grid.number("index", case("ObjectInfo", "Object Index"))
    for blend in (0.2, 0.5, 0.8):
        grid.number(f"facing {blend}", case("LayerWeight", "Facing", {"Blend": blend}))
        grid.number(f"layer fresnel {blend}", case("LayerWeight", "Fresnel", {"Blend": blend}))
    for ior in (0.8, 1.0, 1.45, 2.5):
        grid.number(f"fresnel {ior}", case("Fresnel", "Fac", {"IOR": ior}))
    for output in ("Is Camera Ray", "Is Shadow Ray", "Is Diffuse Ray", "Ray Depth"):
        grid.number(output, case("LightPath", output))
    for axis in "XYZ":
        grid.color(f"tangent {axis}", case("Tangent", "Tangent", direction_type="RADIAL", axis=axis))
    grid.color("tangent uv", case("Tangent", "Tangent", direction_type="UV_MAP"))
    # Cycles smooths a UV map's tangent over the two triangles of the bent tile.
    check(grid, "inputs", **{"tangent uv": 0.06})


# --- images -----------------------------------------------------------------------------------------------------------


def picture(bpy, name: str, color_space: str = "Non-Color", size: int = 5):
    image = bpy.data.images.get(name) or bpy.data.images.new(name, size, size, alpha=True)
    image.colorspace_settings.name = color_space
    y, x = np.mgrid[0:size, 0:size] / (size - 1)
    pixels = np.stack([x, y, 0.5 + 0.5 * np.sin(9 * x + 5 * y), 0.3 + 0.7 * x * y], -1)
    image.pixels.foreach_set(np.ascontiguousarray(pixels, "f4").ravel())
    image.update()
    image.pack()
    return image


def image_case(bpy, output: str = "Color", source=None, **settings):
    """A maker of an image texture; its picture is made with the scene, of few texels, so that none is smaller than a pixel."""

    def maker(tree):
        space = settings.get("space", "Non-Color")
        image = picture(bpy, f"picture {space}", space)
        image.alpha_mode = settings.get("alpha", "CHANNEL_PACKED")
        node = {k: v for k, v in settings.items() if k not in ("space", "alpha")}
        vector = (source or coordinate("UV", 1.7, (-0.331, -0.217, 0.0)))(tree)
        return make(tree, "TexImage", output, {"Vector": vector}, image=image, **node)

    return maker


def test_images_by_extension_interpolation_projection_and_colour_space(blender, gl):
    grid = Grid(blender)
    for extension in ("REPEAT", "EXTEND", "CLIP", "MIRROR"):
        grid.color(f"{extension}", image_case(blender, extension=extension))
    grid.number("clipped alpha", image_case(blender, "Alpha", extension="CLIP"))
    for interpolation in ("Closest", "Cubic", "Smart"):
        grid.color(interpolation, image_case(blender, interpolation=interpolation))
    for space in ("sRGB", "Linear Rec.709"):
        grid.color(space, image_case(blender, space=space))
    solid = coordinate("Object", 0.83, (0.5, 0.5, 0.31))
    for projection in ("SPHERE", "TUBE", "BOX"):
        source = solid if projection == "BOX" else coordinate("Object", 0.4, (1.1, 0.9, 0.6))  # off the poles
        grid.color(projection, image_case(blender, source=source, projection=projection, projection_blend=0.4))
    for projection in ("EQUIRECTANGULAR", "MIRROR_BALL"):

        def environment(tree, projection=projection):
            return make(tree, "TexEnvironment", "Color", {"Vector": coordinate("Object", 2.0, (0.3, 0.4, 0.5))(tree)},
                        image=picture(blender, "sky"), projection=projection)  # fmt: skip

        grid.color(projection, environment)
    # Eight-bit texels between which GPUs interpolate with eight bits of fraction.
    check(grid, "images", 0.01)


def test_udim_tiles_are_told_apart(blender, gl, tmp_path):
    """Two tiles side by side and a gap, which is magenta; from files."""
    bpy = blender
    grid = Grid(bpy)

    def tiled(tree):
        for number, shift in ((1001, 0.0), (1003, 0.4), (1012, 0.8)):
            image = picture(bpy, f"tile{number}", size=3)
            pixels = np.empty(len(image.pixels), "f4")
            image.pixels.foreach_get(pixels)
            image.pixels.foreach_set(np.abs(pixels - shift).astype("f4"))
            image.filepath_raw, image.file_format = str(tmp_path / f"t.{number}.png"), "PNG"
            image.save()
        image = bpy.data.images.load(str(tmp_path / "t.1001.png"))
        image.source, image.filepath = "TILED", str(tmp_path / "t.<UDIM>.png")
        image.colorspace_settings.name = "Non-Color"
        for number in (1003, 1012):
            if number not in [t.number for t in image.tiles]:
                image.tiles.new(number)
        return make(tree, "TexImage", "Color", {"Vector": coordinate("UV", 2.9, (0.02, 0.02, 0.0))(tree)}, image=image)

    grid.color("udim", tiled)
    scene, _, _ = grid.build()
    test, reference = both(scene)
    pictures_to("nodes", "udim", test=test, reference=reference)
    # Tiles' borders blend differently: a pixel's width of each.
    assert np.percentile(np.abs(test - reference), 80) < 0.01
    magenta = np.abs(test - (1.25, 1.0, 1.25)).max(-1) < 1e-3
    assert (magenta == (np.abs(reference - (1.25, 1.0, 1.25)).max(-1) < 1e-3)).mean() > 0.9
    assert magenta.any() and not magenta.all()


# --- skies ------------------------------------------------------------------------------------------------------------


def test_a_sky_shines_as_in_cycles(blender, gl):
    """Each model of the Sky Texture this Blender has, turned, with its sun: what the camera sees of it, and the light it gives
    a plane. The sun is a light of its own in Quartet; its disc is wide here, so that pixels resolve it."""
    from gi_addon.compare.metrics import score
    from gi_addon.host.compat import node_tree
    from gi_addon.host.cycles import Reference, render_passes, set_up

    bpy = blender
    models = [i.identifier for i in bpy.types.ShaderNodeTexSky.bl_rna.properties["sky_type"].enum_items]
    for model in models:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        scene = bpy.context.scene
        scene.world = bpy.data.worlds.new("W")
        tree = node_tree(scene.world)
        tree.nodes.clear()
        out, background = tree.nodes.new("ShaderNodeOutputWorld"), tree.nodes.new("ShaderNodeBackground")
        sky = make(tree, "TexSky", "Color", sky_type=model, sun_disc=True, sun_elevation=0.5, sun_rotation=0.6,
                   altitude=200.0, sun_size=0.2, sun_direction=(0.4, 0.7, 0.5))  # fmt: skip
        background.inputs["Strength"].default_value = 0.3
        tree.links.new(sky, background.inputs["Color"])
        tree.links.new(background.outputs[0], out.inputs[0])
        mesh = bpy.data.meshes.new("P")
        mesh.from_pydata([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [], [(0, 1, 2, 3)])
        plane = bpy.data.objects.new("P", mesh)
        plane.location.z = -0.5
        scene.collection.objects.link(plane)
        camera = bpy.data.cameras.new("C")
        camera.angle = 2.2
        scene.camera = bpy.data.objects.new("C", camera)
        scene.camera.rotation_euler = (math.radians(95), 0, -0.4)
        scene.collection.objects.link(scene.camera)
        scene.render.resolution_x, scene.render.resolution_y = 48, 30
        scene.render.engine = "QUARTET"
        scene.quartet.samples = 8
        names = ["Environment", "Diffuse Direct"]
        test = render_passes(scene, names)
        set_up(scene, Reference(0, 48, 1))
        scene.cycles.max_bounces = 0
        reference = render_passes(scene, names)
        for name in names:
            s = score(test[name], reference[name])
            pictures_to("sky", f"{model}-{name}", test=test[name], reference=reference[name])
            # A sub-frame lights by a few directions of the sky: eight of them have that noise.
            gain, error = (0.04, 0.02) if name == "Diffuse Direct" else (0.02, 0.003)
            if model == "HOSEK_WILKIE":  # a fit
                gain, error = 0.05, 0.02
            assert abs(s.gain - 1.0) < gain and s.rel_mse < error, f"{model} {name}: {s.text()}"
