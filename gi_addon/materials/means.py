# SPDX-License-Identifier: GPL-3.0-or-later
"""What a material emits on average: a walk over the graph with numbers instead of GLSL.

Emissive surfaces are drawn as light sources before any of their points is shaded, so their power must be known without
the GPU. Textures count by their mean; what can't be evaluated counts as its best constant.
"""

from __future__ import annotations

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


def mean_emission(graph: ShaderGraph, images: Sequence[Image]) -> np.ndarray:
    """Mean emitted radiance (3,), W/(m²·sr), of a surface graph."""
    if graph.surface is None:
        return np.zeros(3)
    return _Walk(graph, images).closure(graph.surface, 0)


def mean_albedo(graph: ShaderGraph, images: Sequence[Image]) -> np.ndarray:
    """Mean share (3,) of light that a surface graph reflects, diffusely or not: a surface's light after its first bounce."""
    if graph.surface is None:
        return np.zeros(3)
    return np.clip(_Walk(graph, images).albedo(graph.surface, 0), 0.0, 1.0)


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
    def __init__(self, graph: ShaderGraph, images: Sequence[Image]) -> None:
        self.graph, self.images = graph, images

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
        if node.kind in ("BSDF_DIFFUSE", "BSDF_GLOSSY", "SUBSURFACE_SCATTERING"):
            return self.color(get("Color", 0.8), depth)
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
        if node.kind == "MATH" and node.params.get("operation") in BINARY:
            a, b = self.number(get("Value", 0.5), depth), self.number(get("Value_001", 0.5), depth)
            return float(BINARY[node.params["operation"]](a, b))
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
            # With the distance squared as lights have it anyway; other falloffs count as that.
            return self.number(get("Strength", 100.0), depth)
        if node.kind == "TEX_IES":
            return float(node.params.get("mean", 0.0)) * self.number(get("Strength", 1.0), depth)
        if node.kind == "LIGHT_PATH":
            return 0.0 if value.output == "Is Camera Ray" else 1.0
        for name in ("Color", "Color1", "Value", "Fac", "Vector"):
            if isinstance(get(name), Link):
                return self.value(get(name), depth + 1)
        return 0.5

    def _blend(self, mode: str, factor, a, b, depth: int):
        t = float(np.clip(self.number(factor, depth), 0.0, 1.0))
        x, y = self.color(a, depth), self.color(b, depth)
        mixed = {"MULTIPLY": x * y, "ADD": x + y, "SUBTRACT": x - y}.get(mode, y)
        return x * (1.0 - t) + mixed * t

    def _image(self, node: Node, output: str):
        index = node.params.get("image")
        if index is None or index >= len(self.images):
            return 0.0 if output == "Alpha" else np.zeros(3)
        mean = image_mean(self.images[index])
        return float(mean[3]) if output == "Alpha" else mean[:3]


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
