# SPDX-License-Identifier: GPL-3.0-or-later
"""Drive the real Blender program with Quartet from this checkout."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from functools import cache
from pathlib import Path

import pytest
from conftest import ROOT, SHARED

TOOL = SHARED / "tools" / "blender"
CACHE = ROOT / ".cache" / "real-blender"
_PLATFORMS = ("manylinux_2_28_x86_64", "manylinux_2_17_x86_64", "manylinux2014_x86_64", "manylinux1_x86_64")

_PREAMBLE = """
import json, sys, traceback
sys.path[:0] = {paths!r}
def report(**values):
    with open({report!r}, "w") as file:
        json.dump(values, file)
import bpy
"""


def available() -> str | None:
    """Why the real Blender can't be driven here, or None."""
    if not TOOL.is_file():
        return "no real Blender here"
    if os.geteuid() != 0:
        return "the real Blender's root needs root"
    return None


def need() -> None:
    """Skip without a real Blender; fail instead where CI says that there is one."""
    why = available()
    if why and os.environ.get("QUARTET_REQUIRE_REAL_BLENDER"):
        pytest.fail(f"CI requires the real Blender: {why}")
    if why:
        pytest.skip(why)


@cache
def site() -> Path:
    """A folder with moderngl and glcontext for the Python that this Blender runs."""
    version = subprocess.run(
        [str(TOOL), "--exec", "python3", "-c", "import sys; print('%d.%d' % sys.version_info[:2])"],
        capture_output=True, text=True, check=True, timeout=1800,
    ).stdout.split()[-1]  # fmt: skip
    folder = CACHE / f"python{version}"
    if not (folder / "done").exists():
        wheels = folder / "wheels"
        wheels.mkdir(parents=True, exist_ok=True)
        command = [sys.executable, "-m", "pip", "download", "-q", "--no-deps", "--only-binary=:all:", "--python-version",
                   version, "--implementation", "cp", "-d", str(wheels)]  # fmt: skip
        for platform in _PLATFORMS:
            command += ["--platform", platform]
        subprocess.run([*command, "moderngl", "glcontext"], check=True, timeout=600)
        for wheel in wheels.glob("*.whl"):
            zipfile.ZipFile(wheel).extractall(folder / "site")
        (folder / "done").touch()
    return folder / "site"


def run(script: str, tmp_path: Path, *options: str, timeout: int = 600) -> dict:
    """Run ``script`` in the real Blender; it calls ``report(**values)``, which come back. Fails with Blender's output when
    it does not."""
    need()
    answer = tmp_path / "report.json"
    paths = [str(ROOT), str(site())]
    code = _PREAMBLE.format(paths=paths, report=str(answer)) + script
    path = tmp_path / "script.py"
    path.write_text(code)
    done = subprocess.run(
        [str(TOOL), *options, "--factory-startup", "--python-exit-code", "1", "-P", str(path)],
        capture_output=True, text=True, timeout=timeout,
    )  # fmt: skip
    if not answer.exists():
        pytest.fail(f"Blender gave no report (exit {done.returncode}):\n{done.stdout[-4000:]}\n{done.stderr[-4000:]}")
    return json.loads(answer.read_text())
