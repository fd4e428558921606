# SPDX-License-Identifier: GPL-3.0-or-later
"""Which settings of each technique, and of its peers, a comparison tries."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

from .. import presets
from ..settings import Settings, walk
from .studio import has_setting, settings_for

# Axes besides `samples`, the sub-frames that every technique averages. A setting that a version lacks is left out.
AXES: dict[str, dict[str, tuple]] = {
    "RSM": {"rsm.samples": (50, 200, 800), "gather_scale": (4, 1), "rsm.visibility": ("CELLS", "NONE"), "bounces": (1, 3)},
    "LPV": {"lpv.resolution": (16, 32, 64), "lpv.directions": ("48", "72"), "bounces": (1, 3)},
    "VCT": {"vct.resolution": (32, 64, 128), "vct.cones": (3, 12), "bounces": (1, 3)},
    "SSDO": {"ssdo.samples": (64, 256), "ssdo.steps": (16, 32), "ssdo.layers": (1, 2, 3), "gather_scale": (4, 1),
             "bounces": (1, 3)},
}
SUBFRAMES = {"none": (), "presets": (), "samples": (1, 4), "quick": (1, 4, 16), "full": (1, 2, 4, 8, 16, 32, 64)}
CYCLES_SAMPLES = {
    "none": (1, 16), "presets": (1, 4), "samples": (1, 4, 16, 64), "quick": (1, 4, 16, 64), "full": (1, 2, 4, 8, 16, 32, 64),
}  # fmt: skip
EEVEE_SAMPLES = {"none": (16,), "presets": (1, 4), "samples": (1, 4), "quick": (1, 16), "full": (1, 4, 16, 64)}


@dataclass(frozen=True)
class Candidate:
    """A point of the chart: a technique with settings (by their names, or a ``preset``), or a peer with options (``samples``,
    ``denoise``, ``raytracing``)."""

    method: str
    options: tuple[tuple[str, object], ...]

    @property
    def peer(self) -> bool:
        return self.method.startswith(("Cycles", "EEVEE"))

    @property
    def label(self) -> str:
        """Settings in words, without what is as by default."""
        if not self.options:
            return "defaults"
        return ", ".join(f"{k} {'on' if v is True else 'off' if v is False else v}" for k, v in self.options)

    def settings(self, base: Settings | None = None) -> Settings:
        """The settings of a technique; ``base`` holds the scene's own."""
        settings = base.copy() if base else settings_for(self.method)
        settings.set("technique", self.method)
        for name, value in self.options:
            if name == "preset":
                presets.apply(settings, value)
            else:
                settings.set(name, value)
        return settings


def _candidate(method: str, options: dict) -> Candidate:
    return Candidate(method, tuple(options.items()))


def technique_sweep(technique: str, sweep: str) -> list[Candidate]:
    """``none``: the scene's own settings; ``presets``: our own three; ``samples``: sub-frames; ``quick``: those, each axis alone
    at 4 sub-frames, and the presets; ``full``: all combinations of the axes at every number of sub-frames, and the presets."""
    if sweep == "none":
        return [Candidate(technique, ())]
    offered = [_candidate(technique, {"preset": name}) for name in presets.SHARES if sweep != "samples"]
    subframes = SUBFRAMES[sweep]
    default = Settings()
    limits = {path: meta for path, _, meta in walk()}
    axes = {
        k: tuple(v for v in values if not isinstance(v, int) or limits[k].low <= v <= limits[k].high)
        for k, values in AXES.get(technique, {}).items()
        if has_setting(k)
    }
    found = [_candidate(technique, {"samples": n}) for n in subframes]
    if sweep == "quick":
        for name, values in axes.items():
            found += [_candidate(technique, {"samples": 4, name: v}) for v in values if v != default.get(name)]
    elif sweep == "full":
        for n, *values in itertools.product(subframes, *axes.values()):
            changed = {k: v for k, v in zip(axes, values, strict=True) if v != default.get(k)}
            found.append(_candidate(technique, {"samples": n, **changed}))
    return list(dict.fromkeys(found + offered))


def peer_sweep(peer: str, sweep: str) -> list[Candidate]:
    """Cycles with and without OpenImageDenoise, EEVEE with and without ray tracing."""
    if peer == "cycles":
        return [
            _candidate("Cycles + OIDN" if denoise else "Cycles", {"samples": n})
            for n in CYCLES_SAMPLES[sweep]
            for denoise in (False, True)
        ]
    if peer == "eevee":
        return [_candidate("EEVEE", {"samples": n, "raytracing": rt}) for n in EEVEE_SAMPLES[sweep] for rt in (False, True)]
    raise ValueError(f"no peer {peer!r}; there are cycles and eevee")
