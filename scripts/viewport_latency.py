#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""How soon the viewport of the real Blender shows a change, Quartet's and EEVEE's in turns in one window.

    .venv/bin/python scripts/viewport_latency.py [SCENE.blend] [--technique RSM] [--rounds 2] [--changes 5] [--where]

Without a file: 20 objects of six materials on a floor under a spot, an area light and a grey sky. Times are from the change to
the end of drawing with the new picture in it, one pixel read back so that a driver which puts work off has done it.
``--where`` prints what Quartet's first pictures spent their time on. Needs the real Blender that the tests drive.
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
def twenty():
    # Rows of spheres, boxes and tori over a floor: 20 objects, six materials.
    from gi_addon.host.compat import node_tree
    scene = studio()
    bpy.data.objects.remove(bpy.data.objects["Red"])
    paints = []
    for k in range(6):
        paint = bpy.data.materials.new(f"Paint {k}")
        node = node_tree(paint).nodes["Principled BSDF"]
        node.inputs["Base Color"].default_value = (0.2 + 0.12 * k, 0.8 - 0.1 * k, 0.3 + 0.1 * (k % 3), 1.0)
        node.inputs["Roughness"].default_value = 0.2 + 0.15 * k
        paints.append(paint)
    for k in range(18):
        at = (-2.5 + k % 6, -1.5 + 1.3 * (k // 6), 0.4)
        if k % 3 == 0:
            bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16, radius=0.35, location=at)
        elif k % 3 == 1:
            bpy.ops.mesh.primitive_cube_add(size=0.6, location=at)
        else:
            bpy.ops.mesh.primitive_torus_add(major_radius=0.3, minor_radius=0.1, location=at)
        bpy.context.object.data.materials.append(paints[k % 6])
    area = bpy.data.objects.new("Area", bpy.data.lights.new("Area", "AREA"))
    area.data.energy, area.data.size, area.location = 100.0, 1.5, (-2.0, -1.0, 4.0)
    scene.collection.objects.link(area)
    return scene

def steps():
    from gi_addon.host import viewport
    if {scene!r}:
        bpy.ops.wm.open_mainfile(filepath={scene!r}, load_ui=False)
        yield 0.5
        scene = bpy.context.scene
    else:
        scene = twenty()
    area, space, region = view()
    window = bpy.context.window_manager.windows[0]
    if {scene!r}:
        place = scene.camera.matrix_world @ __import__("mathutils").Vector((0.0, 0.0, -3.0))
        with bpy.context.temp_override(window=window, area=area, region=region):
            bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4, radius=0.3, location=place)
        ball = bpy.context.object
    else:
        ball = scene.objects["White"]
    name = ball.name
    lamp = next(o.name for o in scene.objects if o.type == "LIGHT")
    scene.quartet.technique = {technique!r}
    bpy.context.window_manager.quartet.measure = {where!r}
    space.overlay.show_overlays = space.show_gizmo = False
    space.region_3d.view_perspective = "CAMERA"
    scene.quartet.viewport_samples = scene.eevee.taa_samples = {samples!r}
    drawn = []
    def after():
        # POST_PIXEL: the engine has drawn this region. Reading a pixel makes the driver finish.
        import gpu
        gpu.state.active_framebuffer_get().read_color(0, 0, 1, 1, 4, 0, "UBYTE")
        shown = True
        if scene.render.engine == "QUARTET":
            v = viewport.viewports()[0] if viewport.viewports() else None
            shown = v is not None and v._picture is not None and v._request is not None
            shown = shown and v._picture.request.key == v._request.key
        drawn.append((time.perf_counter(), shown))
    bpy.types.SpaceView3D.draw_handler_add(after, (), "WINDOW", "POST_PIXEL")
    answers, details = [], []
    def wait(start, engine, first, steady, drag):
        # Until the picture is there, and then until the engine has drawn all its sub-frames.
        def pictured():
            return any(shown and at > start for at, shown in drawn)
        yield pictured
        row = [engine, first, next(at for at, shown in drawn if shown and at > start) - start, None]
        if engine == "QUARTET" and {where!r}:
            p = viewport.viewports()[0]._picture
            details.append(dict(kind=first, scale=p.request.scale, total=1e3 * row[2], work=1e3 * p.report.seconds,
                                sent=sorted(p.sent), passes=[(r.title, r.milliseconds) for r in p.report.rows if r.milliseconds]))
        answers.append(row)
        if drag:
            return
        # Eevee redraws by itself until its samples are done; both are quiet for a while then.
        def quiet():
            return time.perf_counter() - drawn[-1][0] > {quiet!r} and (engine != "QUARTET" or settled())
        yield quiet
        if steady:
            row[3] = drawn[-1][0] - start - row[2]
    def changed(engine, kind, change, steady=False, drag=False):
        drawn.clear()
        start = time.perf_counter()
        change()
        yield from wait(start, engine, kind, steady, drag)
    def move():
        scene.objects[name].location.x += 0.05
    def move_lamp():
        lamp_object = scene.objects[lamp]
        if lamp_object.data.type == "SUN":
            lamp_object.rotation_euler.x += 0.02
        else:
            lamp_object.location.x += 0.05
    def turn():
        scene.camera.rotation_euler.z += 0.01
    eevee = "BLENDER_EEVEE_NEXT" if bpy.app.version < (5, 0, 0) else "BLENDER_EEVEE"
    def choose(engine):
        def change():
            scene.render.engine = engine
            space.shading.type = "RENDERED"
        return change
    for turn_number in range({rounds!r}):
        for engine in ("QUARTET", eevee):
            space.shading.type = "SOLID"
            yield 0.5
            yield from changed(engine, "rendered chosen", choose(engine), True)
            for kind, change in (("object", move), ("light", move_lamp), ("camera", turn)):
                yield from changed(engine, kind + " moved", change, kind == "object")
                # The next change comes as soon as the last one is seen, as while something is dragged.
                for k in range({changes!r}):
                    yield from changed(engine, kind + " dragged", change, drag=k < {changes!r} - 1)
    report(answers=answers, details=details, size=[region.width, region.height], load=os.getloadavg()[0])
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=Path, nargs="?")
    parser.add_argument("--technique", default="RSM")
    parser.add_argument("--backend", default="opengl", choices=("opengl", "vulkan"))
    parser.add_argument("--size", default="640x440", help="of the window")
    parser.add_argument("--samples", type=int, default=8, help="sub-frames of both engines' viewports")
    parser.add_argument("--rounds", type=int, default=2, help="how often each engine is chosen")
    parser.add_argument("--changes", type=int, default=5, help="of each kind, in each round")
    parser.add_argument("--quiet", type=float, default=1.0, help="seconds without drawing after which an engine is done")
    parser.add_argument("--where", action="store_true", help="time Quartet's passes, which makes it a little slower")
    options = parser.parse_args()
    import numpy as np
    from real_blender import run_window

    with tempfile.TemporaryDirectory(prefix="quartet-") as scratch:
        # A copy: that Blender has a root of its own, in which not every folder is.
        scene = shutil.copy(options.scene, scratch) if options.scene else ""
        steps = _STEPS
        for key in ("technique", "samples", "rounds", "changes", "quiet", "where"):
            steps = steps.replace(f"{{{key}!r}}", repr(getattr(options, key)))
        steps = steps.replace("{scene!r}", repr(scene))
        answer = run_window(steps, Path(scratch), "--gpu-backend", options.backend, size=options.size, timeout=3000)
    print(f"viewport {answer['size'][0]} × {answer['size'][1]}, {options.technique}, {options.backend}, "
          f"load {answer['load']:.1f}; medians (all) in ms\n")  # fmt: skip
    print("| | Quartet | EEVEE | Quartet / EEVEE |\n| --- | ---: | ---: | ---: |")
    kinds = list(dict.fromkeys(kind for _, kind, _, _ in answer["answers"]))
    for kind in kinds:
        line(kind, [(e, 1e3 * t) for e, k, t, _ in answer["answers"] if k == kind], np)
    # Quartet begins again at the full resolution once nothing changes.
    steady = [(e, 1e3 * t) for e, _, _, t in answer["answers"] if t is not None]
    line(f"from the first to the last of {options.samples} sub-frames", steady, np)
    for detail in answer["details"]:
        passes = ", ".join(f"{title} {ms:.1f}" for title, ms in sorted(detail["passes"], key=lambda p: -p[1])[:12])
        print(f"{detail['kind']}, 1/{detail['scale']} a side: {detail['total']:.0f} ms, on the GL thread {detail['work']:.0f} "
              f"(passes {sum(ms for _, ms in detail['passes']):.0f}); sent {', '.join(detail['sent']) or 'nothing'}: {passes}")


def line(kind: str, times: list[tuple[str, float]], np) -> None:
    """One line of the table: both engines' medians, all times, and the ratio."""
    ours = [t for e, t in times if e == "QUARTET"]
    theirs = [t for e, t in times if e != "QUARTET"]
    cells = [f"{np.median(t):.0f} ({', '.join(f'{v:.0f}' for v in t)})" for t in (ours, theirs)]
    print(f"| {kind} | {cells[0]} | {cells[1]} | {np.median(ours) / np.median(theirs):.2f} |")


if __name__ == "__main__":
    main()
