# SPDX-License-Identifier: GPL-3.0-or-later
"""Procedural textures and other nodes without images. What they compute stands in ``glsl/nodes/``, value for value as in
Cycles; ``tests/test_nodes.py`` compares each."""

from __future__ import annotations

import math

from ..scene import Node
from .compiler import COLOR, FLOAT, VECTOR, Compiler, Value
from .nodes import _coordinate, _normal, node
from .sky import sun_angles
from .spectrum import blackbody_table, wavelength_table

_DIMENSIONS = {"1D": 1, "2D": 2, "3D": 3, "4D": 4}
_MOST_OCTAVES = 15  # Blender's limit of Detail


def _point(c: Compiler, n: Node, dimensions: int, scale: str) -> str:
    """The node's point in its dimensions, scaled: Vector and W."""
    w = f"({c.input(n, 'W', FLOAT, 0.0).text} * {scale})" if dimensions in (1, 4) else ""
    if dimensions == 1:
        return w
    co = f"({_coordinate(c, n, 'point.generated')}) * {scale}"
    return {2: f"({co}).xy", 3: co, 4: f"vec4({co}, {w})"}[dimensions]


def _octaves(c: Compiler, n: Node, default: float, name: str = "Detail") -> tuple[Value, int]:
    """Detail, and the most whole octaves after the first that it can ask for."""
    detail = c.input(n, name, FLOAT, default)
    if detail.constant is None:
        return Value(FLOAT, f"clamp({detail.text}, 0.0, {_MOST_OCTAVES}.0)"), _MOST_OCTAVES
    number = min(max(detail.constant[0], 0.0), float(_MOST_OCTAVES))
    return c.constant(number, FLOAT), math.ceil(number)


@node("TEX_NOISE")
def noise(c: Compiler, n: Node) -> dict[str, Value]:
    """Gradient noise and its fractals. The colour is the same noise at three places."""
    c.include("nodes/noise.glsl")
    dimensions = _DIMENSIONS[n.params.get("noise_dimensions", "3D")]
    type = ("float", "vec2", "vec3", "vec4")[dimensions - 1]
    scale = c.input(n, "Scale", FLOAT, 5.0)
    detail, most = _octaves(c, n, 2.0)
    roughness, lacunarity = c.input(n, "Roughness", FLOAT, 0.5), c.input(n, "Lacunarity", FLOAT, 2.0)
    offset, gain = c.input(n, "Offset", FLOAT, 0.0), c.input(n, "Gain", FLOAT, 1.0)
    p, s = c.name(), c.name()
    c.statement(f"{type} {p} = {_point(c, n, dimensions, scale.text)};")
    c.statement(
        f"NoiseSettings {s} = NoiseSettings({detail.text}, max({roughness.text}, 0.0), {lacunarity.text}, {offset.text}, "
        f"{gain.text}, {most});"
    )
    distortion = c.input(n, "Distortion", FLOAT, 0.0)
    if not distortion.is_zero:
        c.statement(f"{p} = noise_distort({p}, {distortion.text});")
    function = "noise_" + n.params.get("noise_type", "FBM").lower()
    if function == "noise_fbm":
        function += "_normalized" if n.params.get("normalize", True) else "_raw"
    value = c.variable(FLOAT, f"{function}({p}, {s})")
    out = {"Fac": value, "Color": Value(COLOR, f"vec3({value.text})")}
    if c.used(n, "Color"):
        # The seeds after those of the distortion.
        green, blue = (1, 2) if dimensions == 1 else (dimensions, dimensions + 1)
        more = [f"{function}({p} + noise_seed({k}.0, {p}), {s})" for k in (green, blue)]
        out["Color"] = c.variable(COLOR, f"vec3({value.text}, {more[0]}, {more[1]})")
    return out


@node("TEX_VORONOI")
def voronoi(c: Compiler, n: Node) -> dict[str, Value]:
    """Cells around scattered points. ``pcg`` tells the hash of Blender ≥ 5.0."""
    c.include("nodes/voronoi.glsl")
    dimensions = _DIMENSIONS[n.params.get("voronoi_dimensions", "3D")]
    feature = n.params.get("feature", "F1")
    metric = ("EUCLIDEAN", "MANHATTAN", "CHEBYCHEV", "MINKOWSKI").index(n.params.get("distance", "EUCLIDEAN"))
    scale = c.input(n, "Scale", FLOAT, 5.0)
    detail, most = _octaves(c, n, 0.0)
    roughness, lacunarity = c.input(n, "Roughness", FLOAT, 0.5), c.input(n, "Lacunarity", FLOAT, 2.0)
    smoothness, exponent = c.input(n, "Smoothness", FLOAT, 1.0), c.input(n, "Exponent", FLOAT, 0.5)
    randomness = c.input(n, "Randomness", FLOAT, 1.0)
    p, s = c.name(), c.name()
    co = _point(c, n, dimensions, scale.text)
    padding = {1: "vec4({0}, 0.0, 0.0, 0.0)", 2: "vec4({0}, 0.0, 0.0)", 3: "vec4({0}, 0.0)", 4: "{0}"}[dimensions]
    c.statement(f"vec4 {p} = {padding.format(co)};")
    kind = {"F2": 1, "SMOOTH_F1": 2}.get(feature, 0)
    pcg = int(n.params.get("pcg", True))
    for name, number in (("DIMENSIONS", dimensions), ("METRIC", metric), ("FEATURE", kind), ("PCG", pcg)):
        c.macro(f"VORONOI_{name}", number, "s.dims" if name == "DIMENSIONS" else f"s.{name.lower()}")
    normalize = "true" if n.params.get("normalize", False) else "false"
    c.statement(
        f"VoronoiSettings {s} = VoronoiSettings({dimensions}, {metric}, {kind}, {pcg}, {most}, "
        f"{normalize}, {detail.text}, saturate({roughness.text}), {lacunarity.text}, "
        f"0.5 * saturate({smoothness.text}), {exponent.text}, saturate({randomness.text}));"
    )
    zero, black = Value(FLOAT, "0.0", (0.0,)), Value(VECTOR, "vec3(0.0)")
    out = {"Distance": zero, "Color": Value(COLOR, "vec3(0.0)"), "Position": black, "W": zero, "Radius": zero}
    if feature == "DISTANCE_TO_EDGE":
        return out | {"Distance": c.variable(FLOAT, f"node_voronoi_edge({p}, {s})")}
    if feature == "N_SPHERE_RADIUS":
        return out | {"Radius": c.variable(FLOAT, f"node_voronoi_radius({p}, {s})")}
    v = c.name()
    c.statement(f"Voronoi {v} = node_voronoi({p}, {s});")
    position = c.variable(VECTOR, f"safe_divide({v}.position.xyz, vec3({scale.text}))")
    w = f"safe_divide({v}.position.{'x' if dimensions == 1 else 'w'}, {scale.text})"
    return out | {
        "Distance": Value(FLOAT, f"{v}.distance_"), "Color": Value(COLOR, f"{v}.color"),
        "Position": position if dimensions > 1 else black, "W": Value(FLOAT, w),
    }  # fmt: skip


@node("TEX_WHITE_NOISE")
def white_noise(c: Compiler, n: Node) -> dict[str, Value]:
    c.include("nodes/hash.glsl")
    p = _point(c, n, _DIMENSIONS[n.params.get("noise_dimensions", "3D")], "1.0")
    value = Value(FLOAT, f"hash_unit({p})")
    color = c.variable(COLOR, f"hash_color({p})") if c.used(n, "Color") else Value(COLOR, f"vec3({value.text})")
    return {"Value": value, "Color": color}


@node("TEX_GRADIENT")
def gradient(c: Compiler, n: Node) -> dict[str, Value]:
    c.include("nodes/procedural.glsl")
    kinds = ("LINEAR", "QUADRATIC", "EASING", "DIAGONAL", "RADIAL", "QUADRATIC_SPHERE", "SPHERICAL")
    kind = kinds.index(n.params.get("gradient_type", "LINEAR"))
    f = c.variable(FLOAT, f"node_gradient({_coordinate(c, n, 'point.generated')}, {kind})")
    return {"Fac": f, "Color": Value(COLOR, f"vec3({f.text})")}


@node("TEX_WAVE")
def wave(c: Compiler, n: Node) -> dict[str, Value]:
    c.include("nodes/procedural.glsl")
    rings = n.params.get("wave_type", "BANDS") == "RINGS"
    direction = n.params.get("rings_direction" if rings else "bands_direction", "X")
    axis = ("X", "Y", "Z").index(direction) if direction in "XYZ" else 3
    profile = ("SIN", "SAW", "TRI").index(n.params.get("wave_profile", "SIN"))
    scale = c.input(n, "Scale", FLOAT, 5.0)
    detail, most = _octaves(c, n, 2.0)
    roughness = c.input(n, "Detail Roughness", FLOAT, 0.5)
    settings = f"NoiseSettings({detail.text}, {roughness.text}, 2.0, 0.0, 0.0, {most})"
    f = c.variable(
        FLOAT,
        f"node_wave(({_coordinate(c, n, 'point.generated')}) * {scale.text}, {int(rings)}, {axis}, {profile}, "
        f"{c.input(n, 'Distortion', FLOAT, 0.0).text}, {settings}, {c.input(n, 'Detail Scale', FLOAT, 1.0).text}, "
        f"{c.input(n, 'Phase Offset', FLOAT, 0.0).text})",
    )
    return {"Fac": f, "Color": Value(COLOR, f"vec3({f.text})")}


@node("TEX_MAGIC")
def magic(c: Compiler, n: Node) -> dict[str, Value]:
    c.include("nodes/procedural.glsl")
    scale, distortion = c.input(n, "Scale", FLOAT, 5.0), c.input(n, "Distortion", FLOAT, 1.0)
    depth = int(n.params.get("turbulence_depth", 2))
    co = _coordinate(c, n, "point.generated")
    color = c.variable(COLOR, f"node_magic({co}, {scale.text}, {depth}, {distortion.text})")
    return {"Color": color, "Fac": Value(FLOAT, f"vector_mean({color.text})")}


@node("TEX_BRICK")
def brick(c: Compiler, n: Node) -> dict[str, Value]:
    c.include("nodes/procedural.glsl")
    names = (("Mortar Size", 0.02), ("Mortar Smooth", 0.1), ("Bias", 0.0), ("Brick Width", 0.5), ("Row Height", 0.25))
    numbers = ", ".join(c.input(n, name, FLOAT, default).text for name, default in names)
    offset, squash = c.constant(n.params.get("offset", 0.5), FLOAT), c.constant(n.params.get("squash", 1.0), FLOAT)
    scale = c.input(n, "Scale", FLOAT, 5.0)
    v = c.name()
    c.statement(
        f"vec2 {v} = node_brick(({_coordinate(c, n, 'point.generated')}) * {scale.text}, {numbers}, {offset.text}, "
        f"{int(n.params.get('offset_frequency', 2))}, {squash.text}, {int(n.params.get('squash_frequency', 2))});"
    )
    a, b = c.input(n, "Color1", COLOR, (0.8,) * 3), c.input(n, "Color2", COLOR, (0.2,) * 3)
    mortar = c.input(n, "Mortar", COLOR, (0.0,) * 3)
    color = c.variable(COLOR, f"mix(mix({a.text}, {b.text}, {v}.x), {mortar.text}, {v}.y)")
    return {"Color": color, "Fac": Value(FLOAT, f"{v}.y")}


@node("TEX_SKY")
def sky_texture(c: Compiler, n: Node) -> dict[str, Value]:
    """An atmosphere by its image ``image`` (:mod:`.sky`) and the sun's disc. With ``sun_light`` the sun shines as a light
    of its own, and maps of the world for light leave it out."""
    index = n.params.get("image")
    if index is None:
        c.approximate(n, f"the {n.params.get('sky_type', 'given')} sky model is a constant")
        return {"Color": c.constant((0.3, 0.3, 0.3), COLOR)}
    if n.params.get("sky_type") == "HOSEK_WILKIE":
        c.approximate(n, "Hosek's and Wilkie's sky is a fit, within 3 to 7 % of it at most turbidities")
    c.include("nodes/sky.glsl")
    sampler = c.image(index, "Linear", "REPEAT")
    elevation, rotation = sun_angles(n.params)
    size = float(n.params.get("sun_size", 0.00951)) if n.params.get("sun_disc", False) else -1.0
    intensity = float(n.params.get("sun_intensity", 1.0))
    ends = [c.constant(tuple(v * intensity for v in n.params.get(k, (0.0,) * 3)), COLOR).text for k in ("sun_low", "sun_high")]
    numbers = ", ".join(c.constant(v, FLOAT).text for v in (elevation, rotation, size))
    shown = "WORLD_SUN_DISC" if n.params.get("sun_light") and c.world else "1"
    co = _coordinate(c, n, "point.position_ws" if c.world else "point.generated")
    text = f"node_sky({sampler}, {co}, {numbers}, {ends[0]}, {ends[1]}, {shown})"
    return {"Color": c.variable(COLOR, text)}


# --- light and colour -------------------------------------------------------------------------------------------------


@node("BLACKBODY")
def blackbody(c: Compiler, n: Node) -> dict[str, Value]:
    """The colour of a black body of luminance 1, looked up over 1/temperature."""
    first, count = c.table(blackbody_table())
    t = c.input(n, "Temperature", FLOAT, 1500.0)
    out = c.name()
    c.statement(f"vec4 {out} = node_table({first}, {count}, (1e4 / clamp({t.text}, 800.0, 12000.0) - 0.833333333) / "
                "11.6666667, TABLE_LINEAR);")  # fmt: skip
    return {"Color": Value(COLOR, f"{out}.xyz")}


@node("WAVELENGTH")
def wavelength(c: Compiler, n: Node) -> dict[str, Value]:
    """The colour of one wavelength, black outside 380 to 780 nm."""
    first, count = c.table(wavelength_table())
    nm = c.input(n, "Wavelength", FLOAT, 500.0)
    out = c.name()
    c.statement(f"vec4 {out} = node_table({first}, {count}, ({nm.text} - 380.0) / 400.0, TABLE_LINEAR) * "
                f"float({nm.text} >= 380.0 && {nm.text} < 780.0);")  # fmt: skip
    return {"Color": Value(COLOR, f"max({out}.xyz, vec3(0.0))")}


# --- vectors ----------------------------------------------------------------------------------------------------------


@node("VECTOR_ROTATE")
def vector_rotate(c: Compiler, n: Node) -> dict[str, Value]:
    v, center = c.input(n, "Vector", VECTOR, 0.0), c.input(n, "Center", VECTOR, 0.0)
    kind = n.params.get("rotation_type", "AXIS_ANGLE")
    invert = bool(n.params.get("invert", False))
    if kind == "EULER_XYZ":
        m = f"euler_xyz({c.input(n, 'Rotation', VECTOR, 0.0).text})"
        m = f"transpose({m})" if invert else m
        return {"Vector": c.variable(VECTOR, f"{m} * ({v.text} - {center.text}) + {center.text}")}
    axes = {"X_AXIS": "vec3(1.0, 0.0, 0.0)", "Y_AXIS": "vec3(0.0, 1.0, 0.0)", "Z_AXIS": "vec3(0.0, 0.0, 1.0)"}
    axis = axes.get(kind) or c.input(n, "Axis", VECTOR, (0.0, 0.0, 1.0)).text
    angle = c.input(n, "Angle", FLOAT, 0.0).text
    angle = f"-({angle})" if invert else angle
    return {"Vector": c.variable(VECTOR, f"node_rotate({v.text}, {center.text}, {axis}, {angle})")}


@node("VECT_TRANSFORM")
def vector_transform(c: Compiler, n: Node) -> dict[str, Value]:
    """Between world, object and camera space. A normal comes out as a unit vector."""
    v = c.input(n, "Vector", VECTOR, 0.0)
    kind = ("POINT", "VECTOR", "NORMAL").index(n.params.get("vector_type", "VECTOR"))
    source, target = n.params.get("convert_from", "WORLD"), n.params.get("convert_to", "OBJECT")
    text = v.text
    if source != target:
        if source != "WORLD":
            text = f"world_from_{source.lower()}({text}, {kind}, point)"
        if target != "WORLD":
            text = f"{target.lower()}_from_world({text}, {kind}, point)"
        c.include("nodes/spaces.glsl")
    text = f"safe_normalize({text})" if kind == 2 else text
    return {"Vector": c.variable(VECTOR, text)}


@node("CAMERA")
def camera_data(c: Compiler, n: Node) -> dict[str, Value]:
    return {
        "View Vector": Value(VECTOR, "safe_normalize(point.position_vs)"),
        "View Z Depth": Value(FLOAT, "abs(point.position_vs.z)"),
        "View Distance": Value(FLOAT, "length(point.position_vs)"),
    }


@node("TANGENT")
def tangent(c: Compiler, n: Node) -> dict[str, Value]:
    """Around an axis of the object, or along a UV map's u."""
    if n.params.get("direction_type", "RADIAL") == "UV_MAP":
        uv = c.attribute("uv:" + n.params.get("uv_map", ""))
        return {"Tangent": c.variable(VECTOR, f"node_tangent_uv({uv}.xy, point)")}
    axis = "XYZ".index(n.params.get("axis", "Z"))
    c.include("nodes/spaces.glsl")
    return {"Tangent": c.variable(VECTOR, f"node_tangent_radial({axis}, point)")}


@node("HAIR_INFO")
def hair_info(c: Compiler, n: Node) -> dict[str, Value]:
    """Strands carry (1, place along them, random)."""
    v = c.attribute("attr:.hair")
    zero = Value(FLOAT, "0.0")
    return {
        "Is Strand": Value(FLOAT, f"{v}.x"), "Intercept": Value(FLOAT, f"{v}.y"), "Random": Value(FLOAT, f"{v}.z"),
        "Length": zero, "Thickness": zero, "Tangent Normal": Value(VECTOR, "point.normal_ws"),
    }  # fmt: skip


@node("SQUEEZE")
def squeeze(c: Compiler, n: Node) -> dict[str, Value]:
    v, width, center = (c.input(n, name, FLOAT, d).text for name, d in (("Value", 0.0), ("Width", 1.0), ("Center", 0.0)))
    return {"Value": c.variable(FLOAT, f"1.0 / (1.0 + pow(2.71828183, -(({v} - {center}) * {width})))")}


@node("LIGHT_FALLOFF")
def light_falloff(c: Compiler, n: Node) -> dict[str, Value]:
    """On surfaces there is no falloff to change: its strength passes."""
    strength = c.input(n, "Strength", FLOAT, 100.0)
    return dict.fromkeys(("Quadratic", "Linear", "Constant"), strength)


@node("BEVEL")
def bevel(c: Compiler, n: Node) -> dict[str, Value]:
    c.approximate(n, "edges are not rounded")
    return {"Normal": Value(VECTOR, _normal(c, n))}
