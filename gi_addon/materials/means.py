# SPDX-License-Identifier: GPL-3.0-or-later
"""What a material emits on average: a walk over the graph with numbers instead of GLSL.

Emissive surfaces are drawn as light sources before any of their points is shaded, so their power must be known without
the GPU. Textures count by their mean; what can't be evaluated counts as its best constant.
"""

from __future__ import annotations

import colorsys
import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..scene import Image, Link, Node, ShaderGraph
from .spectrum import blackbody

_GRAY = np.array([0.2126, 0.7152, 0.0722])
# Operations of the Math node on two numbers that are known before rendering.
BINARY: dict[str, Callable] = {
    "ADD": operator.add, "SUBTRACT": operator.sub, "MULTIPLY": operator.mul, "MINIMUM": np.minimum,
    "MAXIMUM": np.maximum, "LESS_THAN": lambda a, b: float(a < b), "GREATER_THAN": lambda a, b: float(a > b),
    "DIVIDE": lambda a, b: a / b if b else 0.0, "POWER": lambda a, b: abs(a) ** b if a else 0.0,
}  # fmt: skip
# Operations of the Vector Math node, componentwise.
_VECTOR: dict[str, Callable] = {
    "ADD": operator.add, "SUBTRACT": operator.sub, "MULTIPLY": operator.mul, "MINIMUM": np.minimum, "MAXIMUM": np.maximum,
}  # fmt: skip


def mean_emission(graph: ShaderGraph, images: Sequence[Image]) -> np.ndarray:
    """Mean emitted radiance (3,), W/(m²·sr), of a surface graph."""
    if graph.surface is None:
        return np.zeros(3)
    return _Walk(graph, images).closure(graph.surface, 0)


def mean_albedo(graph: ShaderGraph, images: Sequence[Image], *, back: bool = False) -> np.ndarray:
    """Mean share (3,) of light that a surface graph reflects on its front, or its ``back``, diffusely or not: a surface's
    light after its first bounce."""
    if graph.surface is None:
        return np.zeros(3)
    return np.clip(_Walk(graph, images, float(back)).albedo(graph.surface, 0), 0.0, 1.0)


@dataclass(frozen=True)
class Medium:
    """A homogeneous participating medium: scattering and absorption (3,) per metre, emission (3,) W/(m³·sr), and the
    Henyey-Greenstein ``anisotropy`` of its phase function."""

    scattering: tuple[float, float, float]
    absorption: tuple[float, float, float]
    emission: tuple[float, float, float] = (0.0, 0.0, 0.0)
    anisotropy: float = 0.0

    @property
    def extinction(self) -> np.ndarray:
        return np.array(self.scattering) + np.array(self.absorption)


def mean_medium(graph: ShaderGraph, images: Sequence[Image]) -> Medium | None:
    """The mean medium of a volume graph; None where there is none."""
    if graph.volume is None:
        return None
    found = _Walk(graph, images).medium(graph.volume, 0)
    return found if (found.extinction > 0.0).any() or any(found.emission) else None


def _sum(parts: Sequence[Medium]) -> Medium:
    weights = [float(np.sum(p.scattering)) for p in parts]
    total = sum(weights)
    return Medium(
        *(tuple(np.sum([getattr(p, name) for p in parts], axis=0)) for name in ("scattering", "absorption", "emission")),
        sum(w * p.anisotropy for w, p in zip(weights, parts, strict=True)) / total if total > 0.0 else 0.0,
    )


def _scaled(m: Medium, k: float) -> Medium:
    return Medium(*(tuple(k * np.array(getattr(m, n))) for n in ("scattering", "absorption", "emission")), m.anisotropy)


class _Walk:
    """``back``: which side is seen, 0 the front, 1 the back, a half where both count."""

    def __init__(self, graph: ShaderGraph, images: Sequence[Image], back: float = 0.5) -> None:
        self.graph, self.images, self.back = graph, images, back

    def closure(self, link: Link | None, depth: int) -> np.ndarray:
        if not isinstance(link, Link) or depth > 64:
            return np.zeros(3)
        node = self.graph.nodes[link.node]
        get = node.inputs.get
        if node.kind == "EMISSION":
            return self.color(get("Color", 1.0), depth) * self.number(get("Strength", 1.0), depth)
        if node.kind == "BSDF_PRINCIPLED":
            strength = self.number(get("Emission Strength", 0.0), depth) * self.number(get("Alpha", 1.0), depth)
            return self.color(get("Emission Color", 1.0), depth) * strength
        if node.kind == "ADD_SHADER":
            return self.closure(get("Shader"), depth + 1) + self.closure(get("Shader_001"), depth + 1)
        if node.kind == "MIX_SHADER":
            t = float(np.clip(self.number(get("Fac", 0.5), depth), 0.0, 1.0))
            a, b = self.closure(get("Shader"), depth + 1), self.closure(get("Shader_001"), depth + 1)
            return a * (1.0 - t) + b * t
        return np.zeros(3)

    def albedo(self, link: Link | None, depth: int) -> np.ndarray:
        """Mean reflectance (3,) of a closure: its colour, of which refraction and transparency take their share."""
        if not isinstance(link, Link) or depth > 64:
            return np.zeros(3)
        node = self.graph.nodes[link.node]
        get = node.inputs.get
        if node.kind == "BSDF_PRINCIPLED":
            kept = self.number(get("Alpha", 1.0), depth) * (1.0 - self.number(get("Transmission Weight", 0.0), depth))
            return self.color(get("Base Color", 0.8), depth) * kept
        if node.kind in ("BSDF_DIFFUSE", "BSDF_GLOSSY", "SUBSURFACE_SCATTERING", "BSDF_SHEEN", "BSDF_TOON", "BSDF_HAIR"):
            return self.color(get("Color", 0.8), depth)
        if node.kind == "BSDF_METALLIC":
            return self.color(get("Base Color", 0.6), depth)
        if node.kind == "ADD_SHADER":
            return self.albedo(get("Shader"), depth + 1) + self.albedo(get("Shader_001"), depth + 1)
        if node.kind == "MIX_SHADER":
            t = float(np.clip(self.number(get("Fac", 0.5), depth), 0.0, 1.0))
            return self.albedo(get("Shader"), depth + 1) * (1.0 - t) + self.albedo(get("Shader_001"), depth + 1) * t
        return np.zeros(3)

    def medium(self, link: Link | None, depth: int) -> Medium:
        """Blender's volume nodes: Scatter and Absorption are colour × density (absorption 1 − colour), Principled both."""
        nothing = Medium((0.0,) * 3, (0.0,) * 3)
        if not isinstance(link, Link) or depth > 64:
            return nothing
        node = self.graph.nodes[link.node]
        get = node.inputs.get
        if node.kind == "ADD_SHADER":
            return _sum([self.medium(get("Shader"), depth + 1), self.medium(get("Shader_001"), depth + 1)])
        if node.kind == "MIX_SHADER":
            t = float(np.clip(self.number(get("Fac", 0.5), depth), 0.0, 1.0))
            a, b = self.medium(get("Shader"), depth + 1), self.medium(get("Shader_001"), depth + 1)
            return _sum([_scaled(a, 1.0 - t), _scaled(b, t)])
        if node.kind == "EMISSION":
            radiance = self.color(get("Color", 1.0), depth) * self.number(get("Strength", 1.0), depth)
            return Medium((0.0,) * 3, (0.0,) * 3, tuple(radiance))
        density = max(self.number(get("Density", 1.0), depth), 0.0)
        color = np.clip(self.color(get("Color", 0.5 if node.kind == "PRINCIPLED_VOLUME" else 0.8), depth), 0.0, 1.0)
        anisotropy = float(np.clip(self.number(get("Anisotropy", 0.0), depth), -0.99, 0.99))
        if node.kind == "VOLUME_SCATTER":
            return Medium(tuple(color * density), (0.0,) * 3, anisotropy=anisotropy)
        if node.kind == "VOLUME_ABSORPTION":
            return Medium((0.0,) * 3, tuple((1.0 - color) * density))
        if node.kind == "PRINCIPLED_VOLUME":
            # What is not scattered is absorbed, tinted by the square root of the absorption colour.
            tint = np.sqrt(np.clip(self.color(get("Absorption Color", 0.0), depth), 0.0, 1.0))
            emission = self.color(get("Emission Color", 1.0), depth) * self.number(get("Emission Strength", 0.0), depth)
            return Medium(tuple(color * density), tuple(np.maximum((1.0 - color) * (1.0 - tint), 0.0) * density),
                          tuple(emission), anisotropy)  # fmt: skip
        return nothing

    def number(self, value, depth: int) -> float:
        v = self.value(value, depth + 1)
        return float(v @ _GRAY) if np.ndim(v) else float(v)

    def color(self, value, depth: int) -> np.ndarray:
        return np.broadcast_to(np.asarray(self.value(value, depth + 1), "f8"), (3,)).astype("f8")

    def value(self, value, depth: int):
        """A float or (3,) array."""
        if not isinstance(value, Link):
            return np.array(value[:3], "f8") if isinstance(value, tuple) else float(value)
        if depth > 64:
            return 1.0
        node = self.graph.nodes[value.node]
        get = node.inputs.get
        if node.kind in ("TEX_IMAGE", "TEX_ENVIRONMENT"):
            return self._image(node, value.output)
        if node.kind in ("RGB", "VALUE"):
            v = node.params.get("value", 0.5)
            return np.array(v[:3], "f8") if isinstance(v, tuple) else float(v)
        if node.kind == "MATH" and node.params.get("operation") in (*BINARY, "MULTIPLY_ADD"):
            return self._math(node, depth)
        if node.kind == "TEX_CHECKER":
            pair = [self.color(get(name, 0.8), depth) for name in ("Color1", "Color2")]
            return np.mean(pair, axis=0) if value.output == "Color" else 0.5
        if node.kind == "MIX":
            suffix = {"RGBA": "Color", "VECTOR": "Vector"}.get(node.params.get("data_type"), "Float")
            return self._blend(node.params.get("blend_type", "MIX") if suffix == "Color" else "MIX",
                               get("Factor_Float", 0.5), get(f"A_{suffix}", 0.5), get(f"B_{suffix}", 0.5), depth)  # fmt: skip
        if node.kind == "MIX_RGB":
            return self._blend(node.params.get("blend_type", "MIX"), get("Fac", 0.5), get("Color1", 0.5),
                               get("Color2", 0.5), depth)  # fmt: skip
        if node.kind == "VALTORGB" and node.params.get("table"):
            return np.mean([row[:3] for row in node.params["table"]], axis=0)
        if node.kind == "BLACKBODY":
            return blackbody(self.number(get("Temperature", 1500.0), depth))
        if node.kind == "LIGHT_FALLOFF":
            # How it falls off is the light's own (Light.falloff).
            return self.number(get("Strength", 100.0), depth)
        if node.kind == "TEX_IES":
            return float(node.params.get("mean", 0.0)) * self.number(get("Strength", 1.0), depth)
        if node.kind == "LIGHT_PATH":
            return 0.0 if value.output == "Is Camera Ray" else 1.0
        if node.kind == "NEW_GEOMETRY" and value.output == "Backfacing":
            return self.back
        if node.kind in _COLORS:
            return _COLORS[node.kind](self, node, value.output, depth)
        for name in ("Color", "Color1", "Value", "Fac", "Vector"):
            if isinstance(get(name), Link):
                return self.value(get(name), depth + 1)
        return 0.5

    def _math(self, node: Node, depth: int) -> float:
        numbers = [self.number(node.inputs.get(name, 0.5), depth) for name in ("Value", "Value_001", "Value_002")]
        operation = node.params["operation"]
        result = numbers[0] * numbers[1] + numbers[2] if operation == "MULTIPLY_ADD" else BINARY[operation](*numbers[:2])
        return float(np.clip(result, 0.0, 1.0) if node.params.get("use_clamp") else result)

    def _separated(self, node: Node, output: str, depth: int) -> float:
        source = next((node.inputs[name] for name in ("Color", "Image", "Vector") if name in node.inputs), 0.8)
        color = self.color(source, depth)
        mode = node.params.get("mode", "RGB")
        if mode != "RGB":
            color = np.array((colorsys.rgb_to_hsv if mode == "HSV" else _rgb_to_hsl)(*color))
        return float(color["RGBXYZ".index(output[:1]) % 3])

    def _combined(self, node: Node, output: str, depth: int) -> np.ndarray:
        names = {"COMBINE_COLOR": ("Red", "Green", "Blue"), "COMBRGB": "RGB"}.get(node.kind, "XYZ")
        color = np.array([self.number(node.inputs.get(name, 0.0), depth) for name in names])
        mode = node.params.get("mode", "RGB")
        if mode == "RGB":
            return color
        return np.array(colorsys.hsv_to_rgb(*color) if mode == "HSV" else colorsys.hls_to_rgb(color[0], color[2], color[1]))

    def _vector_math(self, node: Node, output: str, depth: int):
        get, operation = node.inputs.get, node.params.get("operation")
        a = self.color(get("Vector", 0.0), depth)
        if operation == "SCALE":
            return a * self.number(get("Scale", 1.0), depth)
        return _VECTOR[operation](a, self.color(get("Vector_001", 0.0), depth)) if operation in _VECTOR else a

    def _gamma(self, node: Node, output: str, depth: int) -> np.ndarray:
        color = np.maximum(self.color(node.inputs.get("Color", 1.0), depth), 0.0)
        return color ** self.number(node.inputs.get("Gamma", 1.0), depth)

    def _bright_contrast(self, node: Node, output: str, depth: int) -> np.ndarray:
        get = node.inputs.get
        bright, contrast = self.number(get("Bright", 0.0), depth), self.number(get("Contrast", 0.0), depth)
        return np.maximum(self.color(get("Color", 1.0), depth) * (1.0 + contrast) + bright - 0.5 * contrast, 0.0)

    def _invert(self, node: Node, output: str, depth: int) -> np.ndarray:
        color, t = self.color(node.inputs.get("Color", 0.0), depth), self.number(node.inputs.get("Fac", 1.0), depth)
        return color * (1.0 - t) + (1.0 - color) * t

    def _hue_saturation(self, node: Node, output: str, depth: int) -> np.ndarray:
        get, color = node.inputs.get, self.color(node.inputs.get("Color", 0.8), depth)
        h, s, v = colorsys.rgb_to_hsv(*np.maximum(color, 0.0))
        h = (h + self.number(get("Hue", 0.5), depth) + 0.5) % 1.0
        s = min(max(s * self.number(get("Saturation", 1.0), depth), 0.0), 1.0)
        changed = np.array(colorsys.hsv_to_rgb(h, s, v * self.number(get("Value", 1.0), depth)))
        t = self.number(get("Fac", 1.0), depth)
        return np.maximum(color * (1.0 - t) + changed * t, 0.0)

    def _clamp(self, node: Node, output: str, depth: int) -> float:
        low, high = self.number(node.inputs.get("Min", 0.0), depth), self.number(node.inputs.get("Max", 1.0), depth)
        return float(np.clip(self.number(node.inputs.get("Value", 1.0), depth), min(low, high), max(low, high)))

    def _map_range(self, node: Node, output: str, depth: int):
        suffix = "_FLOAT3" if node.params.get("data_type") == "FLOAT_VECTOR" else ""
        names = [f"{name.replace(' ', '_')}{suffix}" if suffix else name for name in ("From Min", "From Max", "To Min", "To Max")]
        defaults = (0.0, 1.0, 0.0, 1.0)
        low, high, start, end = (self.color(node.inputs.get(n, d), depth) for n, d in zip(names, defaults, strict=True))
        value = self.color(node.inputs.get("Vector" if suffix else "Value", 1.0), depth)
        t = np.divide(value - low, high - low, out=np.zeros(3), where=high != low)
        t = np.clip(t, 0.0, 1.0) if node.params.get("clamp", True) else t
        result = start + t * (end - start)
        return result if suffix else float(result[0])

    def _fresnel(self, node: Node, output: str, depth: int) -> float:
        if output == "Facing":
            return 1.0 / 3.0  # the mean of 1 − cosθ, by cosθ; bent by Blend it is another, near enough
        blend = node.kind == "LAYER_WEIGHT"
        number = self.number(node.inputs.get("Blend" if blend else "IOR", 0.5 if blend else 1.5), depth)
        return _mean_fresnel(1.0 / max(1.0 - number, 1e-5) if blend else number)

    def _blend(self, mode: str, factor, a, b, depth: int):
        t = float(np.clip(self.number(factor, depth), 0.0, 1.0))
        x, y = self.color(a, depth), self.color(b, depth)
        mixed = {"MULTIPLY": x * y, "ADD": x + y, "SUBTRACT": x - y}.get(mode, y)
        return x * (1.0 - t) + mixed * t

    def _image(self, node: Node, output: str):
        index = node.params.get("image")
        if index is None or index >= len(self.images):
            return 1.0 if output == "Alpha" else np.array([1.0, 0.0, 1.0])
        mean = image_mean(self.images[index])
        return float(mean[3]) if output == "Alpha" else mean[:3]


# Nodes that change colours and numbers: (walk, node, output, depth) to a float or (3,).
_COLORS: dict[str, Callable] = {
    **dict.fromkeys(("SEPARATE_COLOR", "SEPRGB", "SEPXYZ", "SEPARATE_XYZ"), _Walk._separated),
    **dict.fromkeys(("COMBINE_COLOR", "COMBRGB", "COMBXYZ", "COMBINE_XYZ"), _Walk._combined),
    "VECT_MATH": _Walk._vector_math, "GAMMA": _Walk._gamma, "BRIGHTCONTRAST": _Walk._bright_contrast,
    "INVERT": _Walk._invert, "HUE_SAT": _Walk._hue_saturation, "CLAMP": _Walk._clamp, "MAP_RANGE": _Walk._map_range,
    "FRESNEL": _Walk._fresnel, "LAYER_WEIGHT": _Walk._fresnel,
}  # fmt: skip


def _rgb_to_hsl(r: float, g: float, b: float) -> tuple[float, float, float]:
    h, light, s = colorsys.rgb_to_hls(r, g, b)
    return h, s, light


def _mean_fresnel(ior: float) -> float:
    """A dielectric's reflectance, averaged over the hemisphere by the cosine: 2 ∫ F(c) c dc."""
    c = (np.arange(64) + 0.5) / 64.0
    eta = max(ior, 1e-5)
    g2 = eta * eta - 1.0 + c * c
    g = np.sqrt(np.maximum(g2, 0.0))
    a = (g - c) / (g + c)
    b = ((g + c) * c - 1.0) / np.where((g - c) * c + 1.0 == 0.0, 1.0, (g - c) * c + 1.0)
    return float(np.mean(2.0 * c * np.where(g2 > 0.0, 0.5 * a * a * (1.0 + b * b), 1.0)))


_means: dict[int, np.ndarray] = {}


def image_mean(image: Image) -> np.ndarray:
    """Mean of an image's linear pixels (4,)."""
    if image.uid not in _means:
        # A few thousand texels are enough for a mean.
        step = max(1, int(np.sqrt(image.pixels.shape[0] * image.pixels.shape[1] / 65536.0)))
        pixels = image.pixels[::step, ::step].reshape(-1, 4).astype("f8")
        if image.pixels.dtype == np.uint8:
            pixels = pixels / 255.0
        if image.colorspace == "srgb":
            rgb = pixels[:, :3]
            pixels[:, :3] = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
        if len(_means) > 4096:
            _means.clear()
        _means[image.uid] = np.nan_to_num(pixels).mean(axis=0)
    return _means[image.uid]
