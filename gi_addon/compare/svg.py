# SPDX-License-Identifier: GPL-3.0-or-later
"""Small charts as inline SVG, drawn from their data without any library: for pages made inside Blender."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from .page import esc, number

_WIDTH, _LABEL, _ROW, _TOP = 760, 280, 22, 26


def bars(rows: Sequence[tuple[str, float]], unit: str, color: str) -> str:
    """Horizontal bars from zero, one per (label, value ≥ 0), each with its value in ``unit``."""
    most = max((value for _, value in rows), default=0.0) or 1.0
    span = _WIDTH - _LABEL - 90
    body = []
    for i, (label, value) in enumerate(rows):
        y = _ROW * i
        width = span * value / most
        body.append(
            _text(_LABEL - 8, y + 15, label, "end")
            + f'<rect x="{_LABEL}" y="{y + 4}" width="{width:.1f}" height="{_ROW - 8}" fill="{color}"/>'
            + _text(_LABEL + width + 6, y + 15, f"{number(value)} {unit}")
        )
    return _svg(_ROW * len(rows), body)


def dots(rows: Sequence[tuple[str, Mapping[str, float]]], colors: Mapping[str, str]) -> str:
    """Values above zero on one logarithmic axis: per row a label and a dot for each series that has a value, in the
    series' colour; the legend stands above."""
    values = [v for _, series in rows for v in series.values() if v > 0.0 and math.isfinite(v)]
    if not values:
        return ""
    low, high = math.floor(math.log10(min(values))), math.ceil(math.log10(max(values)))
    high = max(high, low + 1)
    span = _WIDTH - _LABEL - 30

    def place(value: float) -> float:
        return _LABEL + 10 + span * (math.log10(value) - low) / (high - low)

    bottom = 2 * _TOP + _ROW * len(rows)
    body = []
    for decade in range(low, high + 1):
        x = place(10.0**decade)
        body.append(
            f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{2 * _TOP}" y2="{bottom}" stroke="currentColor" opacity="0.2"/>'
            + _text(x, 2 * _TOP - 6, f"{10.0**decade:g}", "middle")
        )
    x = float(_LABEL)
    for name, color in colors.items():
        body.append(f'<circle cx="{x}" cy="12" r="5" fill="{color}"/>' + _text(x + 10, 16, name))
        x += 30 + 7.5 * len(name)
    for i, (label, series) in enumerate(rows):
        y = 2 * _TOP + _ROW * i + _ROW / 2
        body.append(_text(_LABEL - 8, y + 4, label, "end"))
        for name, color in colors.items():
            value = series.get(name, 0.0)
            if value > 0.0 and math.isfinite(value):
                body.append(
                    f'<circle cx="{place(value):.1f}" cy="{y}" r="5" fill="{color}"><title>{esc(label)}, {esc(name)}: '
                    f"{number(value)}</title></circle>"
                )
    return _svg(bottom, body)


def _text(x: float, y: float, text: str, anchor: str = "start") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="currentColor">{esc(text)}</text>'


def _svg(height: float, body: Sequence[str]) -> str:
    return (
        f'<div class=scroll><svg width="{_WIDTH}" height="{height:.0f}" viewBox="0 0 {_WIDTH} {height:.0f}" font-size="13" '
        f'font-family="system-ui,sans-serif" role="img">{"".join(body)}</svg></div>'
    )
