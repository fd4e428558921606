# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes that declare what they read and write, and the planner that runs no more of them than a scene needs.

A pass is absent when the scene lacks what it is about, or an effect is off (``Pass.absent`` says why), or something it
must read is absent. A present pass runs only if somebody reads what it writes; a texture nobody reads is not allocated.
Requested outputs start that chain. ``quartet inspect`` prints the outcome.

The table of a pass (``reads``, ``writes``, ``uniforms``) is also where the GLSL declarations and bindings come from.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from .gl.context import MIB
from .gl.formats import FORMATS
from .gl.structs import glsl_struct
from .gpu_types import STRUCT_FILES

if TYPE_CHECKING:
    from .facts import Facts
    from .frame import Frame

Size = Callable[["Facts"], tuple[int, ...]]


@dataclass(frozen=True)
class Texture:
    """A texture that a pass writes.

    ``name`` is the graph's (``gbuffer.normal``), ``glsl`` the shaders' (``gbuf_normal``); ``doc`` says what a texel is,
    with unit and space; ``size`` gives (w, h) or (w, h, d) from the facts; ``when`` returns why this texture is absent
    from a scene, or None; ``mips`` counts levels below the first; ``access`` is how compute shaders bind it.
    """

    name: str
    glsl: str
    doc: str
    format: str
    size: Size
    when: Callable[[Facts], str | None] | None = None
    mips: Callable[[Facts], int] | None = None
    layers: bool = False
    filter: str = "nearest"
    access: str = "writeonly"
    scratch: bool = False  # the pass's own, allocated whenever it runs

    def nbytes(self, facts: Facts) -> int:
        """Bytes of all levels."""
        size = self.size(facts)
        total = int(np.prod(size)) * FORMATS[self.format].bytes
        if self.mips and self.mips(facts):
            total += total // (7 if len(size) == 3 and not self.layers else 3)
        return total

    @property
    def dims(self) -> str:
        return "2DArray" if self.layers else "2D"

    def sampler(self, facts: Facts) -> str:
        return f"{FORMATS[self.format].glsl}sampler{self._kind(facts)}"

    def image(self, facts: Facts) -> str:
        return f"{FORMATS[self.format].glsl}image{self._kind(facts)}"

    def _kind(self, facts: Facts) -> str:
        return "2DArray" if self.layers else "3D" if len(self.size(facts)) == 3 else "2D"

    def describe(self, facts: Facts) -> str:
        return f"{'×'.join(map(str, self.size(facts)))} {self.format}"


@dataclass(frozen=True)
class Buffer:
    """A storage buffer that a pass writes: ``count(facts)`` elements of ``dtype``, an array called ``glsl`` of GLSL
    type ``struct`` (a scalar type's own name if ``dtype`` has no fields)."""

    name: str
    glsl: str
    doc: str
    struct: str
    dtype: np.dtype
    count: Callable[[Facts], int]
    when: Callable[[Facts], str | None] | None = None
    scratch: bool = False  # the pass's own, allocated whenever it runs

    def nbytes(self, facts: Facts) -> int:
        return max(16, self.count(facts) * self.dtype.itemsize)

    def describe(self, facts: Facts) -> str:
        return f"{self.count(facts)} × {self.struct}"


def glsl_name(name: str) -> str:
    """A resource's name in shaders by convention, for one that nothing declares."""
    return name.replace("gbuffer.", "gbuf_").replace(".", "_")


@dataclass(frozen=True)
class Optional:
    """A read that a pass can do without; its shaders see ``HAS_<GLSL NAME>`` 0 or 1. A technique need not have it. With
    ``only_for`` it is read only where one of those writes of the pass is wanted."""

    name: str
    only_for: tuple[str, ...] = ()


@dataclass(frozen=True)
class Uniform:
    """A uniform: GLSL ``type`` and ``name``, and what it is, with unit and space."""

    name: str
    type: str
    doc: str


class Pass:
    """One box of a technique's pipeline.

    ``rate`` is ``static`` (run only when stale: a stamp in ``depends``, a setting in ``settings`` or a static input has
    changed) or ``subframe`` (every time; ``Planned.stale`` then tells what of it is still good). ``repeats``: what it writes
    hangs on these, on its reads and on the sub-frame's number alone, so that a view that turns needs it once. ``shaders`` maps a
    key to stages (see ``GL.program``). ``figure`` names the paper's box; ``source`` says where its light is from, if not plain.
    """

    title: ClassVar[str] = ""
    figure: ClassVar[str] = ""
    source: ClassVar[str] = ""
    reads: ClassVar[tuple[str | Optional, ...]] = ()
    writes: ClassVar[tuple[Texture | Buffer, ...]] = ()
    uniforms: ClassVar[tuple[Uniform, ...]] = ()
    shaders: ClassVar[dict[str, dict[str, str]]] = {}
    depends: ClassVar[tuple[str, ...]] = ()
    settings: ClassVar[tuple[str, ...]] = ()
    repeats: ClassVar[bool] = False

    def rate(self, facts: Facts) -> str:
        """``static`` or ``subframe``."""
        return "subframe"

    def place(self, facts: Facts) -> tuple:
        """What of the camera the pass's output depends on; it is stale when that changes."""
        return ()

    def absent(self, facts: Facts) -> str | None:
        """Why this scene has no use for this pass, or None."""
        return None

    def defines(self, facts: Facts) -> dict[str, int]:
        """Extra preprocessor defines of its shaders."""
        return {}

    def run(self, frame: Frame, planned: Planned) -> bool | None:
        """Issue the GL work. False says that all it would have written is there already."""
        raise NotImplementedError


@dataclass
class Planned:
    """A pass that runs, with the resources it was granted."""

    task: Pass
    facts: Facts
    reads: list[Texture | Buffer]
    writes: list[Texture | Buffer]
    absent_reads: list[str]
    absent_writes: list[Texture | Buffer]
    reason: str
    programs: dict[Any, Any] = field(default_factory=dict)
    # Whether what the pass depends on has changed since it last ran: all of its output is due.
    stale: bool = True
    # What the pass itself noted of its last run, to tell what of it is still good.
    memory: dict[str, Any] = field(default_factory=dict)

    @property
    def title(self) -> str:
        return self.task.title

    def has(self, name: str) -> bool:
        """Whether a read is available or a write is wanted."""
        return any(r.name == name for r in (*self.reads, *self.writes))

    # -- declarations for the shaders --------------------------------------------------------------------------

    def texture_reads(self) -> list[Texture]:
        return [r for r in self.reads if isinstance(r, Texture)]

    def buffers(self) -> list[tuple[Buffer, bool]]:
        """(buffer, written) in binding order."""
        return [(r, False) for r in self.reads if isinstance(r, Buffer)] + [
            (w, True) for w in self.writes if isinstance(w, Buffer)
        ]

    def texture_writes(self) -> list[Texture]:
        return [w for w in self.writes if isinstance(w, Texture)]

    def defines(self) -> dict[str, int]:
        """HAS_x for every resource in the pass's table, plus the pass's own."""
        present = {r.glsl for r in (*self.reads, *self.writes)}
        names = present | {w.glsl for w in self.absent_writes} | set(self.absent_reads)
        out = {f"HAS_{name.upper()}": int(name in present) for name in names}
        out.update(self.task.defines(self.facts))
        return out

    def prelude(self, stage: str) -> str:
        """GLSL declarations of inputs, outputs and uniforms for a ``fragment``, ``compute`` or ``vertex`` stage."""
        if stage == "vertex":
            return "\n".join(f"uniform {u.type} {u.name};" for u in self.task.uniforms)
        lines: list[str] = []
        for unit, texture in enumerate(self.texture_reads()):
            lines.append(f"layout(binding = {unit}) uniform {texture.sampler(self.facts)} {texture.glsl};")
        declared: set[str] = set()
        for binding, (buffer, written) in enumerate(self.buffers()):
            if buffer.struct in STRUCT_FILES:
                lines.append(f'#include "{STRUCT_FILES[buffer.struct]}"')
            elif buffer.dtype.names and buffer.struct not in declared:
                lines.append(glsl_struct(buffer.struct, buffer.dtype))
                declared.add(buffer.struct)
            mode = "" if written else "readonly "
            lines.append(
                f"layout(std430, binding = {binding}) {mode}buffer {buffer.glsl}_block"
                f" {{ {buffer.struct} {buffer.glsl}[]; }};"
            )
        for slot, texture in enumerate(w for w in self.texture_writes() if w.format != "depth24"):
            f = FORMATS[texture.format]
            if stage == "fragment":
                lines.append(f"layout(location = {slot}) out {f.value_type} {texture.glsl};")
            elif stage == "compute":
                access = "" if texture.access == "readwrite" else f"{texture.access} "
                lines.append(
                    f"layout(binding = {slot}, {f.image}) {access}uniform {texture.image(self.facts)} {texture.glsl};"
                )
        lines += [f"uniform {u.type} {u.name};" for u in self.task.uniforms]
        return "\n".join(lines)


@dataclass
class Plan:
    """What a frame runs and what it leaves out, each with its reason."""

    run: list[Planned]
    skipped: list[tuple[Pass, str]]
    resources: dict[str, Texture | Buffer]
    unallocated: list[tuple[str, str]]
    facts: Facts
    outputs: tuple[str, ...]

    def nbytes(self) -> int:
        """Bytes of all planned textures and buffers."""
        return sum(r.nbytes(self.facts) for r in self.resources.values())

    def text(self) -> str:
        """The plan for people: passes that run and why, with sizes; what is left out and why."""
        lines = [f"outputs: {', '.join(self.outputs)}", "", "runs:"]
        for planned in self.run:
            rate = planned.task.rate(self.facts)
            lines.append(f"  {planned.title}  [{rate}] — {planned.reason}")
            for write in planned.writes:
                size = write.nbytes(self.facts) / MIB
                lines.append(f"      {write.name}: {write.describe(self.facts)}, {size:.2f} MiB — {write.doc}")
        lines += ["", "left out:"] if self.skipped or self.unallocated else []
        lines += [f"  {task.title} — {reason}" for task, reason in self.skipped]
        lines += [f"      {name} — {reason}" for name, reason in self.unallocated]
        lines += ["", f"total {self.nbytes() / MIB:.1f} MiB in {len(self.resources)} textures and buffers"]
        return "\n".join(lines)

    def graph_text(self) -> str:
        """The same as a Graphviz ``dot`` drawing."""
        lines = ["digraph quartet {", "  rankdir=LR; node [shape=box, fontname=sans];"]
        writer: dict[str, str] = {}
        for planned in self.run:
            lines.append(f'  "{planned.title}";')
            for write in planned.writes:
                writer[write.name] = planned.title
        for planned in self.run:
            edges: dict[str, list[str]] = {}
            for read in planned.reads:
                edges.setdefault(writer[read.name], []).append(read.name)
            for source, names in edges.items():
                label = "\\n".join(names)
                lines.append(f'  "{source}" -> "{planned.title}" [label="{label}"];')
        lines += [f'  "{task.title}" [style=dashed, fontcolor=gray, color=gray];' for task, _ in self.skipped]
        return "\n".join([*lines, "}"])


def plan(passes: Iterable[Pass], facts: Facts, outputs: Mapping[str, str]) -> Plan:
    """Choose what to run.

    ``passes`` in execution order; ``outputs`` maps wanted graph resources to the reason they are wanted (an output
    name). Raises ValueError if a pass reads what no earlier pass declares, or an output has no producer at all.
    """
    passes = list(passes)
    declared: dict[str, Texture | Buffer] = {}
    missing: dict[str, str] = {}  # resource -> why it can't be had
    absent: dict[int, str] = {}  # pass index -> why

    for index, task in enumerate(passes):
        reason = task.absent(facts)
        for read in task.reads:
            name = read.name if isinstance(read, Optional) else read
            if name not in declared and isinstance(read, Optional):
                missing.setdefault(name, "no pass of this technique makes it")
            elif name not in declared:
                raise ValueError(f"{task.title} reads {name}, which no earlier pass writes")
            if reason is None and not isinstance(read, Optional) and name in missing:
                reason = f"needs {name}: {missing[name]}"
        if reason is not None:
            absent[index] = reason
        for write in task.writes:
            declared[write.name] = write
            why = reason or (write.when(facts) if write.when else None)
            if why:
                missing[write.name] = why

    for name in outputs:
        if name not in declared:
            raise ValueError(f"no pass writes {name}")
    wanted = {name: f"for {why}" for name, why in outputs.items() if name not in missing}
    run: list[Planned] = []
    skipped: list[tuple[Pass, str]] = []
    unallocated: list[tuple[str, str]] = []
    for index in range(len(passes) - 1, -1, -1):
        task = passes[index]
        if index in absent:
            skipped.append((task, absent[index]))
            continue
        writes = [w for w in task.writes if w.name in wanted]
        if writes:
            own = [w for w in task.writes if getattr(w, "scratch", False) and w.name not in missing]
            writes = [w for w in task.writes if w in writes or w in own]
        else:
            names = [w.name for w in task.writes]
            skipped.append((task, "nothing that runs reads " + ", ".join(names)))
            continue
        granted = {w.name for w in writes}
        all_reads = [r if isinstance(r, Optional) else Optional(r) for r in task.reads]
        read_names = [
            r.name for r in all_reads if r.name not in missing and (not r.only_for or granted & set(r.only_for))
        ]
        reads = [declared[name] for name in read_names]
        run.append(Planned(
            task, facts, reads, writes,
            [declared[r.name].glsl if r.name in declared else glsl_name(r.name) for r in all_reads
             if r.name not in read_names],
            [w for w in task.writes if w not in writes],
            next(wanted[w.name] for w in writes if w.name in wanted),
        ))  # fmt: skip
        for read in reads:
            wanted.setdefault(read.name, f"{task.title} reads {read.name}")
        for write in task.writes:
            if write not in writes:
                unallocated.append((write.name, missing.get(write.name, "nothing that runs reads it")))
    run.reverse()
    skipped.reverse()
    unallocated.reverse()
    resources = {w.name: w for planned in run for w in planned.writes}
    return Plan(run, skipped, resources, unallocated, facts, tuple(outputs.values()))
