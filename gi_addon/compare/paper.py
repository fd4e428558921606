# SPDX-License-Identifier: GPL-3.0-or-later
"""What the paper states: Table 1 (which class makes which effect) and Table 2 (frame rates on a GTX 1070).

C. Lambru et al., "Comparative Study of Real-Time Global Illumination Techniques in Rendering Engines", IEEE Access 2021.
The text of Table 2 is damaged by scanning: ``None`` is unreadable, ``doubtful`` marks a rate that may be misread.
"""

from __future__ import annotations

from dataclasses import dataclass

EFFECTS = {
    "indirect_diffuse": "Indirect diffuse",
    "glossy": "Glossy reflections",
    "shadows": "Shadows",
    "ao": "Ambient occlusion",
    "translucency": "SSS and translucency",
    "volumetric": "Volumetric lighting",
    "area_lights": "Area lights",
}

YES, PARTIALLY, NO = "Yes", "Partially", "No"
TABLE_1: dict[str, dict[str, str]] = {
    "RSM": dict(zip(EFFECTS, (YES, PARTIALLY, YES, PARTIALLY, PARTIALLY, YES, NO), strict=True)),
    "LPV": dict(zip(EFFECTS, (YES, PARTIALLY, NO, NO, PARTIALLY, NO, YES), strict=True)),
    "VCT": dict(zip(EFFECTS, (YES, YES, YES, YES, YES, NO, YES), strict=True)),
    "SSDO": dict(zip(EFFECTS, (PARTIALLY, PARTIALLY, PARTIALLY, YES, PARTIALLY, PARTIALLY, PARTIALLY), strict=True)),
}

# The paper's GPU: 1920 lanes × 2 flops × 1.683 GHz boost, and 256-bit GDDR5 at 8 Gbit/s.
GTX_1070 = {"gflops": 1920 * 2 * 1.683, "gbytes": 256 / 8 * 8.0}


@dataclass(frozen=True)
class Row:
    """One row of Table 2: settings by dotted name and frame rates (1/s) by picture size."""

    technique: str
    label: str
    settings: tuple[tuple[str, object], ...]
    resolution: tuple[int, int]
    fps: float | None
    doubtful: bool = False

    @property
    def key(self) -> str:
        return f"{self.technique} {self.label} {self.resolution[0]}x{self.resolution[1]}"


HD, FULL_HD = (1280, 720), (1920, 1080)


def _rows() -> tuple[Row, ...]:
    rows: list[Row] = []

    def add(technique: str, label: str, settings: dict, hd: float | None, full_hd: float | None, doubtful: bool = False) -> None:
        packed = tuple(settings.items())
        rows.append(Row(technique, label, packed, HD, hd, doubtful))
        rows.append(Row(technique, label, packed, FULL_HD, full_hd))

    for resolution, rates in (
        (512, ((226, 122), (187, 99), (157, 84), (136, 73))),
        (1024, ((190, 109), (144, 84), (116, 68), (96, 58))),
    ):
        for samples, (hd, full_hd) in zip((100, 200, 300, 400), rates, strict=True):
            add("RSM", f"{resolution}², {samples} samples", {"rsm.resolution": resolution, "rsm.samples": samples}, hd, full_hd)
    for resolution, (hd, full_hd) in ((32, (196, 111)), (64, (94, 68))):
        add("LPV", f"{resolution}³", {"lpv.resolution": resolution, "lpv.cascades": "1"}, hd, full_hd)
    for continuous, rates in (
        (False, ((283, 145), (250, 128), (230, 109), (178, 89))),
        (True, ((214, 138), (214, 121), (170, 96), (74, 52))),
    ):
        for resolution, (hd, full_hd) in zip((64, 128, 256, 512), rates, strict=True):
            add(
                "VCT",
                f"{resolution}³, continuous {'on' if continuous else 'off'}",
                {"vct.resolution": resolution, "vct.continuous_voxelization": continuous},
                hd,
                full_hd,
                doubtful=continuous and resolution == 64,
            )
    for samples, (hd, full_hd) in zip((100, 200, 300, 400), ((85, 36), (50, None), (35, None), (27, None)), strict=True):
        # The paper's knows the picture alone.
        add("SSDO", f"{samples} samples", {"ssdo.samples": samples, "ssdo.layers": 1, "ssdo.margin": 0.0}, hd, full_hd)
    return tuple(sorted(rows, key=lambda r: ("RSM", "LPV", "VCT", "SSDO").index(r.technique)))


TABLE_2 = _rows()
