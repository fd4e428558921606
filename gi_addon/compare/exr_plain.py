# SPDX-License-Identifier: GPL-3.0-or-later
"""Scanline EXR files with nothing but NumPy, as Blender writes them: inside Blender there is no OpenEXR package.

After "OpenEXR File Layout" and "Technical Introduction to OpenEXR": single and multi part, uncompressed, ZIPS and ZIP.
"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np

_MAGIC = 20000630
_MULTI_PART = 0x1000
_TILED_OR_DEEP = 0x0200 | 0x0800
_TYPES = {0: np.dtype("<u4"), 1: np.dtype("<f2"), 2: np.dtype("<f4")}
# Compression byte -> scanlines in a block.
_LINES = {0: 1, 2: 1, 3: 16}


class EXRError(ValueError):
    """Not an EXR file, or a kind that this reader does not know."""


def read_channels(path: str | Path) -> dict[str, np.ndarray]:
    """All channels by their full names, (H, W) each, row 0 at the top. Raises EXRError."""
    data = Path(path).read_bytes()
    try:
        return _read(data)
    except (struct.error, IndexError, zlib.error, KeyError, UnicodeDecodeError) as error:
        raise EXRError(f"{path}: damaged EXR file ({type(error).__name__}: {error})") from error


def _read(data: bytes) -> dict[str, np.ndarray]:
    magic, version = struct.unpack_from("<II", data)
    if magic != _MAGIC or version & _TILED_OR_DEEP:
        raise EXRError("not a scanline EXR file")
    multi = bool(version & _MULTI_PART)
    headers, at = [], 8
    while True:
        header, at = _header(data, at)
        if not header:
            break
        headers.append(header)
        if not multi:
            break
    out: dict[str, np.ndarray] = {}
    for header in headers:
        x0, y0, x1, y1 = struct.unpack("<4i", header["dataWindow"])
        width, height = x1 - x0 + 1, y1 - y0 + 1
        compression = header["compression"][0]
        if compression not in _LINES:
            raise EXRError(f"EXR compression {compression} needs the OpenEXR package")
        blocks = -(-height // _LINES[compression])
        offsets = struct.unpack_from(f"<{blocks}Q", data, at)
        at += 8 * blocks
        channels = _channels(header["channels"])
        prefix = header["name"].decode() + "." if multi and "name" in header else ""
        planes = {name: np.empty((height, width), dtype) for name, dtype in channels}
        for offset in offsets:
            start = offset + (4 if multi else 0)  # a chunk of a multi-part file opens with its part's number
            y, size = struct.unpack_from("<ii", data, start)
            rows = min(_LINES[compression], y1 + 1 - y)
            expected = rows * width * sum(dtype.itemsize for _, dtype in channels)
            raw = data[start + 8 : start + 8 + size]
            if compression and size < expected:
                raw = _unzip(raw)
            place = 0
            for row in range(y - y0, y - y0 + rows):
                for name, dtype in channels:
                    planes[name][row] = np.frombuffer(raw, dtype, width, place)
                    place += width * dtype.itemsize
        for name, plane in planes.items():
            # A part's own name says which layer its channels belong to, where they do not say so themselves.
            full = name if name.startswith(prefix) else prefix + name
            out[full] = plane
    return out


def _header(data: bytes, at: int) -> tuple[dict[str, bytes], int]:
    header = {}
    while data[at]:
        name, at = _text(data, at)
        _, at = _text(data, at)
        (size,) = struct.unpack_from("<i", data, at)
        header[name] = data[at + 4 : at + 4 + size]
        at += 4 + size
    return header, at + 1


def _text(data: bytes, at: int) -> tuple[str, int]:
    end = data.index(b"\0", at)
    return data[at:end].decode(), end + 1


def _channels(value: bytes) -> list[tuple[str, np.dtype]]:
    out, at = [], 0
    while value[at]:
        name, at = _text(value, at)
        (kind,) = struct.unpack_from("<i", value, at)
        out.append((name, _TYPES[kind]))
        at += 16  # type, linearity and its padding, sampling in x and y
    return out


def _unzip(raw: bytes) -> bytes:
    """Undo ZIP(S): inflate, add up the differences, interleave the two halves."""
    packed = np.frombuffer(zlib.decompress(raw), np.uint8).astype(np.int64)
    packed[1:] -= 128
    flat = (np.cumsum(packed) & 0xFF).astype(np.uint8)
    half = (len(flat) + 1) // 2
    out = np.empty(len(flat), np.uint8)
    out[0::2], out[1::2] = flat[:half], flat[half:]
    return out.tobytes()
