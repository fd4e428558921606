#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Change one thing after the other in a rendered viewport of the real Blender, and print what each change costs.

    .venv/bin/python scripts/update_matrix.py SCENE.blend [--technique RSM] [--backend opengl] [--screenshots FOLDER]

One line a change: milliseconds of reading on Blender's thread, what was read and sent to the GPU, which maps and volumes were
made again, and the time to the first picture. Screenshots show each state. Needs the real Blender that the tests drive.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "tests"), str(ROOT)]

_STEPS = """
def steps():
    from gi_addon.host import viewport
    from gi_addon.host.compat import node_tree
    bpy.ops.wm.open_mainfile(filepath={scene!r}, load_ui=False)
    yield 0.5
    scene = bpy.context.scene
    for old in [o for o in bpy.data.objects if o.name.startswith("Matrix ")]:
        bpy.data.objects.remove(old)
    manager = bpy.context.window_manager
    window, (area, space, region) = manager.windows[0], view()
    def here():
        return bpy.context.temp_override(window=window, area=area, region=region)
    # Something small beside what the file has, where the camera sees it.
    place = scene.camera.matrix_world @ __import__("mathutils").Vector((0.0, 0.0, -3.0))
    with here():
        bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4, radius=0.3, location=place)
    ball = bpy.context.object
    ball.name = "Matrix Ball"
    paint = bpy.data.materials.new("Matrix Paint")
    node_tree(paint)
    ball.data.materials.append(paint)
    light = next((o for o in scene.objects if o.type == "LIGHT"), None)
    big = max((o for o in scene.objects if o.type == "MESH" and o is not ball), key=lambda o: len(o.data.polygons))
    scene.render.engine = "QUARTET"
    scene.quartet.technique, scene.quartet.viewport_samples = {technique!r}, 1
    manager.quartet.measure = True
    space.shading.type, space.region_3d.view_perspective = "RENDERED", "CAMERA"
    yield settled
    v = viewport.viewports()[0]
    read, rows, seconds = v._sync.read, [], []
    def timed(*args, **kwargs):
        start = time.perf_counter()
        try:
            return read(*args, **kwargs)
        finally:
            seconds.append(time.perf_counter() - start)
    v._sync.read = timed
    def changed(name, change):
        before, shown, redone = dict(v.counts), v._picture, v._request
        seconds.clear()
        start = time.perf_counter()
        change()
        def noticed():
            return v._request is not redone or v.counts["reads"] > before.get("reads", 0) or time.perf_counter() - start > 3.0
        yield noticed
        restarted = v._request is not redone
        row = dict(change=name, read=1e3 * sum(seconds), reads=len(seconds), sync=dict(v._sync.counts) if seconds else dict(),
                   restarted=restarted)
        if restarted:
            def pictured():
                return v._picture is not shown
            yield pictured
            picture = v._picture
            row.update(first=1e3 * (time.perf_counter() - start), sent=sorted(picture.sent), scale=picture.request.scale,
                       made=[r.title for r in picture.report.rows if r.rate == "static" and r.milliseconds is not None],
                       passes=sum(r.milliseconds or 0.0 for r in picture.report.rows))
        rows.append(row)
        yield settled
        yield 0.2
        if {folder!r}:
            shot({folder!r} + "/" + name.replace(" ", "-") + ".png")
    def select():
        ball.select_set(not ball.select_get())
    def move(o, x):
        def change():
            o.location.x += x
        return change
    def color():
        paint.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0.9, 0.1, 0.05, 1.0)
    def power():
        light.data.energy *= 0.5
    def world():
        node_tree(scene.world).nodes["Background"].inputs["Strength"].default_value *= 2.0
    def edit(o):
        def change():
            o.data.vertices[0].co.z += 0.05
            o.data.update()
        return change
    def hide():
        ball.hide_set(not ball.hide_get())
    def setting():
        scene.quartet.bounces += 1
    def turn():
        scene.camera.rotation_euler.z += 0.05
    def pushed(change):
        def both():
            with here():
                bpy.ops.ed.undo_push(message="before")
                change()
                bpy.ops.ed.undo_push(message="after")
        return both
    def undo():
        with here():
            bpy.ops.ed.undo()
    def redo():
        with here():
            bpy.ops.ed.redo()
    yield from changed("selection", select)
    yield from changed("camera turned", turn)
    yield from changed("object moved", move(ball, 0.2))
    yield from changed("material", color)
    if light:
        yield from changed("light power", power)
        yield from changed("light moved", move(light, 0.1) if light.data.type != "SUN" else lambda: setattr(
            light, "rotation_euler", [light.rotation_euler.x + 0.05, *light.rotation_euler[1:]]))
    if scene.world and "Background" in node_tree(scene.world).nodes:
        yield from changed("world", world)
    yield from changed("small mesh edited", edit(ball))
    yield from changed("large mesh edited", edit(big))
    yield from changed("object hidden", hide)
    yield from changed("object shown", hide)
    yield from changed("setting", setting)
    name = ball.name
    yield from changed("moved again", pushed(move(ball, 0.4)))
    yield from changed("undo", undo)
    yield from changed("redo", redo)
    def delete():
        bpy.data.objects.remove(bpy.data.objects[name])
    yield from changed("object deleted", delete)
    report(rows=rows, size=list(v._request.size), triangles=v._scene.triangle_count(),
           materials=len(v._scene.materials), images=len(v._scene.images))
"""


def line(row: dict) -> str:
    """A change as a line of the table."""
    sync = row["sync"]
    read = f"{row['read']:.0f}" if row["reads"] else "–"
    what = f"{sync.get('meshes', 0)}, {sync.get('materials', 0)}" if sync else "nothing"
    if not row["restarted"]:
        return f"| {row['change']} | {read} | {what} | nothing | nothing restarts | – | – |"
    made = ", ".join(row["made"]) or "nothing"
    sent = ", ".join(row["sent"]) or "nothing"
    return f"| {row['change']} | {read} | {what} | {sent} | {made} | {row['passes']:.0f} | {row['first']:.0f} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=Path)
    parser.add_argument("--technique", default="RSM")
    parser.add_argument("--backend", default="opengl", choices=("opengl", "vulkan"))
    parser.add_argument("--size", default="640x440", help="of the window")
    parser.add_argument("--screenshots", type=Path, help="folder for a screenshot after each change")
    options = parser.parse_args()
    from real_blender import run_window

    if options.screenshots:
        options.screenshots.mkdir(parents=True, exist_ok=True)
    steps = _STEPS
    folder = str(options.screenshots.resolve()) if options.screenshots else ""
    with tempfile.TemporaryDirectory(prefix="quartet-") as scratch:
        # A copy: that Blender has a root of its own, in which not every folder is.
        scene = shutil.copy(options.scene, scratch)
        for key, value in (("scene", scene), ("technique", options.technique), ("folder", folder)):
            steps = steps.replace(f"{{{key}!r}}", repr(value))
        answer = run_window(steps, Path(scratch), "--gpu-backend", options.backend, size=options.size, timeout=1800)
    print(f"{options.scene.name}: {answer['triangles']} triangles, {answer['materials']} materials, {answer['images']} images; "
          f"viewport {answer['size'][0]} × {answer['size'][1]}, {options.technique}, {options.backend}\n")  # fmt: skip
    print("| change | read (ms) | meshes, materials read | sent to the GPU | made again | passes (ms) | first picture (ms) |")
    print("| --- | ---: | --- | --- | --- | ---: | ---: |")
    for row in answer["rows"]:
        print(line(row))


if __name__ == "__main__":
    main()
