# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension's zip: built, validated, installed into a clean profile of the real Blender, used, taken out again."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from conftest import ROOT
from real_blender import need, run, run_window

MODULE = "bl_ext.user_default.quartet"

# A lit default cube, small.
_SCENE = """
scene = bpy.context.scene
scene.render.engine = "QUARTET"
scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 64, 36, 100
scene.quartet.samples = 2
def rendered(path):
    scene.render.image_settings.file_format = "PNG"
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)
    pixels = list(bpy.data.images.load(path).pixels)
    return [min(pixels[0::4]), max(pixels[0::4])]
"""

_INSTALL = """
bpy.context.preferences.view.show_splash = False
bpy.ops.extensions.package_install_files(filepath={zip!r}, repo="user_default", enable_on_install=True)
import importlib
root = importlib.import_module({module!r})
""" + _SCENE + """
out = dict(span=rendered({picture!r}), where=root.__file__)
import moderngl
out["moderngl"] = moderngl.__file__
status = importlib.import_module({module!r} + ".host.status")
preferences = importlib.import_module({module!r} + ".host.preferences")
class Layout:
    def __init__(self): self.texts = []
    def label(self, text="", **_): self.texts.append(text)
    def operator(self, name, **_): self.texts.append(name)
    def row(self): return self
    box = row
layout = Layout()
preferences.draw(layout)
out["preferences"] = layout.texts
out["page"] = {module!r} in bpy.context.preferences.addons
window = bpy.context.window_manager.quartet
window.reference_samples, window.compare_percentage = 2, 50
out["compared"] = list(bpy.ops.quartet.compare())
bpy.ops.wm.save_userpref()
report(**out)
"""

# Disabling must leave nothing.
_DISABLE = """
import sys, threading
def disabled():
    bpy.ops.preferences.addon_disable(module={module!r})
    out = {}
    out["classes"] = [n for n in dir(bpy.types) if n.startswith(("QUARTET", "Quartet"))]
    out["operators"] = [n for n in dir(bpy.ops.quartet)]
    out["panels"] = [p.__name__ for p in bpy.types.Panel.__subclasses__() if "QUARTET" in getattr(p, "COMPAT_ENGINES", ())]
    out["properties"] = [hasattr(bpy.types.Scene, "quartet"), hasattr(bpy.types.WindowManager, "quartet")]
    out["engine"] = any(getattr(e, "bl_idname", "") == "QUARTET" and e.is_registered
                        for e in bpy.types.RenderEngine.__subclasses__())
    out["threads"] = [t.name for t in threading.enumerate() if "Quartet" in t.name]
    out["handlers"] = [f.__module__ for name in dir(bpy.app.handlers) for f in (getattr(bpy.app.handlers, name)
                       if isinstance(getattr(bpy.app.handlers, name), list) else ()) if "quartet" in f.__module__]
    viewport = sys.modules.get({module!r} + ".host.viewport")
    out["menu"] = [f.__module__ for f in bpy.types.TOPBAR_MT_render.draw._draw_funcs if "quartet" in f.__module__]
    ui = sys.modules.get({module!r} + ".ui")
    out["timers"] = any(bpy.app.timers.is_registered(f) for f in (viewport and viewport._tick, ui and ui._look) if f)
    return out
"""

# A second start finds it installed.
_AGAIN = _SCENE + _DISABLE + """
out = dict(span=rendered({picture!r}))
report(**out, **disabled())
"""

_IN_WINDOW = _SCENE + _DISABLE + """
def steps():
    import importlib, gpu
    viewport = importlib.import_module({module!r} + ".host.viewport")
    gl = importlib.import_module({module!r} + ".gl")
    out = dict(backend=gpu.platform.backend_type_get())
    scene.quartet.viewport_samples = 4
    area, space, region = view()
    space.shading.type = "RENDERED"
    done = []
    def shown():
        views = viewport.viewports()
        return bool(views) and views[0]._picture is not None and views[0]._picture.subframes == 4
    yield shown
    yield 0.3
    picture = viewport.viewports()[0]._picture
    out["subframes"], out["lit"] = picture.subframes, float(picture.pixels[..., :3].max())
    out["driver"] = gl.shared().driver
    shot({folder!r} + "/window.png")
    bpy.app.handlers.render_complete.append(lambda *_: done.append(True))
    bpy.ops.render.render("INVOKE_DEFAULT")
    def finished():
        return bool(done)
    yield finished
    scene.render.image_settings.file_format = "PNG"
    bpy.data.images["Render Result"].save_render({picture!r})
    pixels = list(bpy.data.images.load({picture!r}).pixels)
    out["span"] = [min(pixels[0::4]), max(pixels[0::4])]
    yield 0.3
    out.update(disabled())
    yield 0.5
    shot({folder!r} + "/disabled.png")
    report(**out)
"""


@pytest.fixture(scope="module")
def zips(tmp_path_factory) -> Path:
    """The folder of freshly built zips."""
    pytest.importorskip("bpy")
    folder = tmp_path_factory.mktemp("dist")
    done = subprocess.run(
        [sys.executable, str(ROOT / "scripts" / "build_extension"), "--output", str(folder)], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


@pytest.mark.blender
@pytest.mark.parametrize(("platform", "tag"), [("linux_x64", "manylinux"), ("windows_x64", "win_amd64")])
def test_a_zip_has_the_wheels_of_its_platform_for_every_blender(zips, platform, tag):
    """moderngl and glcontext for Python 3.11, 3.13 and 3.14, for that platform only; the package, its shaders, no command
    line. Blender's own validator has accepted it: the builder runs it."""
    (path,) = zips.glob(f"*{platform}.zip")
    names = zipfile.ZipFile(path).namelist()
    wheels = [n for n in names if n.endswith(".whl")]
    assert len(wheels) == 6 and all(tag in n for n in wheels)
    for package in ("moderngl", "glcontext"):
        for python in ("cp311", "cp313", "cp314"):
            assert any(f"{package}-" in n and f"-{python}-" in n for n in wheels), f"{package} for {python}"
    assert {"blender_manifest.toml", "__init__.py", "LICENSE", "host/engine.py"} <= set(names)
    assert sum(n.endswith(".glsl") for n in names) == len(list((ROOT / "gi_addon" / "glsl").rglob("*.glsl")))
    assert not any(Path(n).name.startswith(("cli", "__main__")) or "__pycache__" in n for n in names)


@pytest.fixture(scope="module")
def installed(zips, tmp_path_factory) -> tuple[Path, dict]:
    """A clean profile with the extension installed from the zip and used once in ``-b``, and that run's report."""
    need()
    (path,) = zips.glob("*linux_x64.zip")
    folder = tmp_path_factory.mktemp("installed")
    profile = folder / "profile"
    profile.mkdir()
    return profile, run(_filled(_INSTALL, folder, path), folder, "-b", profile=profile)


def _filled(script: str, folder: Path, path: Path | str = "") -> str:
    values = {"{zip!r}": str(path), "{module!r}": MODULE, "{picture!r}": str(folder / "out.png"), "{folder!r}": str(folder)}
    for key, value in values.items():
        script = script.replace(key, repr(value))
    return script


def _nothing_left(report: dict) -> bool:
    return report["properties"] == [False, False] and not any(
        report[key] for key in ("engine", "classes", "operators", "panels", "threads", "handlers", "timers", "menu")
    )


@pytest.mark.blender
@pytest.mark.realblender
def test_installed_from_the_zip_it_renders_and_leaves_nothing_behind(installed, tmp_path):
    profile, first = installed
    assert first["where"].startswith(str(profile)) and first["moderngl"].startswith(str(profile))
    assert first["span"][1] > first["span"][0] + 0.1
    assert any("OpenGL driver: " in text and "not started" not in text for text in first["preferences"])
    assert first["page"] and first["compared"] == ["FINISHED"]
    second = run(_filled(_AGAIN, tmp_path), tmp_path, "-b", profile=profile)
    assert second["span"] == first["span"]
    assert _nothing_left(second), second


@pytest.mark.blender
@pytest.mark.realblender
@pytest.mark.parametrize("backend", ["opengl", "vulkan"])
def test_installed_it_renders_in_the_window_and_leaves_nothing_behind(installed, tmp_path, backend):
    """The next start finds it enabled: the viewport shows the cube, F12 renders it meanwhile, and disabling it with the
    viewport open leaves nothing."""
    profile, first = installed
    answer = run_window(
        _filled(_IN_WINDOW, tmp_path), tmp_path, "--gpu-backend", backend, size="720x500", profile=profile
    )
    assert answer["backend"] == backend.upper()
    assert answer["subframes"] == 4 and answer["lit"] > 0.1 and answer["driver"]
    assert answer["span"] == pytest.approx(first["span"], abs=2 / 255)
    assert _nothing_left(answer), answer


@pytest.mark.realblender
def test_without_opengl_the_window_says_so(tmp_path):
    """Blender on Vulkan, and no OpenGL for Quartet at all: the panel, F12 and the driver check give the reason."""
    answer = run_window(
        """
def steps():
    from gi_addon.host import status
    bpy.context.scene.render.engine = "QUARTET"
    view()[1].shading.type = "RENDERED"
    def told():
        return bool(status.problem())
    yield told
    out = dict(viewport=status.problem())
    try:
        bpy.ops.quartet.check_driver()
    except RuntimeError as error:
        out["check"] = str(error)
    ended = []
    bpy.app.handlers.render_cancel.append(lambda *_: ended.append(True))
    bpy.context.preferences.view.render_display_type = "NONE"
    bpy.ops.render.render("INVOKE_DEFAULT")
    def over():
        return bool(ended)
    yield over
    report(**out, final=status.problems["final"])
""",
        tmp_path, "--gpu-backend", "vulkan", size="720x500",
        __EGL_VENDOR_LIBRARY_FILENAMES="/nowhere", EGL_PLATFORM="none",
    )  # fmt: skip
    assert set(answer) == {"viewport", "check", "final"}
    for text in answer.values():
        assert "no OpenGL context on this machine" in text and "Install the graphics driver" in text


@pytest.mark.realblender
def test_an_old_driver_gets_a_message_where_the_user_looks(tmp_path):
    """OpenGL 4.2: the render fails with the reason, which the panel shows too, and nothing crashes."""
    answer = run(
        "import gi_addon\ngi_addon.register()\n" + _SCENE + """
from gi_addon.host import status
try:
    bpy.ops.render.render()
    said = ""
except RuntimeError as error:
    said = str(error)
report(said=said, panel=status.problem())
gi_addon.unregister()
""",
        tmp_path, "-b", MESA_GL_VERSION_OVERRIDE="4.2",
    )  # fmt: skip
    for text in answer.values():
        assert "OpenGL 4.3" in text and "4.2" in text
