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


# The last frame of each kind, ``viewport`` and ``final``; why there is no picture, if there is none.
latest: dict[str, Report] = {}
problem: str = ""
_log: deque[str] = deque(maxlen=_LOG_LINES)


def summarise(
    kind: str, plan: Plan, subframes: int, seconds: float, milliseconds: dict[str, list[float]], notes: list[str]
) -> Report:
    """A Report of a plan that ran; keeps nothing of the scene alive."""
    facts = plan.facts
    rows = []
    for planned in plan.run:
        times = milliseconds.get(planned.title)
        rows.append(PassRow(
            planned.title, planned.task.rate(facts), planned.reason,
            sum(w.nbytes(facts) for w in planned.writes) / MIB, sum(times) / len(times) if times else None,
        ))  # fmt: skip
    skipped = tuple((task.title, reason) for task, reason in plan.skipped)
    return Report(kind, facts.settings.technique, facts.resolution, subframes, seconds, tuple(rows), skipped,
                  plan.nbytes() / MIB, tuple(notes))  # fmt: skip


def publish(report: Report) -> None:
    """Make ``report`` the one that panels show, and log its notes the first time they come up."""
    old = latest.get(report.kind)
    for note in report.notes:
        if old is None or note not in old.notes:
            log(note)
    latest[report.kind] = report
    resolved()


def failed(message: str) -> None:
    """Tell the panels and the log why there is no picture."""
    global problem
    if message != problem:
        log(message)
    problem = message


def resolved() -> None:
    """There is a picture again."""
    global problem
    problem = ""


def log(message: str) -> None:
    """One line for the log in the preferences."""
    _log.append(f"{time.strftime('%H:%M:%S')}  {message}")


def log_lines() -> list[str]:
    """The log, oldest first."""
    return list(_log)


def clear() -> None:
    """Forget everything: on unregister."""
    latest.clear()
    _log.clear()
    resolved()
