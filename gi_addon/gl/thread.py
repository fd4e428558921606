# SPDX-License-Identifier: GPL-3.0-or-later
"""The GL thread: it owns the context, and everything that touches OpenGL is a job in its queue.

Blender's own context is never made current here and never used: under Vulkan there is none, and sharing one is where
other engines' crashes come from.
"""

from __future__ import annotations

import atexit
import contextlib
import queue
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from .context import GL
from .errors import Cancelled, GLContextLost, GLError

_SHUTDOWN_SECONDS = 10.0


class CancelToken:
    """Set from any thread; jobs look at it between passes and sub-frames."""

    def __init__(self, poll: Callable[[], bool] | None = None) -> None:
        self._event = threading.Event()
        self._poll = poll

    def cancel(self) -> None:
        self._event.set()

    @property
    def cancelled(self) -> bool:
        return self._event.is_set() or (self._poll is not None and self._poll())

    def check(self) -> None:
        """Raise Cancelled if the owner gave up."""
        if self.cancelled:
            raise Cancelled


class GLThread:
    """One thread, one context, one queue. Starts on the first job; a failed start fails that job, not the process."""

    def __init__(self) -> None:
        self._jobs: queue.SimpleQueue = queue.SimpleQueue()
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None
        self._gl: GL | None = None
        self._driver = ""

    @property
    def driver(self) -> str:
        """The driver as text, '' before the first context."""
        return self._driver

    def submit(self, job: Callable[..., Any], *args, cancel: CancelToken | None = None, **kwargs) -> Future:
        """Queue ``job(gl, *args, **kwargs)``. Its result or exception comes back in the Future.

        A job whose ``cancel`` token is set before it starts is not run: its Future raises Cancelled.
        """
        future: Future = Future()
        with self._lock:
            if self._thread is None or not self._thread.is_alive():
                self._thread = threading.Thread(target=self._run, name="Quartet GL", daemon=True)
                self._thread.start()
            self._jobs.put((future, job, args, kwargs, cancel))
        return future

    def call(self, job: Callable[..., Any], *args, cancel: CancelToken | None = None, **kwargs) -> Any:
        """Run ``job(gl, *args, **kwargs)`` and wait for it. Inline when already on the GL thread."""
        if threading.current_thread() is self._thread:
            return job(self._context(), *args, **kwargs)
        return self.submit(job, *args, cancel=cancel, **kwargs).result()

    def close(self) -> None:
        """Finish queued jobs, release the context, end the thread. The next job starts afresh."""
        with self._lock:
            thread, self._thread = self._thread, None
            if thread is not None and thread.is_alive():
                self._jobs.put(None)
        if thread is not None and thread is not threading.current_thread():
            thread.join(_SHUTDOWN_SECONDS)

    def _run(self) -> None:
        while (item := self._jobs.get()) is not None:
            future, job, args, kwargs, cancel = item
            if not future.set_running_or_notify_cancel():
                continue
            try:
                if cancel is not None:
                    cancel.check()
                future.set_result(job(self._context(), *args, **kwargs))
            except BaseException as error:
                if isinstance(error, GLContextLost):
                    self._drop()
                future.set_exception(error)
            # Nothing of the job may outlive it: its arguments hold scenes and pictures.
            del future, job, args, kwargs, cancel, item
        self._drop()

    def _context(self) -> GL:
        if self._gl is None:
            self._gl = GL()
            if self._gl.driver != self._driver:
                self._driver = self._gl.driver
                print(f"Quartet: {self._driver}", file=sys.stderr)
        return self._gl

    def _drop(self) -> None:
        gl, self._gl = self._gl, None
        if gl is not None:
            # The context may be gone already; then there is nothing left to release.
            with contextlib.suppress(Exception):
                gl.close()


_shared = GLThread()


def shared() -> GLThread:
    """The process's GL thread."""
    return _shared


def driver() -> str:
    """The driver as text. Starts the GL thread if need be; raises GLError where there is no OpenGL 4.3."""
    return _shared.driver or _shared.call(lambda gl: gl.driver)


@atexit.register
def shutdown() -> None:
    """Release the process's GL context and end its thread."""
    _shared.close()


__all__ = ["CancelToken", "Cancelled", "GLError", "GLThread", "driver", "shared", "shutdown"]
