# SPDX-License-Identifier: GPL-3.0-or-later
"""What each shader node compiles to. Sockets go by their identifiers in Blender 4.5 to 5.2.

A node function takes the compiler and the node and returns its outputs by identifier. Its GLSL helpers stand in
``glsl/nodes/``.
"""

from __future__ import annotations

from collections.abc import Callable

from ..scene import POINTINESS, Node
from .compiler import CLOSURE, COLOR, FLOAT, VECTOR, Compiler, Value
from .means import BINARY
from .spectrum import sheen_table

NODES: dict[str, Callable[[Compiler, Node], dict[str, Value]]] = {}


def node(*kinds: str):
    """Register a node function for Blender node types."""

    def register(function):
        for kind in kinds:
            NODES[kind] = function
        return function

    return register


# Outputs that exist but are not what Cycles computes.
INEXACT = {
    ("NEW_GEOMETRY", "Random Per Island"): "Random Per Island is ½",
    ("NEW_GEOMETRY", "Parametric"): "Parametric is 0",
    ("HAIR_INFO", "Length"): "Length is 0",
    ("HAIR_INFO", "Thickness"): "Thickness is 0",
    ("LIGHT_PATH", "Ray Length"): "Ray Length is 0",
}
# Best constants of nodes that are not evaluated, by output.
_FALLBACK = {
    "TEX_NOISE": {"Fac": 0.5, "Color": 0.5}, "TEX_VORONOI": {"Distance": 0.4, "Color": 0.5}, "TEX_WAVE": {"Fac": 0.5},
    "TEX_MAGIC": {"Fac": 0.5, "Color": 0.5}, "TEX_GRADIENT": {"Fac": 0.5}, "TEX_WHITE_NOISE": {"Value": 0.5},
    "TEX_GABOR": {"Value": 0.5}, "AMBIENT_OCCLUSION": {"AO": 1.0, "Color": 1.0}, "WIREFRAME": {"Fac": 0.0},
    "BEVEL": {}, "TEX_SKY": {"Color": 0.3}, "BLACKBODY": {"Color": 1.0}, "WAVELENGTH": {"Color": 0.3},
}  # fmt: skip


def fallback(c: Compiler, n: Node) -> dict[str, Value]:
    """Any node without a function: its colour inputs' mean, or a constant that stands for it."""
    c.approximate(n, f"node type {n.kind} is not evaluated")
    if n.kind in ("BSDF_TOON", "BSDF_HAIR", "BSDF_HAIR_PRINCIPLED", "BSDF_RAY_PORTAL"):
        return _outputs(diffuse(c, n))
    if n.kind in ("VOLUME_ABSORPTION", "VOLUME_SCATTER", "PRINCIPLED_VOLUME", "VOLUME_COEFFICIENTS"):
        return {name: Value(CLOSURE, "closure_none()") for name in ("BSDF", "Holdout", "Volume", "Shader")}
    colors = [v for k, v in n.inputs.items() if k.startswith("Color") and isinstance(v, tuple)]
    mean = tuple(sum(v[i] for v in colors) / len(colors) for i in range(3)) if colors else (0.5, 0.5, 0.5)
    table = _FALLBACK.get(n.kind, {})
    out = {"Color": c.constant(table.get("Color", mean), COLOR)}
    for name in ("Fac", "Value", "Distance", "Alpha", "AO", "Factor", "Result"):
        out[name] = c.constant(table.get(name, 1.0 if name == "Alpha" else 0.5), FLOAT)
    out["Vector"] = c.constant((0.0, 0.0, 0.0), VECTOR)
    out["Normal"] = Value(VECTOR, "point.normal_ws")
    for name in ("BSDF", "Shader", "Emission", "Background"):
        out[name] = Value(CLOSURE, "closure_none()")
    return out


def _outputs(values: dict[str, Value]) -> dict[str, Value]:
    """A closure under every name a closure output goes by."""
    closure = next(iter(values.values()))
    return dict.fromkeys(("BSDF", "BSSRDF", "Emission", "Background", "Shader"), closure)


# --- closures ---------------------------------------------------------------------------------------------------------


def _normal(c: Compiler, n: Node, name: str = "Normal") -> str:
    """A normal input: the surface's own unless linked."""
    if c.linked(n, name):
        return c.variable(VECTOR, f"surface_normal(point, {c.input(n, name, VECTOR).text})").text
    return "point.normal_ws"


@node("BSDF_PRINCIPLED")
def principled(c: Compiler, n: Node) -> dict[str, Value]:
    """Blender's Principled BSDF: alpha over (metal | glass | (specular over diffuse and subsurface)), plus emission.

    Anisotropy and thin film are left out and said so. The coat is a second dielectric layer folded into the one glossy lobe;
    sheen takes its share from all below and is scattered as diffuse light.
    """
    r = c.result
    base = c.input(n, "Base Color", COLOR, (0.8, 0.8, 0.8))
    metallic = c.input(n, "Metallic", FLOAT, 0.0)
    roughness = c.input(n, "Roughness", FLOAT, 0.5)
    ior = c.input(n, "IOR", FLOAT, 1.5)
    level = c.input(n, "Specular IOR Level", FLOAT, 0.5)
    tint = c.input(n, "Specular Tint", COLOR, (1.0, 1.0, 1.0))
    alpha = c.input(n, "Alpha", FLOAT, 1.0)
    normal = _normal(c, n)
    multi = "1.0" if n.params.get("distribution", "MULTI_GGX") == "MULTI_GGX" else "0.0"
    for name, what in (("Anisotropic", "anisotropy"), ("Diffuse Roughness", "diffuse roughness"),
                       ("Thin Film Thickness", "thin film")):  # fmt: skip
        if not c.input(n, name, FLOAT, 0.0).is_zero:
            c.approximate(n, f"{what} is left out")
    out = c.name()
    c.statement(
        f"Closure {out} = principled_closure({base.text}, {metallic.text}, {roughness.text}, {ior.text}, {level.text}, "
        f"{tint.text}, {normal}, {multi}, point);"
    )
    if not metallic.equals(1.0):
        r.diffuse = True
    r.glossy = True
    transmission = c.input(n, "Transmission Weight", FLOAT, 0.0)
    if not transmission.is_zero:
        r.transmissive = True
        r.tinted |= _coloured(base)
        c.statement(f"principled_transmission({out}, {base.text}, {metallic.text}, {roughness.text}, {ior.text}, "
                    f"{tint.text}, {transmission.text}, {normal}, {multi}, point);")  # fmt: skip
    subsurface = c.input(n, "Subsurface Weight", FLOAT, 0.0)
    if not subsurface.is_zero:
        r.subsurface = True
        path = _free_path(c, n, "Subsurface Radius", "Subsurface Scale")
        c.statement(f"principled_subsurface({out}, {base.text}, {subsurface.text}, {path}, "
                    f"{roughness.text}, principled_ior({ior.text}, {level.text}));")  # fmt: skip
    coat = c.input(n, "Coat Weight", FLOAT, 0.0)
    emission = c.input(n, "Emission Color", COLOR, (1.0, 1.0, 1.0))
    strength = c.input(n, "Emission Strength", FLOAT, 0.0)
    if not emission.is_zero and not strength.is_zero:
        r.emissive = True
        c.statement(f"{out}.emission = {emission.text} * {strength.text};")
    if not coat.is_zero:
        c.approximate(n, "the coat shares the base's glossy lobe")
        c.statement(
            f"principled_coat({out}, {coat.text}, {c.input(n, 'Coat Roughness', FLOAT, 0.03).text}, "
            f"{c.input(n, 'Coat IOR', FLOAT, 1.5).text}, {c.input(n, 'Coat Tint', COLOR, (1.0, 1.0, 1.0)).text}, point);"
        )
    sheen = c.input(n, "Sheen Weight", FLOAT, 0.0)
    if not sheen.is_zero:
        r.diffuse = True
        first = _sheen(c, n, c.input(n, "Sheen Roughness", FLOAT, 0.5))
        sheen_tint = c.input(n, "Sheen Tint", COLOR, (1.0, 1.0, 1.0))
        c.statement(f"principled_sheen({out}, saturate({sheen.text}), {sheen_tint.text}, {first}, {normal}, point);")
    if not alpha.equals(1.0):
        r.transparent = True
        c.statement(f"{out} = closure_alpha({out}, {alpha.text});")
    return {"BSDF": Value(CLOSURE, out)}


def _sheen(c: Compiler, n: Node, roughness: Value) -> int:
    """The first parameter of sheen's albedo at the node's roughness; one that varies counts as ½."""
    if roughness.constant is None:
        c.approximate(n, "sheen's roughness counts as ½")
    return c.table(sheen_table(roughness.constant[0] if roughness.constant else 0.5))[0]


@node("BSDF_SHEEN")
def sheen(c: Compiler, n: Node) -> dict[str, Value]:
    """Fabric's shine, scattered as diffuse light."""
    c.result.diffuse = True
    if n.params.get("distribution", "MICROFIBER") != "MICROFIBER":
        c.approximate(n, "Ashikhmin's sheen is taken for the microfibre one")
    color = c.input(n, "Color", COLOR, (0.8,) * 3)
    first, normal = _sheen(c, n, c.input(n, "Roughness", FLOAT, 0.5)), _normal(c, n)
    return {"BSDF": c.variable(CLOSURE, f"closure_diffuse({color.text} * sheen_albedo({first}, {normal}, point), {normal})")}


@node("BSDF_DIFFUSE")
def diffuse(c: Compiler, n: Node) -> dict[str, Value]:
    """Lambert. A roughness above 0 (Oren-Nayar in Cycles) is approximated by it."""
    if not c.input(n, "Roughness", FLOAT, 0.0).is_zero:
        c.approximate(n, "diffuse roughness is left out")
    c.result.diffuse = True
    color = c.input(n, "Color", COLOR, (0.8, 0.8, 0.8))
    return {"BSDF": c.variable(CLOSURE, f"closure_diffuse({color.text}, {_normal(c, n)})")}


@node("BSDF_GLOSSY", "BSDF_ANISOTROPIC", "BSDF_METALLIC")
def glossy(c: Compiler, n: Node) -> dict[str, Value]:
    """GGX without Fresnel (Glossy), or with Schlick's from F0 towards white (Metallic)."""
    c.result.glossy = True
    metallic = n.kind == "BSDF_METALLIC"
    color = c.input(n, "Base Color" if metallic else "Color", COLOR, (0.8, 0.8, 0.8))
    if metallic and n.params.get("fresnel_type") == "PHYSICAL_CONDUCTOR":
        index = c.input(n, "IOR", VECTOR, (2.757, 2.513, 2.231))
        extinction = c.input(n, "Extinction", VECTOR, (3.867, 3.404, 3.009))
        color = c.variable(COLOR, f"conductor_f0({index.text}, {extinction.text})")
    elif metallic and not c.input(n, "Edge Tint", COLOR, (1.0, 1.0, 1.0)).equals(1.0):
        c.approximate(n, "the edge tint is left out")
    roughness = c.input(n, "Roughness", FLOAT, 0.5)
    if not c.input(n, "Anisotropy", FLOAT, 0.0).is_zero:
        c.approximate(n, "anisotropy is left out")
    multi = "1.0" if n.params.get("distribution") == "MULTI_GGX" else "0.0"
    curve = "ETA_SCHLICK" if metallic else "ETA_CONSTANT"
    return {"BSDF": c.variable(
        CLOSURE, f"closure_glossy({color.text}, {roughness.text}, {curve}, {multi}, {_normal(c, n)})")}  # fmt: skip


@node("BSDF_GLASS", "BSDF_REFRACTION")
def glass(c: Compiler, n: Node) -> dict[str, Value]:
    """Reflection and refraction by Fresnel (Glass) or refraction alone."""
    c.result.transmissive = True
    color = c.input(n, "Color", COLOR, (1.0, 1.0, 1.0))
    c.result.tinted |= _coloured(color)
    roughness = c.input(n, "Roughness", FLOAT, 0.0)
    ior = c.input(n, "IOR", FLOAT, 1.5)
    normal = _normal(c, n)
    if n.kind == "BSDF_GLASS":
        c.result.glossy = True
        return {"BSDF": c.variable(
            CLOSURE, f"closure_glass({color.text}, {roughness.text}, {ior.text}, {normal}, point)")}  # fmt: skip
    return {"BSDF": c.variable(CLOSURE, f"closure_refraction({color.text}, {roughness.text}, {ior.text}, {normal})")}


@node("EMISSION")
def emission(c: Compiler, n: Node) -> dict[str, Value]:
    """Radiance, the same in all directions."""
    color = c.input(n, "Color", COLOR, (1.0, 1.0, 1.0))
    strength = c.input(n, "Strength", FLOAT, 1.0)
    if color.is_zero or strength.is_zero:
        return {"Emission": Value(CLOSURE, "closure_none()", (0.0, 0.0, 0.0))}
    c.result.emissive = True
    return {"Emission": _emission(c, color, strength)}


@node("BACKGROUND")
def background(c: Compiler, n: Node) -> dict[str, Value]:
    """A world's radiance."""
    color = c.input(n, "Color", COLOR, (0.8, 0.8, 0.8))
    return {"Background": _emission(c, color, c.input(n, "Strength", FLOAT, 1.0))}


def _emission(c: Compiler, color: Value, strength: Value) -> Value:
    constant = None
    if strength.is_zero:
        constant = (0.0, 0.0, 0.0)
    elif color.constant is not None and strength.constant is not None:
        constant = tuple(v * strength.constant[0] for v in color.constant)
    return c.variable(CLOSURE, f"closure_emission({color.text} * {strength.text})", constant)


def _coloured(color: Value) -> bool:
    """Whether a colour is, or may be, other than gray."""
    return color.constant is None or len(set(color.constant)) > 1


@node("BSDF_TRANSPARENT")
def transparent(c: Compiler, n: Node) -> dict[str, Value]:
    """Light goes straight on, tinted."""
    c.result.transparent = True
    color = c.input(n, "Color", COLOR, (1.0, 1.0, 1.0))
    c.result.tinted |= _coloured(color)
    return {"BSDF": c.variable(CLOSURE, f"closure_transparent({color.text})")}


@node("HOLDOUT")
def holdout(c: Compiler, n: Node) -> dict[str, Value]:
    """A hole in the picture; to light it is black."""
    return {"Holdout": Value(CLOSURE, "closure_holdout()")}


@node("BSDF_TRANSLUCENT")
def translucent(c: Compiler, n: Node) -> dict[str, Value]:
    """Diffuse transmission to the far side."""
    c.result.transmissive = True
    color = c.input(n, "Color", COLOR, (0.8, 0.8, 0.8))
    return {"BSDF": c.variable(CLOSURE, f"closure_translucent({color.text}, {_normal(c, n)})")}


def _free_path(c: Compiler, n: Node, radius: str, scale: str) -> str:
    """Mean free path below the surface, m: radius × scale, × what the Blender that the node is from makes of it."""
    lengths = f"{c.input(n, radius, VECTOR, (1.0, 0.2, 0.1)).text} * {c.input(n, scale, FLOAT, 0.05).text}"
    factor = n.params.get("mean_free_path")
    return lengths if factor is None else f"{lengths} * {c.constant(factor, FLOAT).text}"


@node("SUBSURFACE_SCATTERING")
def subsurface_scattering(c: Compiler, n: Node) -> dict[str, Value]:
    """Diffuse that blurs over ``Radius`` × ``Scale``."""
    c.result.diffuse = c.result.subsurface = True
    color = c.input(n, "Color", COLOR, (0.8, 0.8, 0.8))
    path = _free_path(c, n, "Radius", "Scale")
    roughness = c.input(n, "Roughness", FLOAT, 1.0)
    ior = c.input(n, "IOR", FLOAT, 1.4)
    closure = c.variable(CLOSURE, f"closure_diffuse({color.text}, {_normal(c, n)})")
    c.statement(f"principled_subsurface({closure.text}, {color.text}, 1.0, {path}, "
                f"{roughness.text}, {ior.text});")  # fmt: skip
    return {"BSSRDF": closure}


@node("MIX_SHADER")
def mix_shader(c: Compiler, n: Node) -> dict[str, Value]:
    """Linear mix of two closures. Blender names both sockets alike: identifiers ``Shader`` and ``Shader_001``."""
    factor = c.input(n, "Fac", FLOAT, 0.5)
    if factor.equals(0.0):
        return {"Shader": c.input(n, "Shader", CLOSURE)}
    if factor.equals(1.0):
        return {"Shader": c.input(n, "Shader_001", CLOSURE)}
    a, b = c.input(n, "Shader", CLOSURE), c.input(n, "Shader_001", CLOSURE)
    return {"Shader": c.variable(CLOSURE, f"closure_mix({a.text}, {b.text}, {factor.text})")}


@node("ADD_SHADER")
def add_shader(c: Compiler, n: Node) -> dict[str, Value]:
    """Sum of two closures."""
    a, b = c.input(n, "Shader", CLOSURE), c.input(n, "Shader_001", CLOSURE)
    constant = None
    if a.constant is not None and b.constant is not None:
        constant = tuple(x + y for x, y in zip(a.constant, b.constant, strict=True))
    return {"Shader": c.variable(CLOSURE, f"closure_add({a.text}, {b.text})", constant)}


# --- inputs -----------------------------------------------------------------------------------------------------------


@node("RGB")
def rgb(c: Compiler, n: Node) -> dict[str, Value]:
    return {"Color": c.constant(n.params.get("value", (0.5, 0.5, 0.5)), COLOR)}


@node("VALUE")
def value(c: Compiler, n: Node) -> dict[str, Value]:
    return {"Value": c.constant(n.params.get("value", 0.0), FLOAT)}


# A surface point where Blender has it (``Renderer.begin`` moves far scenes).
_POSITION = "(point.position_ws + view.world_origin)"


def _transformed(c: Compiler, v: str, rows) -> str:
    """``v`` under an affine matrix (three rows of four)."""
    columns = ", ".join(c.constant(tuple(row[:3]), VECTOR).text for row in rows)
    offset = c.constant(tuple(row[3] for row in rows), VECTOR)
    return c.variable(VECTOR, f"({v}) * mat3({columns}) + {offset.text}").text


@node("TEX_COORD")
def texture_coordinate(c: Compiler, n: Node) -> dict[str, Value]:
    """Object coordinates are this object's own, or those of ``object_matrix`` (3 rows of four: object from world)."""
    direction = local = "point.position_ws" if c.world else "point.position_os"
    rows = n.params.get("object_matrix")
    if rows and c.used(n, "Object"):
        local = _transformed(c, "point.position_ws" if c.world else _POSITION, rows)
    uv = Value(VECTOR, "vec3(0.0)")
    if c.used(n, "UV") and not c.world:
        uv = Value(VECTOR, f"vec3({c.attribute('uv:')}.xy, 0.0)")
    return {
        "Generated": Value(VECTOR, direction if c.world else "point.generated"),
        "Normal": Value(VECTOR, "point.normal_ws" if c.world else "point.normal_os"),
        "UV": uv,
        "Object": Value(VECTOR, local),
        "Camera": Value(VECTOR, "point.position_vs"),
        "Window": Value(VECTOR, "vec3(point.window, 0.0)"),
        "Reflection": Value(VECTOR, "reflect(-point.view_ws, point.normal_ws)"),
    }


@node("UVMAP")
def uv_map(c: Compiler, n: Node) -> dict[str, Value]:
    return {"UV": Value(VECTOR, f"vec3({c.attribute('uv:' + n.params.get('uv_map', ''))}.xy, 0.0)")}


@node("ATTRIBUTE")
def attribute(c: Compiler, n: Node) -> dict[str, Value]:
    """A mesh attribute by name. Those of objects, instancers and view layers are numbers, which ``value`` (4,) holds."""
    name = n.params.get("attribute_name", "")
    if n.params.get("carried"):  # by the instance, in place of its colour
        return _attribute("point.object_color")
    if n.params.get("attribute_type", "GEOMETRY") != "GEOMETRY":
        *rgb, alpha = n.params.get("value", (0.0, 0.0, 0.0, 0.0))
        color = c.constant(tuple(rgb), COLOR)
        return {
            "Color": color, "Vector": c.constant(tuple(rgb), VECTOR), "Fac": c.constant(sum(rgb) / 3.0, FLOAT),
            "Alpha": c.constant(alpha, FLOAT),
        }  # fmt: skip
    v = c.attribute(f"attr:{name}")
    return _attribute(v)


@node("VERTEX_COLOR")
def vertex_color(c: Compiler, n: Node) -> dict[str, Value]:
    return _attribute(c.attribute(f"color:{n.params.get('layer_name', '')}"))


def _attribute(v: str) -> dict[str, Value]:
    return {
        "Color": Value(COLOR, f"{v}.xyz"),
        "Vector": Value(VECTOR, f"{v}.xyz"),
        "Fac": Value(FLOAT, f"vector_mean({v}.xyz)"),
        "Alpha": Value(FLOAT, f"{v}.w"),
    }


@node("NEW_GEOMETRY")
def geometry(c: Compiler, n: Node) -> dict[str, Value]:
    return {
        "Position": Value(VECTOR, "point.position_ws" if c.world else _POSITION),
        "Normal": Value(VECTOR, "point.normal_ws"),
        "Tangent": Value(VECTOR, "vec3(1.0, 0.0, 0.0)"),
        "True Normal": Value(VECTOR, "point.geometric_normal_ws"),
        "Incoming": Value(VECTOR, "point.view_ws"),
        "Parametric": Value(VECTOR, "vec3(0.0)"),
        "Backfacing": Value(FLOAT, "point.backfacing"),
        "Pointiness": Value(FLOAT, f"{c.attribute(f'attr:{POINTINESS}')}.x" if c.used(n, "Pointiness") else "0.5"),
        "Random Per Island": Value(FLOAT, "0.5"),
    }


@node("OBJECT_INFO")
def object_info(c: Compiler, n: Node) -> dict[str, Value]:
    return {
        "Location": Value(VECTOR, "(point.object_location + view.world_origin)"),
        "Color": Value(COLOR, "point.object_color.xyz"),
        "Alpha": Value(FLOAT, "point.object_color.w"),
        "Object Index": Value(FLOAT, "point.object_index"),
        "Material Index": Value(FLOAT, "0.0"),
        "Random": Value(FLOAT, "point.object_random"),
    }


@node("LIGHT_PATH")
def light_path(c: Compiler, n: Node) -> dict[str, Value]:
    """Which pass evaluates the material decides: the camera's G-buffer, or a light's or voxel's view."""
    camera = Value(FLOAT, "SURFACE_SEEN_BY_CAMERA")
    indirect = Value(FLOAT, "(1.0 - SURFACE_SEEN_BY_CAMERA)")
    zero = Value(FLOAT, "0.0", (0.0,))
    out = dict.fromkeys(
        ("Is Glossy Ray", "Is Singular Ray", "Is Reflection Ray", "Is Transmission Ray", "Ray Length", "Glossy Depth",
         "Transmission Depth", "Transparent Depth", "Portal Depth", "Is Volume Scatter Ray"), zero,
    )  # fmt: skip
    out["Is Camera Ray"] = camera
    out["Is Diffuse Ray"] = indirect
    out["Ray Depth"] = out["Diffuse Depth"] = indirect
    out["Is Shadow Ray"] = Value(FLOAT, "SURFACE_SEEN_BY_SHADOW")
    return out


@node("FRESNEL")
def fresnel(c: Compiler, n: Node) -> dict[str, Value]:
    ior = c.input(n, "IOR", FLOAT, 1.5)
    return {"Fac": c.variable(FLOAT, f"node_fresnel({ior.text}, {_normal(c, n)}, point)")}


@node("LAYER_WEIGHT")
def layer_weight(c: Compiler, n: Node) -> dict[str, Value]:
    blend = c.input(n, "Blend", FLOAT, 0.5)
    v = c.variable(VECTOR, f"node_layer_weight({blend.text}, {_normal(c, n)}, point)")
    return {"Fresnel": Value(FLOAT, f"{v.text}.x"), "Facing": Value(FLOAT, f"{v.text}.y")}


# --- textures ---------------------------------------------------------------------------------------------------------


def _coordinate(c: Compiler, n: Node, default: str) -> str:
    """The texture coordinate: the linked vector, or ``default``; then the node's own mapping."""
    text = c.input(n, "Vector", VECTOR).text if c.linked(n, "Vector") else default
    mapping = n.params.get("texture_mapping")
    return _transformed(c, text, mapping) if mapping else text


@node("TEX_IMAGE")
def image_texture(c: Compiler, n: Node) -> dict[str, Value]:
    """An image looked up by UV (or whatever is linked): flat, box, sphere or tube projection."""
    index = n.params.get("image")
    if index is None:  # as Cycles shows what it does not find
        return {"Color": c.constant((1.0, 0.0, 1.0), COLOR), "Alpha": c.constant(1.0, FLOAT)}
    co = _coordinate(c, n, f"vec3({c.attribute('uv:')}.xy, 0.0)")
    sampler = c.image(index, n.params.get("interpolation", "Linear"), n.params.get("extension", "REPEAT"))
    projection = n.params.get("projection", "FLAT")
    encoded, opaque = c.image_flags(index)
    extension = ("REPEAT", "EXTEND", "CLIP", "MIRROR").index(n.params.get("extension", "REPEAT"))
    if extension == 2 and n.params.get("interpolation") == "Closest":
        extension = 4
    flags = f"{int(encoded)}, {extension}"
    if projection == "BOX":
        blend = c.constant(n.params.get("projection_blend", 0.0), FLOAT)
        text = f"node_image_box({sampler}, {co}, point.normal_os, {blend.text}, {flags})"
    else:
        co = {"SPHERE": f"node_map_to_sphere({co})", "TUBE": f"node_map_to_tube({co})"}.get(projection, f"({co}).xy")
        cubic = n.params.get("interpolation") in ("Cubic", "Smart")
        kind = "" if projection == "FLAT" else "_around"
        text = f"node_image{'_cubic' if cubic else kind}({sampler}, {co}, {flags})"
        if n.params.get("tiles"):
            grid = ", ".join(f"{float(v)}" for v in n.params["tiles"])
            text = f"node_image_tiled({sampler}, {co}, vec4({grid}), {int(encoded)})"
    return _texel(c, n, text, opaque and extension not in (2, 4))


def _texel(c: Compiler, n: Node, text: str, opaque: bool) -> dict[str, Value]:
    """Colour and alpha of an image look-up; an alpha that is 1 everywhere is known to be."""
    out = c.name()
    c.statement(f"vec4 {out} = {text};")
    known = opaque or n.params.get("alpha_mode") == "NONE"
    return {"Color": Value(COLOR, f"{out}.xyz"), "Alpha": Value(FLOAT, "1.0", (1.0,)) if known else Value(FLOAT, f"{out}.w")}


@node("TEX_ENVIRONMENT")
def environment_texture(c: Compiler, n: Node) -> dict[str, Value]:
    index = n.params.get("image")
    if index is None:
        return {"Color": c.constant((0.0, 0.0, 0.0), COLOR), "Alpha": c.constant(0.0, FLOAT)}
    co = _coordinate(c, n, "point.position_ws")
    sampler = c.image(index, n.params.get("interpolation", "Linear"), "REPEAT")
    mapping = "node_direction_to_mirror_ball" if n.params.get("projection") == "MIRROR_BALL" else "node_equirect"
    encoded, opaque = c.image_flags(index)
    return _texel(c, n, f"node_image_around({sampler}, {mapping}({co}), {int(encoded)}, 0)", opaque)


@node("TEX_CHECKER")
def checker(c: Compiler, n: Node) -> dict[str, Value]:
    co = _coordinate(c, n, "point.generated")
    scale = c.input(n, "Scale", FLOAT, 5.0)
    fac = c.variable(FLOAT, f"node_checker({co} * {scale.text})")
    a, b = c.input(n, "Color1", COLOR, (0.8,) * 3), c.input(n, "Color2", COLOR, (0.2,) * 3)
    return {"Color": c.variable(COLOR, f"mix({b.text}, {a.text}, {fac.text})"), "Fac": fac}


# --- normals ----------------------------------------------------------------------------------------------------------


@node("NORMAL_MAP")
def normal_map(c: Compiler, n: Node) -> dict[str, Value]:
    """Tangent-space maps get their frame from screen-space derivatives of position and UV."""
    strength = c.input(n, "Strength", FLOAT, 1.0)
    color = c.input(n, "Color", COLOR, (0.5, 0.5, 1.0))
    space = n.params.get("space", "TANGENT")
    if space == "TANGENT":
        uv = c.attribute("uv:" + n.params.get("uv_map", ""))
        text = f"node_normal_map({color.text}, {strength.text}, {uv}.xy, point)"
    else:
        text = f"node_normal_map_{'object' if 'OBJECT' in space else 'world'}({color.text}, {strength.text}, point)"
    return {"Normal": c.variable(VECTOR, text)}


@node("BUMP")
def bump(c: Compiler, n: Node) -> dict[str, Value]:
    """Perturb the normal by the screen-space derivatives of Height."""
    if not c.linked(n, "Height"):
        return {"Normal": Value(VECTOR, _normal(c, n))}
    strength, distance = c.input(n, "Strength", FLOAT, 1.0), c.input(n, "Distance", FLOAT, 1.0)
    height = c.variable(FLOAT, c.input(n, "Height", FLOAT).text)
    sign = "-1.0" if n.params.get("invert") else "1.0"
    return {"Normal": c.variable(
        VECTOR, f"node_bump({height.text}, {strength.text}, {sign} * {distance.text}, {_normal(c, n)}, point)")}  # fmt: skip


@node("NORMAL")
def normal(c: Compiler, n: Node) -> dict[str, Value]:
    direction = c.constant(n.params.get("normal", (0.0, 0.0, 1.0)), VECTOR)
    given = c.input(n, "Normal", VECTOR, (0.0, 0.0, 1.0))
    return {"Normal": direction, "Dot": c.variable(FLOAT, f"dot({direction.text}, normalize({given.text}))")}


# --- colour and math --------------------------------------------------------------------------------------------------

_MATH = {
    "ADD": "{a} + {b}", "SUBTRACT": "{a} - {b}", "MULTIPLY": "{a} * {b}", "DIVIDE": "safe_divide({a}, {b})",
    "MULTIPLY_ADD": "{a} * {b} + {c}", "POWER": "safe_pow({a}, {b})", "LOGARITHM": "safe_log({a}, {b})",
    "SQRT": "sqrt(max({a}, 0.0))", "INVERSE_SQRT": "safe_inversesqrt({a})", "ABSOLUTE": "abs({a})",
    "EXPONENT": "exp({a})", "MINIMUM": "min({a}, {b})", "MAXIMUM": "max({a}, {b})",
    "LESS_THAN": "float({a} < {b})", "GREATER_THAN": "float({a} > {b})", "SIGN": "sign({a})",
    "COMPARE": "float(abs({a} - {b}) <= max({c}, 1e-5))", "SMOOTH_MIN": "smooth_min({a}, {b}, {c})",
    "SMOOTH_MAX": "-smooth_min(-({a}), -({b}), {c})", "ROUND": "floor({a} + 0.5)", "FLOOR": "floor({a})",
    "CEIL": "ceil({a})", "TRUNC": "trunc({a})", "FRACT": "fract({a})", "MODULO": "safe_modulo({a}, {b})",
    "FLOORED_MODULO": "safe_floored_modulo({a}, {b})", "WRAP": "node_wrap({a}, {b}, {c})",
    "SNAP": "floor(safe_divide({a}, {b})) * {b}", "PINGPONG": "node_pingpong({a}, {b})", "SINE": "sin({a})",
    "COSINE": "cos({a})", "TANGENT": "tan({a})", "ARCSINE": "asin(clamp({a}, -1.0, 1.0))",
    "ARCCOSINE": "acos(clamp({a}, -1.0, 1.0))", "ARCTANGENT": "atan({a})", "ARCTAN2": "atan({a}, {b})",
    "SINH": "sinh({a})", "COSH": "cosh({a})", "TANH": "tanh({a})", "RADIANS": "radians({a})",
    "DEGREES": "degrees({a})",
}  # fmt: skip


@node("MATH")
def math(c: Compiler, n: Node) -> dict[str, Value]:
    operation = n.params.get("operation", "ADD")
    a, b, d = (c.input(n, name, FLOAT, 0.5) for name in ("Value", "Value_001", "Value_002"))
    if operation not in _MATH:
        c.approximate(n, f"operation {operation} is not evaluated")
        return {"Value": a}
    if operation in BINARY and a.constant is not None and b.constant is not None:
        # Known now: what it switches (alpha, emission …) can then be left out.
        known = float(BINARY[operation](a.constant[0], b.constant[0]))
        return {"Value": c.constant(min(max(known, 0.0), 1.0) if n.params.get("use_clamp") else known, FLOAT)}
    text = _MATH[operation].format(a=f"({a.text})", b=f"({b.text})", c=f"({d.text})")
    return {"Value": c.variable(FLOAT, f"clamp({text}, 0.0, 1.0)" if n.params.get("use_clamp") else text)}


_VECTOR_MATH = {
    "ADD": "{a} + {b}", "SUBTRACT": "{a} - {b}", "MULTIPLY": "{a} * {b}", "DIVIDE": "safe_divide({a}, {b})",
    "MULTIPLY_ADD": "{a} * {b} + {c}", "CROSS_PRODUCT": "cross({a}, {b})", "PROJECT": "node_project({a}, {b})",
    "REFLECT": "reflect({a}, safe_normalize({b}))", "REFRACT": "refract({a}, safe_normalize({b}), {s})",
    "FACEFORWARD": "faceforward({a}, {b}, {c})", "SCALE": "{a} * {s}", "NORMALIZE": "safe_normalize({a})",
    "ABSOLUTE": "abs({a})", "MINIMUM": "min({a}, {b})", "MAXIMUM": "max({a}, {b})", "FLOOR": "floor({a})",
    "ROUND": "floor({a} + 0.5)", "CEIL": "ceil({a})", "FRACTION": "fract({a})", "MODULO": "safe_modulo({a}, {b})",
    "SNAP": "floor(safe_divide({a}, {b})) * {b}", "WRAP": "node_wrap({a}, {b}, {c})", "SINE": "sin({a})",
    "COSINE": "cos({a})", "TANGENT": "tan({a})", "SIGN": "sign({a})", "POWER": "safe_pow({a}, {b})",
}  # fmt: skip
_VECTOR_MATH_FLOAT = {"DOT_PRODUCT": "dot({a}, {b})", "DISTANCE": "distance({a}, {b})", "LENGTH": "length({a})"}


@node("VECT_MATH")
def vector_math(c: Compiler, n: Node) -> dict[str, Value]:
    operation = n.params.get("operation", "ADD")
    a, b, d = (c.input(n, name, VECTOR, 0.0) for name in ("Vector", "Vector_001", "Vector_002"))
    scale = c.input(n, "Scale", FLOAT, 1.0)
    given = {"a": f"({a.text})", "b": f"({b.text})", "c": f"({d.text})", "s": f"({scale.text})"}
    zero = Value(FLOAT, "0.0")
    if operation in _VECTOR_MATH_FLOAT:
        return {"Value": c.variable(FLOAT, _VECTOR_MATH_FLOAT[operation].format(**given)),
                "Vector": Value(VECTOR, "vec3(0.0)")}  # fmt: skip
    if operation not in _VECTOR_MATH:
        c.approximate(n, f"operation {operation} is not evaluated")
        return {"Vector": a, "Value": zero}
    return {"Vector": c.variable(VECTOR, _VECTOR_MATH[operation].format(**given)), "Value": zero}


_BLEND = {
    "MIX", "DARKEN", "MULTIPLY", "BURN", "LIGHTEN", "SCREEN", "DODGE", "ADD", "OVERLAY", "SOFT_LIGHT", "LINEAR_LIGHT",
    "DIFFERENCE", "EXCLUSION", "SUBTRACT", "DIVIDE", "HUE", "SATURATION", "COLOR", "VALUE",
}  # fmt: skip


def _blend(c: Compiler, mode: str, n: Node, factor: str, a: str, b: str, clamp: bool) -> Value:
    if mode not in _BLEND:
        c.approximate(n, f"blend mode {mode} is not evaluated")
        mode = "MIX"
    text = f"blend_{mode.lower()}({factor}, {a}, {b})"
    return c.variable(COLOR, f"clamp({text}, 0.0, 1.0)" if clamp else text)


@node("MIX_RGB")
def mix_rgb(c: Compiler, n: Node) -> dict[str, Value]:
    """The Mix node of Blender before 3.4."""
    factor = c.input(n, "Fac", FLOAT, 0.5)
    a, b = c.input(n, "Color1", COLOR, (0.5,) * 3), c.input(n, "Color2", COLOR, (0.5,) * 3)
    mode = n.params.get("blend_type", "MIX")
    factor_text = f"clamp({factor.text}, 0.0, 1.0)"
    return {"Color": _blend(c, mode, n, factor_text, a.text, b.text, n.params.get("use_clamp", False))}


@node("MIX")
def mix(c: Compiler, n: Node) -> dict[str, Value]:
    """Mix of floats, vectors or colours. Sockets carry their type in the identifier, e.g. ``A_Color``."""
    kind = n.params.get("data_type", "FLOAT")
    uniform = n.params.get("factor_mode", "UNIFORM") == "UNIFORM"
    factor = c.input(n, "Factor_Float", FLOAT, 0.5) if uniform or kind != "VECTOR" else c.input(
        n, "Factor_Vector", VECTOR, 0.5)  # fmt: skip
    text = f"clamp({factor.text}, 0.0, 1.0)" if n.params.get("clamp_factor", True) else factor.text
    if kind == "RGBA":
        a, b = c.input(n, "A_Color", COLOR, (0.5,) * 3), c.input(n, "B_Color", COLOR, (0.5,) * 3)
        clamp = n.params.get("clamp_result", False)
        return {"Result_Color": _blend(c, n.params.get("blend_type", "MIX"), n, text, a.text, b.text, clamp)}
    if kind == "VECTOR":
        a, b = c.input(n, "A_Vector", VECTOR, 0.0), c.input(n, "B_Vector", VECTOR, 0.0)
        return {"Result_Vector": c.variable(VECTOR, f"mix({a.text}, {b.text}, {text})")}
    if kind == "FLOAT":
        a, b = c.input(n, "A_Float", FLOAT, 0.0), c.input(n, "B_Float", FLOAT, 0.0)
        return {"Result_Float": c.variable(FLOAT, f"mix({a.text}, {b.text}, {text})")}
    c.approximate(n, f"data type {kind} is not evaluated")
    return {"Result_Rotation": Value(VECTOR, "vec3(0.0)")}


@node("SEPRGB", "SEPARATE_COLOR")
def separate_color(c: Compiler, n: Node) -> dict[str, Value]:
    color = c.variable(COLOR, c.input(n, "Color" if n.kind == "SEPARATE_COLOR" else "Image", COLOR, (0.8,) * 3).text)
    mode = n.params.get("mode", "RGB")
    if mode != "RGB":
        color = c.variable(COLOR, f"rgb_to_{mode.lower()}({color.text})")
    out = {name: Value(FLOAT, f"{color.text}.{axis}") for name, axis in zip(("Red", "Green", "Blue"), "xyz", strict=True)}
    return out | {"R": out["Red"], "G": out["Green"], "B": out["Blue"]}


@node("COMBRGB", "COMBINE_COLOR")
def combine_color(c: Compiler, n: Node) -> dict[str, Value]:
    names = ("Red", "Green", "Blue") if n.kind == "COMBINE_COLOR" else ("R", "G", "B")
    text = f"vec3({', '.join(c.input(n, name, FLOAT, 0.0).text for name in names)})"
    mode = n.params.get("mode", "RGB")
    v = c.variable(COLOR, text if mode == "RGB" else f"{mode.lower()}_to_rgb({text})")
    return {"Color": v, "Image": v}


@node("SEPXYZ", "SEPARATE_XYZ")
def separate_xyz(c: Compiler, n: Node) -> dict[str, Value]:
    v = c.variable(VECTOR, c.input(n, "Vector", VECTOR, 0.0).text)
    return {axis.upper(): Value(FLOAT, f"{v.text}.{axis}") for axis in "xyz"}


@node("COMBXYZ", "COMBINE_XYZ")
def combine_xyz(c: Compiler, n: Node) -> dict[str, Value]:
    return {"Vector": c.variable(
        VECTOR, f"vec3({', '.join(c.input(n, name, FLOAT, 0.0).text for name in 'XYZ')})")}  # fmt: skip


@node("MAPPING")
def mapping(c: Compiler, n: Node) -> dict[str, Value]:
    """Point, texture, vector or normal mapping by location, rotation (XYZ Euler) and scale."""
    v = c.input(n, "Vector", VECTOR, 0.0)
    location, rotation = c.input(n, "Location", VECTOR, 0.0), c.input(n, "Rotation", VECTOR, 0.0)
    scale = c.input(n, "Scale", VECTOR, 1.0)
    kind = n.params.get("vector_type", "POINT").lower()
    return {"Vector": c.variable(
        VECTOR, f"node_mapping_{kind}({v.text}, {location.text}, {rotation.text}, {scale.text})")}  # fmt: skip


@node("GAMMA")
def gamma(c: Compiler, n: Node) -> dict[str, Value]:
    color, g = c.input(n, "Color", COLOR, (1.0,) * 3), c.input(n, "Gamma", FLOAT, 1.0)
    return {"Color": c.variable(COLOR, f"node_gamma({color.text}, {g.text})")}


@node("BRIGHTCONTRAST")
def bright_contrast(c: Compiler, n: Node) -> dict[str, Value]:
    color, b, k = (c.input(n, "Color", COLOR, (1.0,) * 3), c.input(n, "Bright", FLOAT, 0.0),
                   c.input(n, "Contrast", FLOAT, 0.0))  # fmt: skip
    return {"Color": c.variable(
        COLOR, f"max(({color.text}) * (1.0 + {k.text}) + ({b.text} - 0.5 * {k.text}), vec3(0.0))")}  # fmt: skip


@node("INVERT")
def invert(c: Compiler, n: Node) -> dict[str, Value]:
    factor, color = c.input(n, "Fac", FLOAT, 1.0), c.input(n, "Color", COLOR, (0.0,) * 3)
    return {"Color": c.variable(COLOR, f"mix({color.text}, vec3(1.0) - {color.text}, {factor.text})")}


@node("HUE_SAT")
def hue_saturation(c: Compiler, n: Node) -> dict[str, Value]:
    text = ", ".join(
        c.input(n, name, type, default).text
        for name, type, default in (
            ("Hue", FLOAT, 0.5), ("Saturation", FLOAT, 1.0), ("Value", FLOAT, 1.0), ("Fac", FLOAT, 1.0),
            ("Color", COLOR, (0.8,) * 3),
        )
    )  # fmt: skip
    return {"Color": c.variable(COLOR, f"node_hue_saturation({text})")}


@node("RGBTOBW")
def rgb_to_bw(c: Compiler, n: Node) -> dict[str, Value]:
    return {"Val": c.variable(FLOAT, f"luminance({c.input(n, 'Color', COLOR, (0.5,) * 3).text})")}


@node("CLAMP")
def clamp(c: Compiler, n: Node) -> dict[str, Value]:
    v, low, high = c.input(n, "Value", FLOAT, 1.0), c.input(n, "Min", FLOAT, 0.0), c.input(n, "Max", FLOAT, 1.0)
    if n.params.get("clamp_type") == "RANGE":
        return {"Result": c.variable(FLOAT, f"node_clamp_range({v.text}, {low.text}, {high.text})")}
    return {"Result": c.variable(FLOAT, f"min(max({v.text}, {low.text}), {high.text})")}


@node("MAP_RANGE")
def map_range(c: Compiler, n: Node) -> dict[str, Value]:
    vector = n.params.get("data_type") == "FLOAT_VECTOR"
    type, _suffix = (VECTOR, "_FLOAT3") if vector else (FLOAT, "")
    names = (("Vector", "From_Min_FLOAT3", "From_Max_FLOAT3", "To_Min_FLOAT3", "To_Max_FLOAT3", "Steps_FLOAT3") if vector
             else ("Value", "From Min", "From Max", "To Min", "To Max", "Steps"))  # fmt: skip
    defaults = (1.0, 0.0, 1.0, 0.0, 1.0, 4.0)
    v = [c.input(n, name, type, d).text for name, d in zip(names, defaults, strict=True)]
    kind = n.params.get("interpolation_type", "LINEAR").lower()
    text = f"node_map_range_{kind}({', '.join(v)})"
    if n.params.get("clamp", True) and kind in ("linear", "stepped"):
        text = f"node_clamp_range({text}, {v[3]}, {v[4]})"
    return {"Vector" if vector else "Result": c.variable(type, text)}


@node("VALTORGB")
def color_ramp(c: Compiler, n: Node) -> dict[str, Value]:
    """A colour ramp by its stops; ``stops`` is rows (position, r, g, b, a), evaluated by the host's table."""
    factor = c.input(n, "Fac", FLOAT, 0.5)
    first, count = c.table(n.params.get("table", [(0.0,) * 4, (1.0,) * 4]))
    out = c.name()
    mode = "TABLE_CONSTANT" if n.params.get("constant", False) else "TABLE_LINEAR"
    c.statement(f"vec4 {out} = node_table({first}, {count}, {factor.text}, {mode});")
    return {"Color": Value(COLOR, f"{out}.xyz"), "Alpha": Value(FLOAT, f"{out}.w")}


@node("CURVE_RGB", "CURVE_VEC", "CURVE_FLOAT")
def curves(c: Compiler, n: Node) -> dict[str, Value]:
    """Curves by the host's table per channel, over ``range``; beyond it they go on straight where ``extend`` says so."""
    mode = "TABLE_EXTEND" if n.params.get("extend") else "TABLE_LINEAR"
    low, high = n.params.get("range", (0.0, 1.0))
    factor = c.input(n, "Factor" if n.kind == "CURVE_FLOAT" else "Fac", FLOAT, 1.0)
    span = c.constant(1.0 / (high - low) if high > low else 1.0, FLOAT)
    start = c.constant(low, FLOAT)
    first, count = c.table(n.params["table"])

    def look_up(v: str, axis: str) -> str:
        return f"node_table({first}, {count}, ({v} - {start.text}) * {span.text}, {mode}).{axis}"

    if n.kind == "CURVE_FLOAT":
        v = c.input(n, "Value", FLOAT, 1.0)
        return {"Value": c.variable(FLOAT, f"mix({v.text}, {look_up(v.text, 'x')}, {factor.text})")}
    name, type = ("Color", COLOR) if n.kind == "CURVE_RGB" else ("Vector", VECTOR)
    v = c.variable(type, c.input(n, name, type, 0.0).text)
    parts = ", ".join(look_up(f"{v.text}.{axis}", axis) for axis in "xyz")
    return {name: c.variable(type, f"mix({v.text}, vec3({parts}), {factor.text})")}
