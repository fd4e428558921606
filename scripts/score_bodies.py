# SPDX-License-Identifier: GPL-3.0-or-later
"""What light that walks through bodies brings to what is around them, against Cycles: the numbers of docs/techniques/vct.md.

``.venv/bin/python scripts/score_bodies.py window,ball --techniques VCT,LPV`` prints per case and technique gain and relMSE of
Diffuse Indirect around the body.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
SIZE, PASSES, WALLS = (64, 36), ("Diffuse Indirect", "Diffuse Color"), 0.7


def wax(path, color=(0.8,) * 3, **inputs):
    """Wax of mean free ``path`` (3,) in m and albedo ``color`` (3,), of refractive index 1 unless ``inputs`` say otherwise."""
    from gi_addon.compare import scenes

    return scenes.principled("Wax", Base_Color=(*color, 1.0), Subsurface_Weight=1.0, Subsurface_Scale=1.0, Subsurface_Radius=path,
                             **{"Specular_IOR_Level": 0.0, **inputs})  # fmt: skip


def cases() -> dict:
    """Scenes by name."""
    from gi_addon.compare import scenes

    layered = {"path": (0.2, 0.12, 0.06), "color": (0.8, 0.6, 0.4)}
    return {
        "window": lambda: scenes.window(wax((0.1,) * 3)),
        "window-refracting": lambda: scenes.window(wax((0.1,) * 3, Specular_IOR_Level=0.5)),
        "ball": lambda: scenes.ball_over_floor(wax(**layered)),
        "ball-refracting": lambda: scenes.ball_over_floor(wax(**layered, Specular_IOR_Level=0.5, Roughness=1.0)),
        "ball-fine": lambda: scenes.ball_over_floor(wax((0.004,) * 3)),
        "ball-diffuse": lambda: scenes.ball_over_floor(scenes.diffuse((0.8,) * 3)),
    }


def reference(scene, bounces: int, samples: int) -> list[dict]:
    """Two halves of Cycles."""
    from gi_addon.host.build import build
    from gi_addon.host.cycles import Reference, render_passes, set_up

    halves = []
    for seed in (1, 2):
        there = build(scene)
        there.render.resolution_x, there.render.resolution_y, there.render.resolution_percentage = *SIZE, 100
        set_up(there, Reference(bounces, samples, seed))
        halves.append(render_passes(there, PASSES))
    return halves


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="?", default="window,window-refracting,ball,ball-refracting,ball-fine,ball-diffuse")
    parser.add_argument("--techniques", default="VCT,LPV")
    parser.add_argument("--samples", type=int, default=4)
    parser.add_argument("--bounces", type=int, default=1)
    parser.add_argument("--reference-samples", type=int, default=1500)
    chosen = parser.parse_args()

    import bpy  # noqa: F401  Blender has to be there first
    import numpy as np

    import gi_addon
    from gi_addon.compare.metrics import rel_mse
    from gi_addon.renderer import render
    from gi_addon.settings import Settings

    gi_addon.register()
    for name in chosen.cases.split(","):
        scene = cases()[name]()
        halves = reference(scene, chosen.bounces, chosen.reference_samples)
        around = np.abs(halves[0]["Diffuse Color"][..., :3] - WALLS).max(axis=-1) < 0.03
        first, second = (half["Diffuse Indirect"][around][None, :, :3] for half in halves)
        for technique in chosen.techniques.split(","):
            settings = Settings()
            settings.technique, settings.samples, settings.bounces = technique, chosen.samples, chosen.bounces
            for on in (True, False):
                settings.use_translucency = on
                image = render(scene, settings, PASSES[:1], resolution=SIZE).passes["Diffuse Indirect"][around][None, :, :3]
                gain, error = 2.0 * image.sum() / (first + second).sum(), rel_mse(image, first, second)
                without = "" if on else "without translucency "
                print(f"{name:18} {technique} {without}gain {gain:.3f} relMSE {error:.3f}", flush=True)
    gi_addon.unregister()


if __name__ == "__main__":
    main()
