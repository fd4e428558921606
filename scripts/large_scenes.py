# SPDX-License-Identifier: GPL-3.0-or-later
"""What large scenes cost: 64 lamps, a mesh of 5 million triangles, 10,000 instances; sync and sub-frame times, GPU memory.

``python scripts/large_scenes.py --technique RSM --resolution 320x180 --only lamps,mesh,instances``

Every scene is made in Blender, so that sync is Blender's. The second sub-frame is timed alone: the first one also compiles.
"""

from __future__ import annotations

import argparse
import resource
import sys
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))


def lamps(bpy, scene) -> None:
    """64 lamps, points and soft spots by turns, over a plane with cubes."""
    for i in range(64):
        data = bpy.data.lights.new("lamp", "SPOT" if i % 2 else "POINT")
        data.energy, data.shadow_soft_size = 60.0, 0.1 * (i % 2)
        lamp = bpy.data.objects.new("lamp", data)
        lamp.location = (i % 8 * 2.0 - 7.0, i // 8 * 2.0 - 7.0, 2.5)
        scene.collection.objects.link(lamp)
    for i in range(25):
        bpy.ops.mesh.primitive_cube_add(size=1.0, location=(i % 5 * 3.0 - 6.0, i // 5 * 3.0 - 6.0, 0.5))


def mesh(bpy, scene) -> None:
    """A rippled grid of 1,582² quads, 5 million triangles."""
    n = 1583
    x, y = np.meshgrid(np.linspace(-8.0, 8.0, n), np.linspace(-8.0, 8.0, n))
    points = np.stack([x, y, 0.3 + 0.2 * np.sin(3.0 * x) * np.cos(3.0 * y)], axis=-1).astype("f4")
    first = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).reshape(-1, 1)
    quads = (first + np.array([0, 1, n + 1, n])).astype("i4")
    data = bpy.data.meshes.new("ripples")
    data.vertices.add(n * n)
    data.vertices.foreach_set("co", points.ravel())
    data.loops.add(quads.size)
    data.loops.foreach_set("vertex_index", quads.ravel())
    data.polygons.add(len(quads))
    data.polygons.foreach_set("loop_start", np.arange(0, quads.size, 4, dtype="i4"))
    data.update(calc_edges=True)
    scene.collection.objects.link(bpy.data.objects.new("ripples", data))


def instances(bpy, scene) -> None:
    """10,000 objects that share one ball's mesh."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8, radius=0.06)
    ball = bpy.context.object
    for i in range(10_000):
        copy = bpy.data.objects.new("ball", ball.data)
        copy.location = (i % 100 * 0.16 - 8.0, i // 100 * 0.16 - 8.0, 0.1 + 0.3 * (i * 0.618 % 1.0))
        scene.collection.objects.link(copy)


SCENES = {"lamps": lamps, "mesh": mesh, "instances": instances}


def empty(bpy):
    """A plane under a sun and a sky, and a camera."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("sky")
    bpy.ops.mesh.primitive_plane_add(size=18.0)
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.rotation_euler = (0.6, 0.3, 0.0)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location, camera.rotation_euler = (0.0, -12.0, 7.0), (1.05, 0.0, 0.0)
    for obj in (sun, camera):
        scene.collection.objects.link(obj)
    scene.camera = camera
    return scene


def main() -> None:
    import bpy

    import gi_addon
    from gi_addon.gl import shared
    from gi_addon.host.sync import SceneSync
    from gi_addon.renderer import Renderer
    from gi_addon.settings import Settings

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--technique", default="RSM")
    parser.add_argument("--resolution", default="320x180")
    parser.add_argument("--only", default=",".join(SCENES))
    arguments = parser.parse_args()
    size = tuple(int(v) for v in arguments.resolution.split("x"))
    gi_addon.register()
    for name in arguments.only.split(","):
        scene = empty(bpy)
        SCENES[name](bpy, scene)
        depsgraph = bpy.context.evaluated_depsgraph_get()
        sync, times = SceneSync(), []
        for _ in range(2):  # all anew, then nothing changed
            start = time.perf_counter()
            plain = sync.read(depsgraph, resolution=size)
            times.append(time.perf_counter() - start)
        settings = Settings()
        settings.set("technique", arguments.technique)

        def job(gl, plain=plain, settings=settings):
            renderer, seconds = Renderer(gl), []
            for samples in (1, 1, 4):
                settings.samples = samples
                start = time.perf_counter()
                renderer.render(plain, settings, ("Combined",), resolution=size)
                seconds.append((time.perf_counter() - start) / samples)
            mib = gl.bytes() / 2**20
            renderer.close()
            return seconds, mib

        seconds, mib = shared().call(job)
        rss = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
        print(f"{name:10s} {plain.triangle_count():,} triangles, {len(plain.instances):,} instances, {len(plain.lights)} lamps: "
              f"sync {times[0]:.2f} s, again {times[1]:.2f} s; first picture {seconds[0]:.1f} s, again {seconds[1]:.2f} s, "
              f"a sub-frame of 4 {seconds[2]:.2f} s; GL {mib:.0f} MiB, process {rss:.0f} MiB", flush=True)  # fmt: skip
    gi_addon.unregister()


if __name__ == "__main__":
    main()
