# SPDX-License-Identifier: GPL-3.0-or-later
"""Multilayer EXR files as arrays, through the OpenEXR package (an extra of the command line) where there is one."""

from __future__ import annotations

import importlib.util
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..outputs import LONG_NAMES
from . import exr_plain

# Channel letters in array order.
_ORDER = ("R", "G", "B", "A", "X", "Y", "Z", "W", "V")


def _package():
    try:
        import OpenEXR
    except ImportError as error:
        raise RuntimeError("reading EXR files needs the OpenEXR package: pip install 'quartet-gi[cli]'") from error
    return OpenEXR


def read(path: str | Path) -> dict[str, np.ndarray]:
    """Passes of a (multilayer) EXR by Blender 5's names, without the view layer's: (H, W, channels) f4, row 0 at the bottom."""
    layers: dict[str, dict[str, np.ndarray]] = {}
    for name, pixels in _channels(path).items():
        *groups, letter = name.split(".")
        layers.setdefault(groups[-1] if groups else "Combined", {})[letter] = pixels
    out = {}
    for name, channels in layers.items():
        letters = [letter for letter in _ORDER if letter in channels] or sorted(channels)
        stack = np.stack([channels[letter] for letter in letters], -1).astype(np.float32)
        out[LONG_NAMES.get(name, name)] = np.ascontiguousarray(stack[::-1])
    return out


def _channels(path: str | Path) -> dict[str, np.ndarray]:
    """Channels by name: through OpenEXR, or inside Blender, which has none for scripts, by our own reader."""
    if importlib.util.find_spec("OpenEXR") is None:
        return exr_plain.read_channels(path)
    file = _package().File(str(path), separate_channels=True)
    return {name: channel.pixels for part in file.parts for name, channel in part.channels.items()}


def write(path: str | Path, passes: Mapping[str, np.ndarray], layer: str = "ViewLayer") -> None:
    """Write passes (row 0 at the bottom) as a multilayer EXR with Blender's channel names, 32 bit."""
    exr = _package()
    letters = {1: "Z", 3: "RGB", 4: "RGBA"}
    channels = {}
    for name, array in passes.items():
        names = "XYZ" if name == "Normal" else letters[array.shape[-1]]
        for i, letter in enumerate(names):
            channels[f"{layer}.{name}.{letter}"] = np.ascontiguousarray(array[::-1, :, i], np.float32)
    if set(passes) == {"Combined"}:
        channels = {key.split(".")[-1]: value for key, value in channels.items()}
    header = {"compression": exr.ZIP_COMPRESSION, "type": exr.scanlineimage}
    exr.File(header, channels).write(str(path))
