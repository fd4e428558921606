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

# A window's script is a generator called ``steps``: it yields how many seconds Blender's own loop shall run meanwhile, or
# a function to wait for.
_WINDOW = """
import os, subprocess, time
def shot(path):
    subprocess.run(["import", "-window", "root", path], check=True)
def view():
    area = next(a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == "VIEW_3D")
    return area, area.spaces.active, next(r for r in area.regions if r.type == "WINDOW")
def here():
    area, _, region = view()
    return bpy.context.temp_override(window=bpy.context.window_manager.windows[0], area=area, region=region)
def second_view():
    # Another viewport beside the first, rendered too.
    with here():
        bpy.ops.screen.area_split(direction="VERTICAL", factor=0.5)
    for a in bpy.context.window_manager.windows[0].screen.areas:
        if a.type == "VIEW_3D":
            a.spaces.active.shading.type = "RENDERED"
def final_render(samples):
    # Start a small final render; the list has something in it when it has ended.
    ended, scene = [], bpy.context.scene
    bpy.app.handlers.render_complete.append(lambda *_: ended.append(True))
    scene.render.resolution_x, scene.render.resolution_y, scene.quartet.samples = 160, 90, samples
    bpy.ops.render.render("INVOKE_DEFAULT")
    return ended
def studio():
    # A red and a white box on a floor under a spot, in the default file; the camera looks at them.
    from mathutils import Vector
    scene = bpy.context.scene
    for o in list(bpy.data.objects):
        bpy.data.objects.remove(o)
    def box(name, size, location, color):
        bpy.ops.mesh.primitive_cube_add(size=1.0, location=location)
        o = bpy.context.object
        o.name, o.scale = name, size
        o.data.materials.append(bpy.data.materials.new(name))
        from gi_addon.host.compat import node_tree
        node = node_tree(o.data.materials[0]).nodes["Principled BSDF"]
        node.inputs["Base Color"].default_value = (*color, 1.0)
        node.inputs["Roughness"].default_value = 1.0
        return o
    box("Floor", (8.0, 8.0, 0.2), (0.0, 0.0, -0.1), (0.7, 0.7, 0.7))
    box("Red", (1.0, 1.0, 2.0), (-1.0, 0.0, 1.0), (0.8, 0.05, 0.05))
    box("White", (1.0, 1.0, 1.0), (0.6, 0.3, 0.5), (0.8, 0.8, 0.8))
    light = bpy.data.objects.new("Spot", bpy.data.lights.new("Spot", "SPOT"))
    light.data.energy, light.data.spot_size, light.location = 800.0, 1.4, (3.0, -2.0, 5.0)
    light.rotation_euler = (Vector((0, 0, 0)) - light.location).to_track_quat("-Z", "Y").to_euler()
    scene.collection.objects.link(light)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (2.5, -6.0, 3.0)
    camera.rotation_euler = (Vector((0, 0, 0.6)) - camera.location).to_track_quat("-Z", "Y").to_euler()
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.world = bpy.data.worlds.new("Grey")
    node_tree = __import__("gi_addon.host.compat", fromlist=["x"]).node_tree
    node_tree(scene.world).nodes["Background"].inputs["Color"].default_value = (0.05, 0.05, 0.06, 1.0)
    scene.render.engine = "QUARTET"
    scene.quartet.viewport_samples = 4
    bpy.context.view_layer.update()
    return scene
def settled():
    from gi_addon.host import viewport
    return bool(viewport.viewports()) and all(
        v._picture is not None and v._request is not None and not v._dirty and v._picture.request.key == v._request.key
        and not v._due() and v._job is None and v._picture.request.scale == 1 for v in viewport.viewports())
class _Driver:
    def __init__(self):
        self.steps, self.wait, self.until = steps(), None, 0.0
    def __call__(self):
        try:
            if self.wait is not None and not self.wait():
                if time.monotonic() > self.until:
                    raise TimeoutError("waited in vain for " + getattr(self.wait, "__name__", "something"))
                return 0.02
            self.wait = None
            order = next(self.steps)
            if callable(order):
                self.wait, self.until = order, time.monotonic() + {patience}
                return 0.02
            return order
        except StopIteration:
            pass
        except BaseException:
            report(error=traceback.format_exc())
        sys.stdout.flush()
        os._exit(0)
bpy.context.preferences.view.show_splash = False
bpy.app.timers.register(_Driver(), first_interval=1.0, persistent=True)
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


def run(script: str, tmp_path: Path, *options: str, timeout: int = 600, profile: Path | None = None, **environment) -> dict:
    """Run ``script`` in the real Blender; it calls ``report(**values)``, which come back. Fails with Blender's output when
    it does not.

    It sees this checkout and the libraries it needs; with ``profile``, a folder of user settings, it sees only what is
    installed there.
    """
    need()
    answer = tmp_path / "report.json"
    answer.unlink(missing_ok=True)
    paths = [str(ROOT), str(site())] if profile is None else []
    code = _PREAMBLE.format(paths=paths, report=str(answer)) + script
    path = tmp_path / "script.py"
    path.write_text(code)
    # That program has another Mesa than this machine: two of them in one shader cache end in a bus error now and then.
    cache = CACHE / "mesa"
    cache.mkdir(parents=True, exist_ok=True)
    done = subprocess.run(
        [str(TOOL), *options, *(["--factory-startup"] if profile is None else []), "--python-exit-code", "1", "-P", str(path)],
        capture_output=True, text=True, timeout=timeout,
        env={**os.environ, "MESA_SHADER_CACHE_DIR": str(cache), **environment,
             **({"BLENDER_USER_RESOURCES": str(profile)} if profile else {})},
    )  # fmt: skip
    if not answer.exists():
        pytest.fail(f"Blender gave no report (exit {done.returncode}):\n{done.stdout[-4000:]}\n{done.stderr[-4000:]}")
    return json.loads(answer.read_text())


def run_window(
    steps: str, tmp_path: Path, *options: str, size: str = "1000x700", timeout: int = 600, profile: Path | None = None,
    **environment,
) -> dict:
    """Run the generator ``steps()`` in a window of the real Blender; see ``_WINDOW`` for what it has at hand. With
    ``profile`` only what is installed there, as in :func:`run`."""
    opening = "" if profile else "import gi_addon\ngi_addon.register()\n"
    code = opening + steps + _WINDOW.replace("{patience}", "150")
    answer = run(code, tmp_path, "--window", size, *options, timeout=timeout, profile=profile, **environment)
    if "error" in answer:
        pytest.fail(answer["error"])
    return answer
