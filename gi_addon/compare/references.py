# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles references, rendered once and kept.

R1 has one diffuse and one glossy bounce, what the paper's techniques approximate; R∞ has 32. Each comes as two halves of
different seeds, whose difference is the reference's own noise.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..outputs import OUTPUTS
from . import exr

# Passes by their names in a ready reference's file.
READY_KEYS = {
    "Combined": "Combined", "Diffuse Direct": "DiffDir", "Diffuse Indirect": "DiffInd", "Diffuse Color": "DiffCol",
    "Glossy Direct": "GlossDir", "Glossy Indirect": "GlossInd", "Glossy Color": "GlossCol", "Ambient Occlusion": "AO",
    "Emission": "Emit", "Environment": "Env",
}  # fmt: skip
BOUNCES = {"R1": 1, "Rinf": 32}
SEEDS = {"A": 1, "B": 2}
_FORMAT = 1  # raised when what a cached file means changes


def cache_folder() -> Path:
    """Where references are kept: ``$QUARTET_CACHE``, else the user's cache folder."""
    if os.environ.get("QUARTET_CACHE"):
        return Path(os.environ["QUARTET_CACHE"])
    if os.name == "nt":
        return Path(os.environ.get("LOCALAPPDATA", Path.home())) / "quartet" / "cache"
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "quartet"


@dataclass(frozen=True)
class Halves:
    """A reference as two renders of independent noise: pass -> (H, W, 3) f4."""

    a: dict[str, np.ndarray]
    b: dict[str, np.ndarray]

    def mean(self, name: str) -> np.ndarray:
        return (self.a[name].astype("f8") + self.b[name]).astype("f4") / 2.0


def reference(
    kind: str,
    scene_key: str,
    resolution: tuple[int, int],
    samples: int,
    passes: Iterable[str],
    render: Callable[[int, int, int], dict[str, np.ndarray]],
    *,
    folder: Path | None = None,
) -> Halves:
    """The reference ``kind`` (R1 or Rinf) of a scene, from the cache or by ``render(bounces, samples, seed)``.

    ``scene_key`` names the scene's content; a file that can't be read is rendered again.
    """
    passes = tuple(passes)
    folder = (folder or cache_folder()) / "references"
    halves = []
    for _half, seed in SEEDS.items():
        text = repr((_FORMAT, scene_key, resolution, samples, BOUNCES[kind], seed, sorted(passes)))
        path = folder / f"{hashlib.blake2b(text.encode(), digest_size=16).hexdigest()}.exr"
        data = _read(path, passes)
        if data is None:
            data = render(BOUNCES[kind], samples, seed)
            folder.mkdir(parents=True, exist_ok=True)
            part = path.with_suffix(f".{os.getpid()}.part.exr")
            exr.write(part, {name: data[name] for name in passes})
            part.replace(path)
        halves.append({name: data[name] for name in passes})
    return Halves(*halves)


def ready(path: Path, resolution: tuple[int, int], passes: Iterable[str]) -> dict[str, Halves] | None:
    """References rendered elsewhere, R1 and Rinf, from an archive of arrays ``R1.A.DiffInd`` … (H, W, 3), row 0 at the top.

    Blocks of pixels are averaged where the archive's picture is a whole multiple of ``resolution``: of a box filter of one
    pixel that is the smaller picture's box filter, no approximation. Passes that are light over colour (outputs.py) are the
    blocks' light over their colour: the mean of four ratios would count pixels without a lobe as dark. None if there is no
    such file. Raises ValueError for another size.
    """
    if not path.is_file():
        return None
    width, height = resolution

    def shrunk(data: np.ndarray) -> np.ndarray:
        rows, columns = data.shape[:2]
        if rows % height or columns % width or rows * width != columns * height:
            raise ValueError(f"{path.name} is {columns} x {rows}: {width} x {height} is no whole share of that")
        blocks = data[::-1].astype("f4").reshape(height, rows // height, width, columns // width, -1)
        return blocks.mean(axis=(1, 3), dtype="f8").astype("f4")

    with np.load(path, allow_pickle=False) as data:

        def smaller(kind: str, half: str, name: str) -> np.ndarray | None:
            key = f"{kind}.{half}.{READY_KEYS.get(name)}"
            if key not in data.files:
                return None
            divide = OUTPUTS[name].divide
            color = f"{kind}.{half}.{READY_KEYS.get(next((o.name for o in OUTPUTS.values() if o.layers == (divide,)), name))}"
            if divide is None or color not in data.files:
                return shrunk(data[key])
            light, tint = shrunk(data[key].astype("f4") * data[color].astype("f4")), shrunk(data[color])
            return np.divide(light, tint, out=np.zeros_like(light), where=tint > 0.0)

        return {
            kind: Halves(*({n: a for n in passes if (a := smaller(kind, half, n)) is not None} for half in SEEDS))
            for kind in BOUNCES
        }


def _read(path: Path, passes: tuple[str, ...]) -> dict[str, np.ndarray] | None:
    if not path.is_file():
        return None
    try:
        data = exr.read(path)
    except Exception:
        path.unlink(missing_ok=True)
        return None
    return data if all(name in data for name in passes) else None
