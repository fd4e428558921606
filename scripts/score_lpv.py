# SPDX-License-Identifier: GPL-3.0-or-later
"""LPV on scenes made by code against one diffuse bounce of Cycles: the numbers of docs/techniques/lpv.md.

``.venv/bin/python scripts/score_lpv.py`` prints a table: empty Cornell boxes under a spot and an area light, over grid
resolutions.
"""

from __future__ import annotations

import argparse
import sys
import time
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


def main() -> None:
    import gi_addon
    from gi_addon.compare import scenes
    from gi_addon.compare.metrics import score
    from gi_addon.compare.sheet import comparison
    from gi_addon.host import build, cycles
    from gi_addon.renderer import render
    from gi_addon.settings import Settings

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=256)
    parser.add_argument("--resolutions", default="16,32,48")
    parser.add_argument("-o", "--output")
    arguments = parser.parse_args()
    gi_addon.register()
    rows = []
    cases = (
        ("empty, spot", scenes.cornell(blocks=False), "Diffuse Indirect"),
        ("empty, area light", scenes.cornell(blocks=False, light="area"), "Diffuse Indirect"),
        ("blocks, area light", scenes.cornell(light="area"), "Diffuse Indirect"),
        ("glowing block", emissive_box(), "Combined"),
    )
    for name, scene, wanted in cases:
        halves = []
        for seed in (1, 2):
            made = build.build(scene)
            made.render.resolution_x, made.render.resolution_y, made.render.resolution_percentage = *SIZE, 100
            cycles.set_up(made, cycles.Reference(1, arguments.samples, seed))
            halves.append(cycles.render_passes(made, (wanted,))[wanted][..., :3])
        for resolution in (int(r) for r in arguments.resolutions.split(",")):
            settings = Settings()
            settings.set("technique", "LPV")
            settings.set("lpv.resolution", resolution)
            start = time.perf_counter()
            image = render(scene, settings, (wanted,), resolution=SIZE, subframes=8).passes[wanted][..., :3]
            seconds = time.perf_counter() - start
            print(f"{name} {resolution}: {score(image, *halves).text()}, {seconds:.1f} s", flush=True)
        rows.append((name, image, (halves[0] + halves[1]) / 2))
    if arguments.output:
        comparison(arguments.output, rows, ("LPV", "Cycles R1"))
    gi_addon.unregister()


if __name__ == "__main__":
    main()
