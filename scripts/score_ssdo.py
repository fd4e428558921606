# SPDX-License-Identifier: GPL-3.0-or-later
"""SSDO on scenes made by code against one bounce of Cycles: the numbers of docs/techniques/ssdo.md.

``.venv/bin/python scripts/score_ssdo.py indirect mirrors occlusion translucency`` prints tables; ``-o FOLDER`` writes sheets.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
SIZE = (96, 54)
FLOOR = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], "f4")


def aimed_box(*, blocks: bool, eye, target):
    """The Cornell box with its light at ``eye``, on what the camera sees."""
    from gi_addon.compare import scenes

    scene = scenes.cornell(blocks=blocks)
    scene.lights = [scenes.spot_light(eye, target, 80.0, 0.9, 0.3)]
    return scene


def courtyard():
    """Two boxes between walls under a sun; the picture cuts floor and walls."""
    from gi_addon.compare import scenes

    b = scenes.SceneBuilder("courtyard")
    b.quads(np.concatenate([FLOOR[None] * 3, scenes.box_quads((-3, -3, -0.01), (3, 3, 1.5), inward=True)[[0, 1, 3]]]),
            scenes.diffuse((0.6, 0.55, 0.5)))  # fmt: skip
    b.quads(scenes.box_quads((-1.4, 0.2, 0), (-0.5, 1.0, 1.0)), scenes.diffuse((0.7, 0.2, 0.1)))
    b.quads(scenes.box_quads((0.4, -0.4, 0), (1.2, 0.5, 0.6)), scenes.diffuse((0.2, 0.5, 0.7)))
    b.light(scenes.sun_light((0.4, 0.7, -1), 4.0))
    return b.build(scenes.perspective((0, -4.5, 2.6), (0, 0.6, 0.3), 0.8))


def mirror_room(roughness: float):
    """Two boxes on a metal floor before a wall: what the floor reflects is in the picture."""
    from gi_addon.compare import scenes

    b = scenes.SceneBuilder("mirror-room")
    b.quads(FLOOR[None] * 1.5, scenes.principled(Metallic=1.0, Roughness=roughness, Base_Color=(0.9, 0.9, 0.9, 1)))
    b.quads(np.array([[[-1.5, 1.5, 0], [1.5, 1.5, 0], [1.5, 1.5, 1.5], [-1.5, 1.5, 1.5]]]), scenes.diffuse((0.7, 0.7, 0.6)))
    b.quads(scenes.box_quads((-0.8, 0.3, 0.0), (-0.3, 0.8, 0.7)), scenes.diffuse((0.8, 0.2, 0.1)))
    b.quads(scenes.box_quads((0.2, 0.5, 0.0), (0.8, 1.0, 0.4)), scenes.diffuse((0.1, 0.3, 0.8)))
    # Along the floor, which would else throw it on as if it were diffuse.
    b.light(scenes.sun_light((0.25, 1.0, 0.0), 4.0))
    return b.build(scenes.perspective((0, -3.4, 1.3), (0, 0.4, 0.35), 0.75))


def cases(what: str):
    """(name, scene, pass, settings) of one table."""
    from gi_addon.compare import scenes

    if what == "indirect":
        found = {
            "empty box, spot at the back wall": aimed_box(blocks=False, eye=(0, -0.9, 1), target=(0, 1, 1)),
            "box with blocks, spot from the camera": aimed_box(blocks=True, eye=(0, -3.9, 1.2), target=(0, 0, 0.7)),
            "courtyard": courtyard(),
            "Cornell box": scenes.cornell(),
        }
        plain = {"ssdo.margin": 0.0, "ssdo.layers": 1}
        for name, scene in found.items():
            for settings in (plain, {"ssdo.layers": 1}, {}, {"ssdo.layers": 3}):
                yield name, scene, "Diffuse Indirect", settings
    elif what == "mirrors":
        for roughness in (0.0, 0.2, 0.5):
            yield f"metal floor, roughness {roughness:g}", mirror_room(roughness), "Glossy Indirect", {}
    elif what == "occlusion":
        for distance in (0.25, 1.0):
            scene = scenes.cornell()
            scene.world.ao_distance = distance
            for kind in ("MITTRING", "BITMASK"):
                yield f"Cornell box, {distance:g} m", scene, "Ambient Occlusion", {"ssdo.occlusion": kind}
    else:
        yield "refraction and subsurface", scenes.effect("translucency"), "Combined", {}


def main() -> None:
    import gi_addon
    from gi_addon.compare.metrics import score
    from gi_addon.compare.sheet import comparison
    from gi_addon.compare.visible_light import visible_light
    from gi_addon.host import build, cycles
    from gi_addon.renderer import render
    from gi_addon.settings import Settings

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tables", nargs="+", choices=("indirect", "mirrors", "occlusion", "translucency"))
    parser.add_argument("--samples", type=int, default=8, help="sub-frames")
    parser.add_argument("--reference-samples", type=int, default=256)
    parser.add_argument("-o", "--output", type=Path)
    arguments = parser.parse_args()
    gi_addon.register()
    for table in arguments.tables:
        rows, halves, last = [], [], None
        for name, scene, wanted, values in cases(table):
            if name != last:
                halves, last = [], name
                for seed in (1, 2):
                    made = build.build(scene)
                    made.render.resolution_x, made.render.resolution_y, made.render.resolution_percentage = *SIZE, 100
                    # A mirror shows light that has bounced once already.
                    cycles.set_up(made, cycles.Reference(2 if table == "mirrors" else 1, arguments.reference_samples, seed))
                    if table == "mirrors":
                        made.cycles.caustics_reflective = False  # which only add noise to it
                    halves.append(cycles.render_passes(made, (wanted,))[wanted][..., :3])
            settings = Settings()
            settings.set("technique", "SSDO")
            for path, value in values.items():
                settings.set(path, value)
            start = time.perf_counter()
            image = render(scene, settings, (wanted,), resolution=SIZE, subframes=arguments.samples).passes[wanted][..., :3]
            seconds = time.perf_counter() - start
            known = f", known {visible_light(scene, settings).known:.3f}" if table == "indirect" else ""
            chosen = ", ".join(f"{k} {v}" for k, v in values.items())
            print(f"{name} [{chosen}]: {score(image, *halves).text()}{known}, {seconds:.1f} s", flush=True)
            rows.append((f"{name} {chosen}", image, (halves[0] + halves[1]) / 2))
        if arguments.output:
            arguments.output.mkdir(parents=True, exist_ok=True)
            comparison(arguments.output / f"{table}.png", rows, ("SSDO", "Cycles R1"))
    gi_addon.unregister()


if __name__ == "__main__":
    main()
