# SPDX-License-Identifier: GPL-3.0-or-later
"""Milliseconds per pass.

Two clocks: GL ``TIME_ELAPSED`` queries (a GPU's own time, no stall) and wall time with ``glFinish`` after each pass.
Software drivers answer 0 to the query, so there the wall clock counts. Queries never nest: OpenGL forbids it.
"""

from __future__ import annotations

import time
from collections import defaultdict
from contextlib import contextmanager

from .context import GL


class PassTimers:
    """Collects samples per pass name. ``wall`` forces the wall clock; it serialises the passes, so it is off by default
    on a GPU."""

    def __init__(self, gl: GL, *, enabled: bool = False, wall: bool | None = None) -> None:
        self.gl = gl
        self.enabled = enabled
        self.wall = gl.software if wall is None else wall
        self._pending: list[tuple[str, object]] = []
        self._free: list[object] = []
        self.samples: dict[str, list[float]] = defaultdict(list)

    @contextmanager
    def measure(self, name: str):
        """Time the GL work issued inside, in milliseconds."""
        if not self.enabled:
            yield
        elif self.wall:
            self.gl.ctx.finish()
            start = time.perf_counter()
            yield
            self.gl.ctx.finish()
            self.samples[name].append((time.perf_counter() - start) * 1e3)
        else:
            query = self._free.pop() if self._free else self.gl.ctx.query(time=True)
            with query:
                yield
            self._pending.append((name, query))

    def collect(self) -> dict[str, list[float]]:
        """Wait for outstanding queries and return all samples (ms) so far."""
        for name, query in self._pending:
            self.samples[name].append(query.elapsed * 1e-6)
            self._free.append(query)
        self._pending.clear()
        return dict(self.samples)

    def reset(self) -> None:
        self.collect()
        self.samples.clear()
