# SPDX-License-Identifier: GPL-3.0-or-later
"""Score a technique on a shared scene against its ready-made Cycles references, at their 256 × 144.

``.venv/bin/python scripts/score_shared.py sponza_crytek --technique RSM --samples 16 --set rsm.samples=400 -o sheet.png``
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))
SHARED = next((p / "shared" for p in ROOT.parents if (p / "shared" / "references").is_dir()), ROOT.parent / "shared")
KEYS = {
    "Combined": "Combined", "Diffuse Direct": "DiffDir", "Diffuse Indirect": "DiffInd", "Diffuse Color": "DiffCol",
    "Glossy Direct": "GlossDir", "Glossy Indirect": "GlossInd", "Glossy Color": "GlossCol", "Ambient Occlusion": "AO",
    "Emission": "Emit", "Environment": "Env",
}  # fmt: skip


def references(name: str) -> dict[str, np.ndarray]:
    """Arrays by key ``R1.A.DiffInd`` …, row 0 at the bottom."""
    with np.load(SHARED / "references" / f"{name}.npz") as data:
        return {k: np.ascontiguousarray(data[k][::-1].astype("f4")) for k in data.files}


def main() -> None:
    import bpy

    import gi_addon
    from gi_addon.compare.metrics import score
    from gi_addon.compare.sheet import comparison
    from gi_addon.host import properties
    from gi_addon.host.cycles import render_passes

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene")
    parser.add_argument("--technique", default="RSM")
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--set", action="append", default=[])
    parser.add_argument("--against", default="R1", choices=("R1", "Rinf"))
    parser.add_argument("--passes", default="Combined,Diffuse Direct,Diffuse Indirect,Glossy Direct,Glossy Indirect")
    parser.add_argument("--flip", action="store_true")
    parser.add_argument("-o", "--output")
    arguments = parser.parse_args()
    gi_addon.register()
    path = next((SHARED / "scenes").glob(f"*/{arguments.scene}.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(path))
    scene = bpy.context.scene
    scene.render.engine = "QUARTET"
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 256, 144, 100
    settings = properties.read(scene)
    settings.set("technique", arguments.technique)
    settings.set("samples", arguments.samples)
    for assignment in arguments.set:
        settings.set(*assignment.split("=", 1))
    properties.write(scene, settings)
    names = arguments.passes.split(",")
    start = time.perf_counter()
    passes = render_passes(scene, names)
    print(f"{arguments.scene} {arguments.technique}: {time.perf_counter() - start:.2f} s with sync")
    reference, rows = references(arguments.scene), []
    for name in names:
        a, b = (reference[f"{arguments.against}.{half}.{KEYS[name]}"] for half in "AB")
        test = passes[name][..., :3]
        if a.max() <= 0 and test.max() <= 0:
            continue
        print(f"  {name:18s} {score(test, a, b, flip=arguments.flip).text()}")
        rows.append((name, test, (a + b) / 2))
    if arguments.output:
        comparison(arguments.output, rows, (arguments.technique, f"Cycles {arguments.against}"))
    gi_addon.unregister()


if __name__ == "__main__":
    main()
