# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectra to colours: tables for the Blackbody and Wavelength nodes."""

from __future__ import annotations

from functools import cache

import numpy as np

# The CIE 1931 2° standard observer, 380 to 780 nm by 5 nm: x̄, ȳ, z̄ in units of 10⁻⁴.
_OBSERVER = """
14 0 65 22 1 105 42 1 201 76 2 362 143 4 679 232 6 1102 435 12 2074 776 22 3713 1344 40 6456 2148 73 10391 2839 116 13856
3285 168 16230 3483 230 17471 3481 298 17826 3362 380 17721 3187 480 17441 2908 600 16692 2511 739 15281 1954 910 12876
1421 1126 10419 956 1390 8130 580 1693 6162 320 2080 4652 147 2586 3533 49 3230 2720 24 4073 2123 93 5030 1582
291 6082 1117 633 7100 782 1096 7932 573 1655 8620 422 2257 9149 298 2904 9540 203 3597 9803 134 4334 9950 87
5121 10000 57 5945 9950 39 6784 9786 27 7621 9520 21 8425 9154 18 9163 8700 17 9786 8163 14 10263 7570 11 10567 6949 10
10622 6310 8 10456 5668 6 10026 5030 3 9384 4412 2 8544 3810 2 7514 3210 1 6424 2650 0 5419 2170 0 4479 1750 0
3608 1382 0 2835 1070 0 2187 816 0 1649 610 0 1212 446 0 874 320 0 636 232 0 468 170 0 329 119 0 227 82 0 158 57 0
114 41 0 81 29 0 58 21 0 41 15 0 29 10 0 20 7 0 14 5 0 10 4 0 7 2 0 5 2 0 3 1 0 2 1 0 2 1 0 1 0 0 1 0 0 1 0 0 0 0 0
"""
OBSERVER = np.array(_OBSERVER.split(), "f8").reshape(81, 3) * 1e-4
_NANOMETRES = np.arange(380.0, 785.0, 5.0)
REC709_FROM_XYZ = np.array([
    [3.2404542, -1.5371385, -0.4985314], [-0.9692660, 1.8760108, 0.0415560], [0.0556434, -0.2040259, 1.0572252],
])  # fmt: skip
_ENTRIES = 129


@cache
def blackbody_table() -> list[tuple[float, ...]]:
    """Colours of a black body of luminance 1 (Rec.709, not below 0) over 10⁴/T from 10⁴/12000 to 10⁴/800 K⁻¹: Planck's law
    seen by the standard observer. Blender's own fit agrees within 1 %."""
    temperature = 1e4 / np.linspace(1e4 / 12000.0, 1e4 / 800.0, _ENTRIES)
    wavelength = _NANOMETRES * 1e-9
    # h c / k = 0.0143878 m K; the law's constants drop out.
    radiance = wavelength**-5 / np.expm1(0.01438777 / (wavelength[None] * temperature[:, None]))
    xyz = radiance @ OBSERVER
    rgb = (xyz / xyz[:, 1:2]) @ REC709_FROM_XYZ.T
    return [(*row, 1.0) for row in np.maximum(rgb, 0.0).tolist()]


# Directional albedo of Cycles' microfibre sheen of roughness 0, 1/8 … 1 (rows) seen at cosine 0, 1/8 … 1 (columns):
# measured on a sphere in Cycles' Diffuse Color (docs/materials.md).
_SHEEN = np.array([
    [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [0.0131, 0.0715, 0.0024, 0.0003, 0.0001, 0.0, 0.0, 0.0, 0.0],
    [0.0201, 0.3183, 0.1022, 0.0270, 0.0074, 0.0025, 0.0010, 0.0005, 0.0003],
    [0.0208, 0.4482, 0.2552, 0.1288, 0.0608, 0.0279, 0.0131, 0.0063, 0.0033],
    [0.0208, 0.5196, 0.3679, 0.2438, 0.1539, 0.0944, 0.0563, 0.0330, 0.0186],
    [0.0209, 0.5682, 0.4503, 0.3430, 0.2536, 0.1842, 0.1307, 0.0915, 0.0619],
    [0.0212, 0.6098, 0.5166, 0.4269, 0.3467, 0.2788, 0.2226, 0.1765, 0.1380],
    [0.0219, 0.6481, 0.5723, 0.4972, 0.4285, 0.3689, 0.3180, 0.2746, 0.2370],
    [0.0226, 0.6850, 0.6196, 0.5562, 0.4988, 0.4496, 0.4074, 0.3724, 0.3419],
])  # fmt: skip


def sheen_table(roughness: float) -> list[tuple[float, ...]]:
    """Sheen's albedo over the cosine of the view, 9 rows, at one roughness."""
    at = np.clip(roughness, 0.0, 1.0) * 8.0
    row = [float(np.interp(at, np.arange(9), _SHEEN[:, k])) for k in range(9)]
    return [(v, v, v, 1.0) for v in row]


def blackbody(temperature: float) -> np.ndarray:
    """The colour (3,) at one temperature, from the table."""
    table = np.array(blackbody_table())[:, :3]
    at = (1e4 / np.clip(temperature, 800.0, 12000.0) - 1e4 / 12000.0) / (1e4 / 800.0 - 1e4 / 12000.0) * (_ENTRIES - 1)
    return np.stack([np.interp(at, np.arange(_ENTRIES), table[:, k]) for k in range(3)])


@cache
def wavelength_table() -> list[tuple[float, ...]]:
    """Colours (Rec.709) of single wavelengths, 380 to 780 nm by 5 nm, over 2.52: Blender's scale, after which no component
    exceeds 1."""
    return [(*row, 1.0) for row in (OBSERVER @ REC709_FROM_XYZ.T / 2.52).tolist()]
