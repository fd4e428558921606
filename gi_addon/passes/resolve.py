# SPDX-License-Identifier: GPL-3.0-or-later
"""Put the sub-frame together and add it to the film."""

from __future__ import annotations

from ..facts import Facts
from ..frame import Frame
from ..gpu_scene import world_source
from ..graph import Optional, Pass, Planned, Texture, Uniform
from ..outputs import LAYERS


class Resolve(Pass):
    """The film: one layer per wanted quantity, summed over sub-frames. ``layers`` are those of the frame's outputs:
    what only other layers need is not read."""

    title = "Resolve"
    writes = (
        Texture("film", "film", "sums over sub-frames, one layer per quantity", "rgba32f",
                lambda f: (*f.picture, len(f.layers)), layers=True, access="readwrite"),
    )  # fmt: skip
    uniforms = (Uniform("first_subframe", "int", "1 in the first sub-frame, which overwrites the film"),)
    shaders = {"main": {"compute": "passes/resolve_comp.glsl"}}

    def __init__(self, layers: tuple[str, ...]) -> None:
        self.reads = tuple(
            Optional(name, () if any(name in LAYERS[layer] for layer in layers) else ("nothing",))
            for name in dict.fromkeys(name for names in LAYERS.values() for name in names)
        )

    def defines(self, facts: Facts) -> dict[str, int]:
        layers = {name: facts.layers.index(name) if name in facts.layers else -1 for name in LAYERS}
        return {"WORLD_VISIBLE": int(facts.world_visible)} | {f"LAYER_{name.upper()}": at for name, at in layers.items()}

    def run(self, frame: Frame, planned: Planned) -> None:
        units = len(planned.texture_reads())
        program = frame.program(planned, virtual={"generated/world.glsl": world_source(frame.gpu.world, units, camera=True)})
        frame.bind(planned)
        frame.gpu.bind_world_params()
        frame.gpu.bind_images(frame.gpu.world, units)
        frame.set(program, first_subframe=int(frame.subframe == 0))
        frame.compute(planned, program, planned.facts.picture)
        frame.gpu.unbind_images(units, len(frame.gpu.world.images))
