# SPDX-License-Identifier: GPL-3.0-or-later
"""What the panels and the preferences tell the user of the last frames: passes, milliseconds, notes, the log.

Plain data, written from whatever thread renders and read while panels draw.
"""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass

from ..gl.context import MIB
from ..graph import Plan
from ..renderer import Renderer
from ..scene import Scene

_LOG_LINES = 200


@dataclass(frozen=True)
class PassRow:
    """One pass that ran: MiB of what it writes, mean milliseconds per run (None where not measured)."""

    title: str
    rate: str
    reason: str
    mib: float
    milliseconds: float | None


@dataclass(frozen=True)
class Report:
    """One frame, of the viewport or a final render."""

    kind: str
    technique: str
    resolution: tuple[int, int]
    subframes: int
    seconds: float
    rows: tuple[PassRow, ...]
    skipped: tuple[tuple[str, str], ...]
    mib: float
    notes: tuple[str, ...] = ()
    approximated: tuple[tuple[str, str], ...] = ()  # (material, what of it)


# The last frame of each kind, ``viewport`` and ``final``, and why there is none of a kind. A viewport that goes on shows
# nothing of why a final render failed, so each kind keeps its own.
latest: dict[str, Report] = {}
problems: dict[str, str] = {}
changes: int = 0  # goes up with whatever panels should show
_log: deque[str] = deque(maxlen=_LOG_LINES)


def summarise(kind: str, renderer: Renderer, plan: Plan, scene: Scene, subframes: int, seconds: float) -> Report:
    """A Report of a plan that ``renderer`` ran, on the GL thread; it keeps nothing of the scene alive."""
    facts = plan.facts
    milliseconds = renderer.timers.collect()
    rows = []
    for planned in plan.run:
        times = milliseconds.get(planned.title)
        rows.append(PassRow(
            planned.title, planned.task.rate(facts), planned.reason,
            sum(w.nbytes(facts) for w in planned.writes) / MIB, sum(times) / len(times) if times else None,
        ))  # fmt: skip
    return Report(
        kind, facts.settings.technique, facts.resolution, subframes, seconds, tuple(rows),
        tuple((task.title, reason) for task, reason in plan.skipped), plan.nbytes() / MIB,
        tuple(dict.fromkeys(renderer.notes(scene))),
        tuple((material.name, text) for material, compiled in zip(scene.materials, renderer.gpu.compiled, strict=True)
              for text in compiled.approximated),
    )  # fmt: skip


def publish(report: Report) -> None:
    """Make ``report`` the one that panels show, and log its notes the first time they come up."""
    known = {note for old in latest.values() for note in old.notes}
    for note in report.notes:
        if note not in known:
            log(note)
    latest[report.kind] = report
    resolved(report.kind)
    _changed()


def failed(kind: str, message: str) -> None:
    """Tell the panels and the log why there is no picture of a kind."""
    if message not in problems.values():
        log(message)
    problems[kind] = message
    _changed()


def resolved(kind: str) -> None:
    """There is a picture of this kind again."""
    if problems.pop(kind, None) is not None:
        _changed()


def _changed() -> None:
    global changes
    changes += 1


def problem() -> str:
    """Why there is no picture; '' where there is one."""
    return "; ".join(dict.fromkeys(problems.values()))


def log(message: str) -> None:
    """One line for the log in the preferences."""
    _log.append(f"{time.strftime('%H:%M:%S')}  {message}")


def log_lines() -> list[str]:
    """The log, oldest first."""
    return list(_log)


def forget() -> None:
    """Forget the frames: another file has been opened."""
    latest.clear()
    problems.clear()


def clear() -> None:
    """Forget everything: on unregister."""
    forget()
    _log.clear()
