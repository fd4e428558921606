# SPDX-License-Identifier: GPL-3.0-or-later
"""GPU structs from numpy dtypes: one declaration gives both the Python layout and the GLSL text (std430)."""

from __future__ import annotations

import numpy as np

_SCALARS = {"f4": ("float", "vec"), "i4": ("int", "ivec"), "u4": ("uint", "uvec")}


def struct(*fields: tuple) -> np.dtype:
    """A std430-aligned dtype from ``(name, type[, shape])`` fields.

    ``type`` is ``f4``, ``i4`` or ``u4``; ``shape`` is 2, 3 or 4 for vectors, ``(4, 4)`` for a matrix (column-major in
    memory, so store ``matrix.T``). Padding fields ``_0``, ``_1`` … are inserted where std430 needs them.
    """
    out: list[tuple] = []
    offset, align_max, pads = 0, 4, 0
    for name, kind, *rest in fields:
        shape = rest[0] if rest else 1
        size, align = _layout(shape)
        gap = -offset % align
        if gap:
            out += [(f"_{pads + i}", "u4") for i in range(gap // 4)]
            pads += gap // 4
            offset += gap
        out.append((name, kind) if shape == 1 else (name, kind, shape))
        offset += size
        align_max = max(align_max, align)
    gap = -offset % align_max
    out += [(f"_{pads + i}", "u4") for i in range(gap // 4)]
    return np.dtype(out)


def _layout(shape) -> tuple[int, int]:
    """(size, alignment) in bytes of a std430 member."""
    if shape == (4, 4):
        return 64, 16
    return {1: (4, 4), 2: (8, 8), 3: (12, 16), 4: (16, 16)}[shape]


def glsl_struct(name: str, dtype: np.dtype) -> str:
    """GLSL text of ``struct name`` whose std430 layout equals ``dtype``. Raises ValueError if it can't."""
    lines = [f"struct {name} {{"]
    offset = 0
    for field in dtype.names:
        sub, at = dtype.fields[field][:2]
        base, shape = (sub.subdtype or (sub, ()))
        scalar, vector = _SCALARS[base.str[1:]]
        shape = 1 if shape == () else (4, 4) if tuple(shape) == (4, 4) else shape[0]
        size, align = _layout(shape)
        if at % align or at != offset:
            raise ValueError(f"{name}.{field} at byte {at} is not where std430 puts it")
        glsl = scalar if shape == 1 else "mat4" if shape == (4, 4) else f"{vector}{shape}"
        lines.append(f"    {glsl} {field};")
        offset = at + size
    if dtype.itemsize != offset:
        raise ValueError(f"{name} has {dtype.itemsize} bytes, its members end at {offset}")
    return "\n".join([*lines, "};"])
