# SPDX-License-Identifier: GPL-3.0-or-later
"""LPV on scenes made by code against one bounce of Cycles, pass by pass: the numbers of docs/techniques/lpv.md.

``.venv/bin/python scripts/score_lpv.py --cases blocks,fog --sweep lpv.resolution=16,32 --times`` prints a line per case, setting
and pass, gain and errors, and with ``--times`` what each of LPV's passes cost. ``--snapshot FILE.npz`` (``quartet snapshot``)
gives these times of any scene, in place of the cases.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
SIZE = (96, 54)


def emissive_box():
    """A closed-off Cornell box that one glowing block lights."""
    from gi_addon.compare import scenes

    scene = scenes.cornell(blocks=False)
    scene.lights = []
    b = scenes.SceneBuilder("emissive-box")
    sides = scenes.box_quads((-1, -1, 0), (1, 1, 2), inward=True)
    b.quads(sides[[3, 4, 5]], scenes.diffuse(scenes.WHITE, "White"))
    b.quads(sides[[0]], scenes.diffuse(scenes.RED, "Red"))
    b.quads(sides[[1]], scenes.diffuse(scenes.GREEN, "Green"))
    b.quads(scenes.box_quads((-0.3, -0.2, 0.7), (0.3, 0.4, 1.3)), scenes.emissive((1.0, 0.8, 0.6), 5.0, "Glow"))
    return b.build(scene.camera)


def cases() -> dict[str, tuple]:
    """Name -> (scene, passes compared)."""
    from gi_addon.compare import scenes

    fog = scenes.cornell()
    fog.world = scenes.fog(0.4)
    surfaces = ("Diffuse Direct", "Diffuse Indirect", "Ambient Occlusion", "Combined")
    return {
        "empty": (scenes.cornell(blocks=False), ("Diffuse Indirect",)),
        "empty-area": (scenes.cornell(blocks=False, light="area"), ("Diffuse Indirect",)),
        "blocks": (scenes.cornell(), surfaces),
        "blocks-area": (scenes.cornell(light="area"), surfaces),
        "glowing": (emissive_box(), ("Combined",)),
        "fog": (fog, ("Volume Direct", "Volume Indirect", "Diffuse Indirect", "Combined")),
        **{name: (scenes.effect(name), passes) for name, passes in (
            ("glossy", ("Glossy Indirect",)), ("translucency", ("Combined",)), ("area_lights", ("Combined",)))},
    }  # fmt: skip


def reference(scene, names, samples: int, seed: int):
    """Passes of one diffuse bounce by Cycles: name -> (H, W, 3). In fog exactly one event follows the first, as with LPV's."""
    from gi_addon.host import build, cycles

    made = build.build(scene)
    made.render.resolution_x, made.render.resolution_y, made.render.resolution_percentage = *SIZE, 100
    cycles.set_up(made, cycles.Reference(1, samples, seed))
    if "Volume Indirect" in names:
        made.cycles.max_bounces = 1
    return {name: image[..., :3] for name, image in cycles.render_passes(made, names).items()}


def print_times(result) -> None:
    """A line per pass that was timed."""
    for title, spent in result.milliseconds.items():
        print(f"    {title}: {sum(spent):.0f} ms in {len(spent)} runs", flush=True)


def main() -> None:
    import bpy  # noqa: F401 — before the add-on

    import gi_addon
    from gi_addon.compare.metrics import score
    from gi_addon.compare.sheet import comparison
    from gi_addon.compare.studio import Studio, settings_for
    from gi_addon.scene import Scene

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", default="empty,empty-area,blocks-area,glowing")
    parser.add_argument("--samples", type=int, default=256, help="of each half of the reference")
    parser.add_argument("--sweep", default="lpv.resolution=32", help="a setting and its values")
    parser.add_argument("--times", action="store_true")
    parser.add_argument("--snapshot", help="a snapshot whose passes are timed, at 256 × 144 in 4 sub-frames")
    parser.add_argument("-o", "--output")
    arguments = parser.parse_args()
    if arguments.snapshot:
        with Studio() as studio:
            scene = Scene.load(arguments.snapshot)
            result = studio.render(scene, settings_for("LPV"), ("Combined",), (256, 144), subframes=4, timed=True)
        print(f"{arguments.snapshot}: {result.seconds:.1f} s")
        print_times(result)
        return
    gi_addon.register()
    path, _, values = arguments.sweep.partition("=")
    found, rows = cases(), []
    for case in arguments.cases.split(","):
        scene, names = found[case]
        a, b = (reference(scene, names, arguments.samples, seed) for seed in (1, 2))
        for value in (int(v) for v in values.split(",")):
            with Studio() as studio:
                settings = settings_for("LPV", **{path.replace(".", "__"): value})
                result = studio.render(scene, settings, names, SIZE, subframes=8, timed=arguments.times)
            for name in names:
                found_score = score(result.passes[name][..., :3], a[name], b[name])
                print(f"{case}, {path} {value}, {name}: {found_score.text()}, {result.seconds:.1f} s", flush=True)
            print_times(result)
        rows += [(f"{case} {name}", result.passes[name][..., :3], (a[name] + b[name]) / 2) for name in names]
    if arguments.output:
        comparison(arguments.output, rows, ("LPV", "Cycles R1"))
    gi_addon.unregister()


if __name__ == "__main__":
    main()
