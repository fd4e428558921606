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

from . import exr

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


def _read(path: Path, passes: tuple[str, ...]) -> dict[str, np.ndarray] | None:
    if not path.is_file():
        return None
    try:
        data = exr.read(path)
    except Exception:
        path.unlink(missing_ok=True)
        return None
    return data if all(name in data for name in passes) else None
