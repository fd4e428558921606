# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables of what the glossy lobe reflects, made once per context."""

from __future__ import annotations

from ..facts import Facts
from ..frame import Frame
from ..graph import Pass, Planned, Texture, Uniform

# Roughness × cosine × curve. 16 a side is Cycles' own resolution; the last curve is Schlick's.
_ALBEDO = (16, 16, 17)
_ENERGY = (32, 32)  # whole groups of 8 × 8


class BRDFTables(Pass):
    title = "BRDF Tables"
    writes = (
        Texture("brdf.albedo", "brdf_albedo", "fraction of the way from F0 to F90 of the directional albedo, over "
                "(roughness, cosine, Fresnel curve)", "r32f", lambda f: _ALBEDO, filter="linear", scratch=True),
        Texture("brdf.average", "brdf_average", "the same, cosine-weighted over directions, over (roughness, curve)",
                "r32f", lambda f: (_ALBEDO[0], _ALBEDO[2]), filter="linear", scratch=True),
        Texture("brdf.energy", "brdf_energy", "albedo without Fresnel over (roughness, cosine), and its average",
                "rg32f", lambda f: _ENERGY, filter="linear", scratch=True),
    )  # fmt: skip
    uniforms = (Uniform("table", "int", "which of the three tables to fill"),)
    shaders = {"main": {"compute": "passes/brdf_tables_comp.glsl"}}

    def rate(self, facts: Facts) -> str:
        return "static"

    def absent(self, facts: Facts) -> str | None:
        return None if facts.layered else "no material is glossy"

    def run(self, frame: Frame, planned: Planned) -> None:
        textures = [frame.resources[write.name] for write in self.writes]
        if self.title in frame.gl.kept:
            for texture, data in zip(textures, frame.gl.kept[self.title], strict=True):
                texture.write(data)
            return
        program = frame.program(planned)
        for table, size in enumerate((_ALBEDO, (_ALBEDO[0], _ALBEDO[2]), _ENERGY)):
            frame.set(program, table=table)
            frame.compute(planned, program, size)
        # Every viewport and every final render wants the same ones.
        frame.gl.kept[self.title] = [texture.read() for texture in textures]
