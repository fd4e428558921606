# SPDX-License-Identifier: GPL-3.0-or-later
"""The GL thread, its errors, its memory."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from conftest import ROOT

from gi_addon.gl import Cancelled, CancelToken, GLContextLost, GLOutOfMemory, GLThread, glsl_struct, struct
from gi_addon.gl.timers import PassTimers

pytestmark = pytest.mark.gl


def test_jobs_run_in_order_on_one_thread_and_errors_come_back():
    thread = GLThread()
    order = []
    futures = [thread.submit(lambda g, i=i: order.append((i, threading.get_ident()))) for i in range(8)]
    [f.result() for f in futures]
    assert [i for i, _ in order] == list(range(8))
    assert len({t for _, t in order}) == 1 and order[0][1] != threading.get_ident()
    with pytest.raises(ZeroDivisionError):
        thread.call(lambda g: 1 / 0)
    assert thread.call(lambda g: g.version)  # alive after an error
    thread.close()


def test_a_job_may_call_the_thread_it_runs_on():
    thread = GLThread()
    assert thread.call(lambda g: thread.call(lambda inner: inner is g))
    thread.close()


def test_a_cancelled_job_does_not_run():
    thread = GLThread()
    token, ran = CancelToken(), []
    block = threading.Event()
    first = thread.submit(lambda g: block.wait(5))
    second = thread.submit(lambda g: ran.append(1), cancel=token)
    token.cancel()
    block.set()
    first.result()
    with pytest.raises(Cancelled):
        second.result()
    assert not ran
    thread.close()


def test_the_thread_starts_again_after_close_and_after_a_lost_context():
    thread = GLThread()
    first = thread.call(lambda g: id(g.ctx))
    thread.close()
    assert thread.call(lambda g: g.renderer)

    def lose(g):
        raise GLContextLost("pretend")

    with pytest.raises(GLContextLost):
        thread.call(lose)
    assert thread.call(lambda g: g.renderer) and first
    thread.close()


def test_memory_is_counted_and_freed(gl):
    def job(g):
        before = g.bytes()
        texture = g.texture("t", (256, 128), "rgba32f")
        buffer = g.buffer("b", size=1000)
        during = g.bytes()
        g.release(texture, buffer)
        return before, during, g.bytes()

    before, during, after = gl(job)
    assert during - before == 256 * 128 * 16 + 1000
    assert after == before


def test_what_does_not_fit_is_refused_with_its_size(gl):
    with pytest.raises(GLOutOfMemory, match="limit"):
        gl(lambda g: g.texture("huge", (1 << 20, 4), "r8"))
    if gl(lambda g: g.software):
        with pytest.raises(GLOutOfMemory, match=r"volume needs \d+ MiB"):
            gl(lambda g: g.texture("volume", (2048, 2048, 2048), "rgba32f"))


@pytest.mark.parametrize("variable", ["LIBGL_DRIVERS_PATH", "__EGL_VENDOR_LIBRARY_FILENAMES"])
def test_no_driver_gives_a_message_not_a_crash(variable):
    """A machine without OpenGL: simulated by hiding Mesa's drivers from the loader."""
    code = (
        "from gi_addon.gl import driver, GLError\n"
        "try:\n    print('have', driver())\nexcept GLError as e:\n    print('message:', e)\n"
    )
    env = {**os.environ, variable: "/nowhere/nothing.json" if "EGL" in variable else "/nowhere"}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, env=env)
    assert done.returncode == 0, done.stderr
    if done.stdout.startswith("have"):
        pytest.skip("this driver does not heed the variable")
    assert "no OpenGL context" in done.stdout and "apt install" in done.stdout


def test_timers_measure_wall_time_on_software_and_never_nest(gl):
    def job(g):
        timers = PassTimers(g, enabled=True, wall=True)
        with timers.measure("sleep"):
            time.sleep(0.02)
        return timers.collect()

    assert gl(job)["sleep"][0] >= 19.0


def test_structs_follow_std430():
    dtype = struct(("a", "f4", 3), ("b", "f4"), ("c", "f4"), ("d", "f4", 3), ("m", "f4", (4, 4)), ("e", "i4"))
    assert dtype.fields["b"][1] == 12 and dtype.fields["d"][1] == 32 and dtype.fields["m"][1] == 48
    assert dtype.itemsize == 128
    text = glsl_struct("S", dtype)
    assert "vec3 a;" in text and "mat4 m;" in text and "int e;" in text
    with pytest.raises(ValueError, match="not where std430"):
        glsl_struct("S", np.dtype([("a", "f4"), ("b", "f4", 3)]))


def test_a_struct_reads_on_the_gpu_what_python_wrote(gl):
    dtype = struct(("a", "f4", 3), ("b", "i4"), ("c", "f4", 2), ("d", "f4", 4))
    data = np.zeros(3, dtype)
    data["a"], data["b"], data["c"], data["d"] = (1, 2, 3), (4, 5, 6), (7, 8), (9, 10, 11, 12)

    def job(g):
        code = (
            "layout(local_size_x = 1) in;\n" + glsl_struct("S", dtype)
            + "layout(std430, binding = 0) readonly buffer i { S s[]; };"
            "layout(std430, binding = 1) buffer o { float r[]; };"
            "void main() { uint k = gl_GlobalInvocationID.x;"
            "r[k] = s[k].a.z * 1000.0 + float(s[k].b) * 100.0 + s[k].c.y * 10.0 + s[k].d.w; }"
        )  # fmt: skip
        program = g.program("struct", {"compute": "s_comp.glsl"}, virtual={"s_comp.glsl": code})
        a, b = g.buffer("a", data), g.buffer("b", size=12)
        a.bind_to_storage_buffer(0)
        b.bind_to_storage_buffer(1)
        program.run(3)
        out = np.frombuffer(b.read(), "f4")[:3].copy()
        g.release(a, b)
        return out

    np.testing.assert_array_equal(gl(job), [3000 + 100 * b + 80 + 12 for b in (4, 5, 6)])
