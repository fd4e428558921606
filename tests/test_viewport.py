# SPDX-License-Identifier: GPL-3.0-or-later
"""The rendered viewport: in a window of the real Blender, and its parts without one."""

from __future__ import annotations

import time
import types

import numpy as np
import pytest
from conftest import make
from real_blender import run_window

from gi_addon.compare import scenes
from gi_addon.gl import Cancelled, CancelToken
from gi_addon.renderer import Renderer
from gi_addon.settings import Settings

SQUARES = ((0.02, 0.02, 0.02), (0.18, 0.18, 0.18), (0.5, 0.1, 0.05), (0.7, 0.7, 0.7), (3.0, 2.0, 0.5), (8.0, 8.0, 8.0))

# How a session ends: the extension off, and the answer.
_END = """
    gi_addon.unregister()
    yield 0.3
    out["unregistered"] = len(viewport.viewports())
    report(**out)
"""

# One session does what a user does in ten minutes; each test looks at one part of its report.
_SESSION = """
def steps():
    from gi_addon.gl import shared
    from gi_addon.host import viewport
    out = {}
    scene = studio()
    area, space, region = view()
    space.shading.type = "RENDERED"
    space.region_3d.view_perspective = "CAMERA"
    yield 0.3
    yield settled
    v = viewport.viewports()[0]
    def snap(name):
        shown = viewport.viewports()
        out[name] = dict(v.counts, sync=v._sync.counts, size=v._request.size,
            instances=[len(x._scene.instances) for x in shown], viewports=len(shown),
            bytes=shared().call(lambda gl: gl.bytes()), border=v._request.border)
    def changed(name):
        yield 0.15
        yield settled
        snap(name)
    snap("start")
    scene.objects["White"].select_set(True)
    yield from changed("select")
    scene.objects["White"].location.x += 0.3
    yield from changed("move")
    bpy.data.materials["White"].node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0.1, 0.8, 0.1, 1.0)
    yield from changed("material")
    bpy.data.lights["Spot"].energy = 400.0
    yield from changed("light")
    scene.quartet.rsm.samples = 150
    yield from changed("setting")
    mesh = scene.objects["White"].data
    mesh.vertices[0].co.x -= 0.3
    mesh.update()
    yield from changed("mesh")
    scene.objects["Red"].hide_set(True)
    yield from changed("hide")
    scene.objects["Red"].hide_set(False)
    yield from changed("unhide")
    with here():
        bpy.context.view_layer.objects.active = scene.objects["Red"]
        for o in scene.objects:
            o.select_set(o.name == "Red")
        bpy.ops.view3d.localview(frame_selected=False)
    yield from changed("local view")
    with here():
        bpy.ops.view3d.localview(frame_selected=False)
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.transform.translate(value=(-5.0, 0.0, 0.0))
    yield from changed("edit mode")
    out["edited to"] = float(v._scene.bounds()[0][0])
    with here():
        bpy.ops.object.mode_set(mode="OBJECT")
    yield from changed("object mode")
    subprocess.run("xdotool search --onlyvisible --name Blender windowsize 640 440", shell=True)
    yield 0.3
    yield from changed("resize")
    scene.render.use_border = True
    scene.render.border_min_x, scene.render.border_max_x = 0.25, 0.75
    scene.render.border_min_y, scene.render.border_max_y = 0.25, 0.75
    yield from changed("border")
    scene.render.use_border = False
    with here():
        bpy.ops.ed.undo_push(message="before")
        scene.objects["White"].location.z += 2.0
        bpy.ops.ed.undo_push(message="after")
    yield from changed("raised")
    out["raised to"] = float(v._scene.bounds()[1][2])
    with here():
        bpy.ops.ed.undo()
    yield from changed("undo")
    out["undone to"] = float(v._scene.bounds()[1][2])
    scene = bpy.context.scene
    second_view()
    yield 0.3
    yield from changed("two viewports")
    shot({shot!r})
    done = final_render(4)
    for _ in range(5):
        bpy.data.objects["White"].location.x -= 0.05
        yield 0.05
    def rendered():
        return bool(done)
    yield rendered
    yield from changed("final render meanwhile")
    bpy.data.objects.remove(bpy.data.objects["Red"])
    yield from changed("delete")
    start = shared().call(lambda gl: gl.bytes())
    for i in range(25):
        bpy.data.objects["White"].location.x = 0.02 * i
        bpy.data.materials["White"].node_tree.nodes["Principled BSDF"].inputs["Roughness"].default_value = i / 25.0
        yield 0.02
    yield from changed("25 updates")
    out["grown"] = shared().call(lambda gl: gl.bytes()) - start
    scene.render.engine = "BLENDER_WORKBENCH"
    yield 0.5
    out["other engine"] = dict(viewports=len(viewport.viewports()), bytes=shared().call(lambda gl: gl.bytes()))
    scene.render.engine = "QUARTET"
    yield 0.3
    yield settled
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=False)
    yield 0.5
    out["new file"] = dict(viewports=len(viewport.viewports()), bytes=shared().call(lambda gl: gl.bytes()))
    bpy.context.scene.render.engine = "QUARTET"
    view()[1].shading.type = "RENDERED"
    yield 0.3
    yield settled
    out["default cube"] = len(viewport.viewports()[0]._scene.instances)
""" + _END

# What users do without waiting for the picture: each of these comes while the GL thread is at work for the viewport.
_HASTE = """
def steps():
    from gi_addon.gl import shared
    from gi_addon.host import status, viewport
    out, path = {}, {folder!r} + "/saved.blend"
    scene = studio()
    scene.quartet.viewport_samples = 64
    bpy.ops.wm.save_as_mainfile(filepath=path)
    area, space, region = view()
    space.shading.type = "RENDERED"
    yield 0.3
    def at_work():
        return any(v._job is not None and not v._job.done() for v in viewport.viewports())
    def picture():
        return any(v._picture is not None and v._picture.request.key == v._request.key for v in viewport.viewports())
    def state():
        return dict(viewports=len(viewport.viewports()), bytes=shared().call(lambda gl: gl.bytes()), problem=status.problem())
    def instances():
        return sorted(len(v._scene.instances) for v in viewport.viewports())
    yield picture
    # A file is opened, twice, while sub-frames are in the making.
    for _ in range(2):
        yield at_work
        bpy.ops.wm.open_mainfile(filepath=path, load_ui=False)
        yield 0.2
        yield picture
    out["file opened"] = dict(state(), instances=instances())
    # Engines are switched faster than any of them renders.
    scene = bpy.context.scene
    for engine in ("BLENDER_WORKBENCH", "QUARTET", "CYCLES", "QUARTET", "BLENDER_WORKBENCH"):
        scene.render.engine = engine
        yield 0.1
    yield 0.5
    out["engines switched"] = state()
    scene.render.engine = "QUARTET"
    yield 0.2
    yield at_work
    # The viewport becomes another editor and comes back.
    area.type = "IMAGE_EDITOR"
    yield 0.5
    out["another editor"] = state()
    area.type = "VIEW_3D"
    area, space, region = view()
    space.shading.type = "RENDERED"
    yield 0.2
    yield picture
    # A second viewport, and a final render meanwhile; then what they all show is deleted.
    second_view()
    yield 0.3
    ended = final_render(16)
    scene.objects["White"].location.x += 0.1
    yield at_work
    mesh = bpy.data.objects["White"].data
    bpy.data.objects.remove(bpy.data.objects["White"])
    bpy.data.meshes.remove(mesh)
    bpy.data.materials.remove(bpy.data.materials["White"])
    def rendered():
        return bool(ended)
    yield rendered
    yield 0.2
    yield picture
    out["deleted"] = dict(state(), instances=instances())
    # Undo and redo faster than pictures come.
    scene = bpy.context.scene
    with here():
        bpy.ops.ed.undo_push(message="zero")
        for k in range(3):
            scene.objects["Red"].location.z += 0.5
            bpy.ops.ed.undo_push(message=f"raised {k}")
    for k in range(12):
        yield at_work
        with here():
            bpy.ops.ed.undo() if k % 2 == 0 else bpy.ops.ed.redo()
        yield 0.05
    with here():
        bpy.ops.ed.undo()
    yield 0.2
    yield picture
    out["undone"] = dict(state(), instances=instances(),
        top=[float(v._scene.bounds()[1][2]) for v in viewport.viewports()])
""" + _END

# Changes and undos by the hundred; resident memory of Blender and bytes and objects on the GPU on the way.
_MEMORY = """
def steps():
    from gi_addon.gl import shared
    from gi_addon.host import viewport
    scene = studio()
    scene.quartet.viewport_samples = 1
    area, space, region = view()
    space.shading.type, space.region_3d.view_perspective = "RENDERED", "CAMERA"
    yield 0.3
    yield settled
    v = viewport.viewports()[0]
    def memory():
        import gc
        gc.collect()
        with open("/proc/self/statm") as file:
            rss = int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
        gl = shared().call(lambda gl: (gl.bytes(), len(gl.resources())))
        return dict(rss=rss, gl=gl[0], objects=gl[1])
    def shown():
        return not v._dirty and v._picture.request.key == v._request.key
    changes, undos = {}, {}
    box = scene.objects["White"]
    for i in range(1, {changes!r} + 1):
        box.location.x = 0.3 + 0.2 * (i % 10) / 10.0
        if i % 3 == 0:
            node = bpy.data.materials["White"].node_tree.nodes["Principled BSDF"]
            node.inputs["Roughness"].default_value = (i % 17) / 17.0
        if i % 5 == 0:
            box.data.vertices[0].co.x = -0.5 - 0.01 * (i % 4)
            box.data.update()
        if i % 7 == 0:
            bpy.data.lights["Spot"].energy = 400.0 + i % 11
        yield 0.01
        yield shown
        if i in {marks!r}:
            yield settled
            changes[i] = memory()
    # The step before is the factory's scene.
    with here():
        bpy.ops.ed.undo_push(message="built")
    for i in range(1, {undos!r} + 1):
        with here():
            if i % 2:
                bpy.data.objects["White"].location.z += 0.01
                bpy.ops.ed.undo_push(message="raised")
            else:
                bpy.ops.ed.undo()
                if i % 4 == 0:
                    bpy.ops.ed.redo()
                    bpy.ops.ed.undo()
        yield 0.01
        yield shown
        if i in {undo_marks!r}:
            yield settled
            undos[i] = memory()
    report(changes=changes, undos=undos, counts=dict(v.counts))
"""

# Squares that shine by themselves, in Quartet and in Cycles under the same view transforms.
_COLORS = """
COLORS = {colors!r}
def steps():
    from gi_addon.host.compat import node_tree
    scene = studio()
    for o in list(bpy.data.objects):
        if o.type != "CAMERA":
            bpy.data.objects.remove(o)
    camera = scene.camera
    camera.location, camera.rotation_euler = (0, 0, 10), (0, 0, 0)
    camera.data.type, camera.data.ortho_scale = "ORTHO", 8
    for i, color in enumerate(COLORS):
        bpy.ops.mesh.primitive_plane_add(size=1.2, location=(-2.2 + 2.2 * (i % 3), 1 - 2 * (i // 3), 0))
        material = bpy.data.materials.new("light")
        tree = node_tree(material)
        tree.nodes.clear()
        emission, output = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeOutputMaterial")
        tree.links.new(emission.outputs[0], output.inputs[0])
        emission.inputs[0].default_value = (*color, 1)
        bpy.context.object.data.materials.append(material)
    area, space, region = view()
    space.overlay.show_overlays = space.show_gizmo = False
    space.shading.type, space.region_3d.view_perspective = "RENDERED", "CAMERA"
    scene.cycles.preview_samples, scene.cycles.device = 2, "CPU"
    from bpy_extras.view3d_utils import location_3d_to_region_2d as place
    yield settled
    places = [place(region, space.region_3d, o.location) for o in scene.objects if o.type == "MESH"]
    places.append(place(region, space.region_3d, (0, 0, 0)))
    height = bpy.context.window_manager.windows[0].height
    points = [(round(region.x + p.x), round(height - 1 - region.y - p.y)) for p in places]
    colors = {{}}
    def all_there():
        # Every square has its colour on the screen, whoever renders it and however long it takes.
        shot({folder!r} + "/shot.png")
        image = bpy.data.images.load({folder!r} + "/shot.png")
        width, rows = image.size
        pixels = list(image.pixels)
        bpy.data.images.remove(image)
        found = [tuple(round(255 * v) for v in pixels[4 * ((rows - 1 - y) * width + x):][:3]) for x, y in points]
        colors[scene.view_settings.view_transform, scene.render.engine] = found
        return len(set(found)) == len(points)
    for transform in ("AgX", "Standard"):
        scene.view_settings.view_transform = transform
        for engine in ("QUARTET", "CYCLES"):
            scene.render.engine = engine
            yield 1.0
            if engine == "QUARTET":
                yield settled
                yield 0.3
            yield all_there
    report(colors=[[*key, found] for key, found in colors.items()])
"""


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """The report of one long session in a window with OpenGL."""
    folder = tmp_path_factory.mktemp("viewport")
    return run_window(_SESSION.replace("{shot!r}", repr(str(folder / "two.png"))), folder, size="720x500")


def sent(session, before, after):
    """Kinds of data that went to the GPU between two moments of the session."""
    kinds = ("meshes", "transforms", "materials", "images")
    return {k for k in kinds if session[after].get(f"sent {k}", 0) > session[before].get(f"sent {k}", 0)}


@pytest.mark.realblender
@pytest.mark.parametrize(
    ("change", "before", "meshes", "kinds"),
    [
        ("move", "select", 0, {"transforms"}),
        ("material", "move", 0, {"materials"}),
        ("light", "material", 0, set()),
        ("setting", "light", 0, set()),
        ("mesh", "setting", 1, {"meshes", "transforms"}),
    ],
)
def test_only_what_changed_is_read_and_sent(session, change, before, meshes, kinds):
    """Meshes read from Blender, and kinds of data sent to the GPU, after one change each."""
    assert session[change]["sync"]["meshes"] == meshes
    assert sent(session, before, change) == kinds


@pytest.mark.realblender
def test_selecting_starts_nothing_over(session):
    assert session["select"]["restarts"] == session["start"]["restarts"]
    assert session["select"]["subframes"] == session["start"]["subframes"]


@pytest.mark.realblender
def test_a_setting_shows_at_once(session):
    assert session["setting"]["restarts"] == session["light"]["restarts"] + 1


@pytest.mark.realblender
def test_resizing_touches_targets_only(session):
    before, after = session["object mode"], session["resize"]
    assert after["size"] != before["size"]
    assert after["reads"] == before["reads"] and not sent(session, "object mode", "resize")


@pytest.mark.realblender
def test_the_viewport_shows_what_the_space_shows(session):
    """Hidden objects, local view, edit mode and the render border count."""
    assert session["hide"]["instances"] == [2] and session["unhide"]["instances"] == [3]
    assert session["local view"]["instances"] == [1]
    assert session["edit mode"]["instances"] == [3] and session["edited to"] < -6.0
    x, y, width, height = session["border"]["border"]
    assert x > 0 and y > 0 and width < session["border"]["size"][0] / 2 and height < session["border"]["size"][1] / 2


@pytest.mark.realblender
def test_nothing_stale_stays_after_undo_and_deletion(session):
    assert session["raised to"] > 2.5 and session["undone to"] < session["raised to"] - 0.5
    assert set(session["delete"]["instances"]) == {2}


@pytest.mark.realblender
def test_two_viewports_and_a_final_render_live_together(session):
    assert session["two viewports"]["viewports"] == 2
    assert session["final render meanwhile"]["viewports"] == 2


@pytest.mark.realblender
def test_memory_stays_flat_and_is_given_back(session):
    """25 changes allocate nothing that stays; another engine, another file and unregistering free all."""
    assert session["grown"] == 0
    for after in ("other engine", "new file"):
        assert session[after] == {"viewports": 0, "bytes": 0}
    assert session["default cube"] == 1 and session["unregistered"] == 0


@pytest.fixture(scope="module")
def haste(tmp_path_factory):
    """The report of a session whose user never waits."""
    folder = tmp_path_factory.mktemp("haste")
    return run_window(_HASTE.replace("{folder!r}", repr(str(folder))), folder, size="640x440")


@pytest.mark.realblender
def test_opening_a_file_while_the_viewport_renders_shows_that_file(haste):
    assert haste["file opened"]["viewports"] == 1 and haste["file opened"]["instances"] == [3]
    assert not haste["file opened"]["problem"]


@pytest.mark.realblender
def test_engines_and_editors_switched_while_it_renders_free_everything(haste):
    """Five switches within half a second, and a viewport that becomes an Image Editor, both amid sub-frames."""
    for after in ("engines switched", "another editor"):
        assert haste[after]["viewports"] == haste[after]["bytes"] == 0, (after, haste[after])


@pytest.mark.realblender
def test_deleting_what_two_viewports_and_a_final_render_show(haste):
    """Object, mesh and material go while all three are at it; both viewports show the two boxes that are left."""
    assert haste["deleted"]["instances"] == [2, 2] and not haste["deleted"]["problem"]


@pytest.mark.realblender
def test_undo_and_redo_faster_than_pictures_end_in_the_right_one(haste):
    """Three times raised by .5, undone and redone six times, undone once: 2 + 2 · .5 high, in both viewports."""
    assert haste["undone"]["top"] == pytest.approx([3.0, 3.0], abs=1e-5)
    assert haste["unregistered"] == 0


def memory_session(folder, changes: int, undos: int, marks: int) -> dict:
    """Memory after each of ``marks`` equal parts of so many changes, and undos."""
    steps = _MEMORY.replace("{changes!r}", repr(changes)).replace("{undos!r}", repr(undos))
    steps = steps.replace("{marks!r}", repr({changes * k // marks for k in range(1, marks + 1)} | {min(20, changes)}))
    steps = steps.replace("{undo_marks!r}", repr({undos * k // marks for k in range(1, marks + 1)}))
    return run_window(steps, folder, size="320x240", timeout=3000)


@pytest.mark.slow
@pytest.mark.realblender
def test_memory_is_flat_over_1000_changes_and_100_undos(tmp_path):
    """Nothing is left on the GPU, to the byte; Blender's process grows by less than 8 MB, of which Blender's own share under
    Workbench is 5 (docs/blender.md)."""
    answer = memory_session(tmp_path, 1000, 100, 5)
    for kind in ("changes", "undos"):
        rows = list(answer[kind].values())
        print(kind, {k: (round(v["rss"] / 1e6, 1), v["gl"], v["objects"]) for k, v in answer[kind].items()})
        assert len({row["gl"] for row in rows}) == 1 and len({row["objects"] for row in rows}) == 1
        assert rows[-1]["rss"] - rows[0]["rss"] < 8e6


@pytest.mark.realblender
@pytest.mark.parametrize("backend", ["opengl", "vulkan"])
def test_colours_are_cycles_own(tmp_path, backend):
    """What shines with a known radiance has Cycles' colour on the screen, for two view transforms: within 1 of 255, the
    rounding of half floats and of the display."""
    script = _COLORS.format(colors=SQUARES, folder=str(tmp_path))
    answer = run_window(script, tmp_path, "--gpu-backend", backend, size="720x500")
    colors = {(transform, engine): np.array(found) for transform, engine, found in answer["colors"]}
    for transform in ("AgX", "Standard"):
        ours, theirs = colors[transform, "QUARTET"], colors[transform, "CYCLES"]
        assert np.abs(ours - theirs).max() <= 1, f"{transform}: {ours.tolist()} {theirs.tolist()}"


# --- without a window -------------------------------------------------------------------------------------------------


def _free_view(view_matrix, window_matrix, perspective="ORTHO"):
    return types.SimpleNamespace(view_matrix=view_matrix, window_matrix=window_matrix, view_perspective=perspective)


@pytest.mark.blender
def test_a_free_orthographic_view_steps_back_until_nothing_is_behind_it(blender):
    """Blender puts the eye of such a view in the middle of things. Stepping back by s moves every depth by s and no
    point's place on the screen."""
    from gi_addon.host.viewport import view_camera

    scene = scenes.cornell()
    near, far = -1000.0, 1000.0
    window = np.diag([0.2, 0.3, -2.0 / (far - near), 1.0])
    window[2, 3] = -(far + near) / (far - near)
    camera = view_camera(_free_view(np.eye(4), window), scene, (64, 36))
    corners = scene.bounds()
    depth = camera.world_from_view[2, 3] - corners[:, 2]
    assert depth.min() > 0.0 and 0.0 < camera.clip_start < depth.min() < depth.max() < camera.clip_end
    for point in corners:
        old = window @ np.append(point, 1.0)
        new = camera.clip_from_view @ np.linalg.inv(camera.world_from_view) @ np.append(point, 1.0)
        assert new[:2] == pytest.approx(old[:2]) and new[2] == pytest.approx(old[2], abs=1e-9)


@pytest.mark.blender
def test_a_perspective_view_keeps_its_clip_planes(blender):
    from gi_addon.host.viewport import view_camera

    near, far = 0.05, 200.0
    window = np.diag([1.5, 2.0, -(far + near) / (far - near), 0.0])
    window[2, 3], window[3, 2] = -2.0 * far * near / (far - near), -1.0
    camera = view_camera(_free_view(np.eye(4), window, "PERSP"), scenes.cornell(), (64, 36))
    assert (camera.clip_start, camera.clip_end) == (pytest.approx(near), pytest.approx(far, rel=1e-4))


@pytest.mark.blender
@pytest.mark.parametrize("technique", ["RSM", "LPV", "VCT", "SSDO"])
def test_a_coarse_picture_makes_no_map_of_the_full_one_again(blender, gl, technique):
    """Passes that run only when stale: none of them runs again when the full resolution follows the coarse picture."""
    from gi_addon.host.viewport import coarse

    scene, settings = scenes.cornell(), Settings()
    settings.technique, settings.bounces, settings.samples = technique, 2, 2
    settings.lpv.resolution, settings.vct.resolution, settings.rsm.resolution = 16, 32, 64
    less = coarse(settings, 4)
    assert coarse(settings, 1) == settings and less.world.rays == settings.world.rays // 4
    assert less.rsm.samples == settings.rsm.samples and less.ssdo.samples == settings.ssdo.samples // 4

    def job(context):
        renderer = Renderer(context)
        try:
            renderer.timers.enabled = True
            renderer.begin(scene, less, resolution=(16, 9))
            renderer.subframe(0)
            renderer.timers.reset()
            plan = renderer.begin(scene, settings, resolution=(64, 36))
            renderer.subframe(0)
            static = {p.title for p in plan.run if p.task.rate(plan.facts) == "static"}
            return static, static & set(renderer.timers.collect())
        finally:
            renderer.close()

    static, again = gl(job)
    assert static and not again


@pytest.mark.blender
def test_the_full_resolution_waits_until_the_coarse_picture_has_been_seen(blender):
    """A coarse picture that took a second comes long after its change: the full one still waits .15 s more, so that the next
    change of a drag does not find the GL thread in a long pass."""
    from gi_addon.host import viewport

    class Engine:
        pass

    engine, now = Engine(), time.monotonic()
    view = viewport.Viewport(engine)
    try:
        request = viewport.Request(("key",), None, Settings(), None, (64, 36), (0, 0, 64, 36), False, scale=4)
        view._request, view._changed, view._pictured = request, now - 1.0, now
        view._picture = viewport.Picture(request, 1, np.zeros((9, 16, 4), "f4"), 0.9, None)
        assert not view._due()
        view._pictured = now - 0.2
        assert view._due()
    finally:
        viewport._live.discard(view)


def test_a_sub_frame_given_up_half_way_leaves_no_stale_maps(gl):
    """Cancelled after the first pass, then rendered: the same picture as without."""
    scene = scenes.cornell()
    expected = make(scene, samples=1, resolution=(48, 27)).passes["Combined"]

    class AfterOnePass(CancelToken):
        asked = 0

        @property
        def cancelled(self):
            self.asked += 1
            return self.asked > 3

    def job(context):
        renderer = Renderer(context)
        try:
            settings = Settings()
            settings.samples = 1
            renderer.begin(scene, settings, resolution=(48, 27))
            with pytest.raises(Cancelled):
                renderer.subframe(0, AfterOnePass())
            renderer.begin(scene, settings, resolution=(48, 27))
            renderer.subframe(0)
            return renderer.film()["combined"]
        finally:
            renderer.close()

    assert np.array_equal(gl(job), expected)
