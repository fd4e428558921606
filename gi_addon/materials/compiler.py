# SPDX-License-Identifier: GPL-3.0-or-later
"""Compile a ShaderGraph to a GLSL function.

Numbers go to a parameter array, not into the text, so that graphs of the same shape share one program. What a constant
switches off altogether (no emission, no alpha …) does change the text: then nothing of it is run.

An unknown node never breaks a material: it becomes the best constant, and ``approximated`` names it for the user.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from ..scene import Image, Link, Node, ShaderGraph

FLOAT, VECTOR, COLOR, CLOSURE = "float", "vector", "color", "closure"
# Parameters are a uniform block, of which drivers give 64 KiB: beyond half of that tables get coarse.
_TABLE_LIMIT = 8192
_GLSL_TYPE = {FLOAT: "float", VECTOR: "vec3", COLOR: "vec3", CLOSURE: "Closure"}


@dataclass(frozen=True)
class Value:
    """A GLSL expression with its type; ``constant`` holds the number(s) where they are known."""

    type: str
    text: str
    constant: tuple[float, ...] | None = None

    @property
    def is_zero(self) -> bool:
        return self.constant is not None and all(c == 0.0 for c in self.constant)

    def equals(self, number: float) -> bool:
        """Known to be ``number`` in every component."""
        return self.constant is not None and all(c == number for c in self.constant)


@dataclass
class CompiledGraph:
    """GLSL and what it needs.

    ``glsl`` defines ``surface_closure(SurfacePoint)`` or ``world_radiance(vec3)``; ``params`` are the floats it reads;
    ``images`` the scene's image indices it samples, as ``material_image_0`` …, with ``samplers`` (interpolation,
    extension) each; ``attributes`` the mesh attributes, as ``attribute_value_0`` …; ``includes`` the shader files that few
    graphs need, with the ``macros`` they are written in. The flags say what a surface can do.
    """

    glsl: str
    params: list[float] = field(default_factory=list)
    images: list[int] = field(default_factory=list)
    samplers: list[tuple[str, str]] = field(default_factory=list)
    attributes: list[str] = field(default_factory=list)
    approximated: list[str] = field(default_factory=list)
    includes: list[str] = field(default_factory=list)
    macros: dict[str, str] = field(default_factory=dict)
    emissive: bool = False
    transparent: bool = False
    transmissive: bool = False
    tinted: bool = False  # what goes straight through, or is refracted, may be coloured
    subsurface: bool = False
    diffuse: bool = False
    glossy: bool = False
    constant: tuple[float, float, float] | None = None


class Compiler:
    """State of one compilation. Node functions in ``nodes.py`` call it."""

    def __init__(self, graph: ShaderGraph, images: Sequence[Image] = (), *, world: bool = False) -> None:
        self.graph = graph
        self.images = images
        self.world = world
        self.lines: list[str] = []
        self.result = CompiledGraph("")
        self._outputs: dict[int, dict[str, Value]] = {}
        self._active: set[int] = set()
        self._count = 0
        links = [v for n in graph.nodes for v in n.inputs.values() if isinstance(v, Link)]
        links += [v for v in (graph.surface, graph.volume) if v is not None]
        self._used = {(id(graph.nodes[link.node]), link.output) for link in links}
        self._tables: dict[tuple, tuple[int, int]] = {}

    # -- for node functions --------------------------------------------------------------------------------------

    def input(self, node: Node, name: str, type: str, default: float | tuple[float, ...] | None = None) -> Value:
        """Input socket ``name`` as ``type``. An unlinked one is a parameter."""
        value = node.inputs.get(name, default)
        if isinstance(value, Link):
            return self.convert(self.output(value), type)
        if type == CLOSURE:
            return Value(CLOSURE, "closure_none()")
        if value is None:
            value = 0.0
        return self.constant(value, type)

    def linked(self, node: Node, name: str) -> bool:
        """Whether input ``name`` is fed by another node."""
        return isinstance(node.inputs.get(name), Link)

    def used(self, node: Node, *outputs: str) -> bool:
        """Whether anything reads one of ``outputs`` of ``node``."""
        return any((id(node), name) in self._used for name in outputs)

    def include(self, path: str) -> None:
        """Have shader file ``path`` in front of the material."""
        if path not in self.result.includes:
            self.result.includes.append(path)

    def macro(self, name: str, value: int, otherwise: str) -> None:
        """Define ``name`` as ``value``, or as ``otherwise`` once two nodes differ in it."""
        old = self.result.macros.get(name, str(value))
        self.result.macros[name] = str(value) if old == str(value) else otherwise

    def table(self, rows: Sequence[Sequence[float]]) -> tuple[int, int]:
        """Put rows of four floats among the parameters, the same rows once; returns (first parameter, rows)."""
        if len(self.result.params) + 4 * len(rows) > _TABLE_LIMIT:
            rows = [rows[i] for i in _spread(len(rows), min(len(rows), 33))]
        key = tuple(tuple(float(v) for v in row) for row in rows)
        if key not in self._tables:
            self._tables[key] = (len(self.result.params), len(key))
            for row in key:
                self.result.params.extend((row + (0.0,) * 4)[:4])
        return self._tables[key]

    def constant(self, value: float | tuple[float, ...], type: str) -> Value:
        """A parameter of ``type`` holding ``value``."""
        numbers = tuple(float(v) for v in value) if isinstance(value, (tuple, list)) else (float(value),)
        if type == FLOAT:
            number = numbers[0] if len(numbers) == 1 else _gray(numbers)
            return Value(FLOAT, self._param(number), (number,))
        numbers = (numbers * 3)[:3] if len(numbers) == 1 else (numbers + (0.0, 0.0))[:3]
        return Value(type, f"vec3({', '.join(self._param(n) for n in numbers)})", numbers)

    def variable(self, type: str, text: str, constant: tuple[float, ...] | None = None) -> Value:
        """Name an expression, so that it is evaluated once."""
        name = f"v{self._count}"
        self._count += 1
        self.lines.append(f"{_GLSL_TYPE[type]} {name} = {text};")
        return Value(type, name, constant)

    def statement(self, text: str) -> None:
        """Append a GLSL statement."""
        self.lines.append(text)

    def name(self) -> str:
        """A fresh identifier."""
        self._count += 1
        return f"v{self._count - 1}"

    def convert(self, value: Value, type: str) -> Value:
        """Blender's implicit socket conversions: colour to float by luminance, vector to float by its mean."""
        if value.type == type or {value.type, type} == {VECTOR, COLOR}:
            return Value(type, value.text, value.constant)
        if CLOSURE in (value.type, type):
            return Value(type, {CLOSURE: "closure_none()", FLOAT: "0.0"}.get(type, "vec3(0.0)"))
        if type == FLOAT:
            if value.type == COLOR:
                return Value(FLOAT, f"luminance({value.text})")
            return Value(FLOAT, f"vector_mean({value.text})")
        return Value(type, f"vec3({value.text})", value.constant * 3 if value.constant else None)

    def image(self, index: int, interpolation: str, extension: str) -> str:
        """The GLSL name of a sampler for the scene's image ``index``."""
        key = (index, interpolation, extension)
        used = list(zip(self.result.images, self.result.samplers, strict=True))
        for slot, (other, sampler) in enumerate(used):
            if (other, *sampler) == key:
                return f"material_image_{slot}"
        self.result.images.append(index)
        self.result.samplers.append((interpolation, extension))
        return f"material_image_{len(used)}"

    def image_flags(self, index: int) -> tuple[bool, bool]:
        """Whether image ``index`` holds encoded sRGB bytes, and whether its alpha is 1 everywhere."""
        if index >= len(self.images):
            return False, False
        image = self.images[index]
        return image.encoded, image.opaque

    def attribute(self, name: str) -> str:
        """The GLSL name (vec4) of mesh attribute ``name``: ``uv:LAYER``, ``color:LAYER`` (no layer: the active one) or
        ``attr:NAME``."""
        if name not in self.result.attributes:
            self.result.attributes.append(name)
        return f"attribute_value_{self.result.attributes.index(name)}"

    def approximate(self, node: Node, why: str) -> None:
        """Tell the user that ``node`` is not rendered as Cycles would."""
        text = f"{node.name or node.kind}: {why}"
        if text not in self.result.approximated:
            self.result.approximated.append(text)

    def output(self, link: Link) -> Value:
        """The value at the far end of a link; each node is compiled once."""
        from .nodes import INEXACT, NODES, fallback

        if link.node not in self._outputs:
            node = self.graph.nodes[link.node]
            if link.node in self._active:
                self.approximate(node, "part of a cycle")
                return Value(FLOAT, "0.0", (0.0,))
            self._active.add(link.node)
            function: Callable[[Compiler, Node], dict[str, Value]] = NODES.get(node.kind, fallback)
            self._outputs[link.node] = function(self, node)
            self._active.discard(link.node)
        outputs = self._outputs[link.node]
        node = self.graph.nodes[link.node]
        if (node.kind, link.output) in INEXACT:
            self.approximate(node, INEXACT[node.kind, link.output])
        if link.output in outputs:
            return outputs[link.output]
        self.approximate(node, f"output {link.output!r} is not available")
        return next(iter(outputs.values())) if outputs else Value(FLOAT, "0.0", (0.0,))

    # -- internals -----------------------------------------------------------------------------------------------

    def _param(self, number: float) -> str:
        index = len(self.result.params)
        self.result.params.append(number)
        return f"material_param({index})"


def compile_surface(graph: ShaderGraph, images: Sequence[Image] = ()) -> CompiledGraph:
    """Compile a material's surface to ``Closure surface_closure(SurfacePoint point)``; ``images`` are the scene's."""
    c = Compiler(graph, images)
    value = Value(CLOSURE, "closure_none()")
    if graph.surface is not None:
        value = c.convert(c.output(graph.surface), CLOSURE)
    elif graph.volume is not None:  # the hull of a volume is not seen
        value = Value(CLOSURE, "closure_transparent(vec3(1.0))")
        c.result.transparent = True
    body = "\n".join(f"    {line}" for line in c.lines)
    c.result.glsl = f"Closure surface_closure(SurfacePoint point) {{\n{body}\n    return {value.text};\n}}\n"
    return c.result


def compile_world(graph: ShaderGraph, images: Sequence[Image] = ()) -> CompiledGraph:
    """Compile a world to ``vec3 world_radiance(vec3 direction_ws)``; ``constant`` is set if it is one colour."""
    c = Compiler(graph, images, world=True)
    if graph.surface is None:
        c.result.constant = (0.0, 0.0, 0.0)
        c.result.glsl = "vec3 world_radiance(vec3 direction_ws) { return vec3(0.0); }\n"
        return c.result
    value = c.convert(c.output(graph.surface), CLOSURE)
    body = "\n".join(f"    {line}" for line in c.lines)
    c.result.glsl = (
        "vec3 world_radiance(vec3 direction_ws) {\n    SurfacePoint point = surface_point_of_world(direction_ws);\n"
        f"{body}\n    return {value.text}.emission;\n}}\n"
    )
    c.result.constant = value.constant if len(value.constant or ()) == 3 else None
    return c.result


def _spread(count: int, wanted: int) -> list[int]:
    """``wanted`` indices spread over ``count``, first and last among them."""
    return [round(i * (count - 1) / (wanted - 1)) for i in range(wanted)]


def _gray(numbers: tuple[float, ...]) -> float:
    r, g, b = numbers[:3]
    return 0.2126 * r + 0.7152 * g + 0.0722 * b
