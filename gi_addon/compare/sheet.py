# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures side by side: technique, reference, difference."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np

_LABEL_HEIGHT = 16


def srgb(linear: np.ndarray) -> np.ndarray:
    """Linear values to sRGB bytes, clipped."""
    x = np.clip(np.nan_to_num(linear.astype("f8")), 0.0, 1.0)
    y = np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 1e-12) ** (1 / 2.4) - 0.055)
    return (y * 255.0 + 0.5).astype(np.uint8)


def exposure(reference: np.ndarray) -> float:
    """Scale that puts the reference's 95th percentile of luminance at display white."""
    luminance = reference[..., :3].astype("f8") @ np.array([0.2126, 0.7152, 0.0722])
    lit = luminance[luminance > 0]
    return 1.0 / float(np.percentile(lit, 95)) if lit.size else 1.0


def png(rgb: np.ndarray) -> bytes:
    """(H, W, 3) uint8, row 0 at the top, as a PNG file's bytes. By hand: Blender ships no imaging library."""
    height, width, _ = rgb.shape
    rows = rgb.reshape(height, 3 * width)
    # Filter 2 of the PNG specification: the difference to the row above, modulo 256.
    up = np.diff(rows, axis=0, prepend=np.zeros((1, 3 * width), np.uint8))
    lines = np.concatenate([np.full((height, 1), 2, np.uint8), up], axis=1)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    body = zlib.compress(lines.tobytes(), 9)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", body) + chunk(b"IEND", b"")


def write_png(path: str | Path, linear: np.ndarray) -> None:
    """Write (H, W, 3) linear values, row 0 at the bottom, as an sRGB PNG."""
    Path(path).write_bytes(png(srgb(linear[::-1, :, :3])))


def comparison(path: str | Path, rows: Sequence[tuple[str, np.ndarray, np.ndarray]], titles: Sequence[str]) -> None:
    """Write a sheet: per row (label, test, reference) the two and their difference × 4, all at the reference's
    exposure. Pictures (H, W, 3) linear, row 0 at the bottom."""
    from PIL import Image, ImageDraw

    height, width = rows[0][1].shape[:2]
    sheet = Image.new("RGB", (3 * width + 4, len(rows) * (height + _LABEL_HEIGHT)), (24, 24, 24))
    draw = ImageDraw.Draw(sheet)
    for i, (label, test, reference) in enumerate(rows):
        top = i * (height + _LABEL_HEIGHT)
        scale = exposure(reference)
        pictures = (test, reference, 4.0 * np.abs(test - reference))
        for k, (picture, title) in enumerate(zip(pictures, (*titles, "difference x 4"), strict=True)):
            x = k * (width + 2)
            draw.text((x + 3, top + 2), f"{label}: {title}", fill=(220, 220, 220))
            sheet.paste(Image.fromarray(srgb(picture[::-1, :, :3] * scale)), (x, top + _LABEL_HEIGHT))
    sheet.save(path)
