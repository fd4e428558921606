# SPDX-License-Identifier: GPL-3.0-or-later
"""Why a picture is far from Cycles' R∞: its FLIP with one part at a time taken from Cycles, and with only that part ours.

``python scripts/flip_causes.py SCENE.blend --technique RSM --set samples=4 --also "samples=16" --also "bounces=6"``

Combined is light × colour summed over the parts, so each part can be exchanged alone. ``theirs`` is the FLIP that is left
when Cycles' part stands in for ours: low where that part is the cause. ``ours alone`` is the FLIP of Cycles' picture with
that part ours: what the part costs by itself. ``R1 for R∞`` exchanges the indirect light for Cycles' own of one bounce: alone,
it is what any method of one bounce lacks. ``--also`` renders once more with other settings. References are the ready ones
where there are any (scripts/score_shared.py), else Cycles renders R1 and R∞ here, kept in ``--references``.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "scripts")]
LIGHTS = {
    "direct diffuse": ("Diffuse Direct", "Diffuse Color"), "indirect diffuse": ("Diffuse Indirect", "Diffuse Color"),
    "direct glossy": ("Glossy Direct", "Glossy Color"), "indirect glossy": ("Glossy Indirect", "Glossy Color"),
}  # fmt: skip
COLORS = ("Diffuse Color", "Glossy Color")
PASSES = ("Combined", *(light for light, _ in LIGHTS.values()), *COLORS)
BOUNCES = {"R1": 1, "Rinf": 32}


def parts(passes: dict[str, np.ndarray], colors: dict[str, np.ndarray] | None = None) -> dict[str, np.ndarray]:
    """The parts of Combined by name, (H, W, 3); ``rest`` is what remains: emission, environment, transmission, volumes."""
    tint = colors or passes
    result = {name: passes[light][..., :3] * tint[color][..., :3] for name, (light, color) in LIGHTS.items()}
    own = sum(passes[light][..., :3] * passes[color][..., :3] for light, color in LIGHTS.values())
    return {**result, "rest": passes["Combined"][..., :3] - own}


def ready(name: str) -> dict[str, dict[str, np.ndarray]] | None:
    """Passes of R1 and R∞, means of both halves, if a ready file has them."""
    from score_shared import KEYS, SHARED, references

    if not (SHARED / "references" / f"{name}.npz").is_file():
        return None
    data = references(name)
    return {kind: {p: (data[f"{kind}.A.{KEYS[p]}"] + data[f"{kind}.B.{KEYS[p]}"]) / 2.0 for p in PASSES} for kind in BOUNCES}


def render_cycles(scene, folder: Path, name: str, samples: int) -> dict[str, dict[str, np.ndarray]]:
    """Passes of R1 and R∞ by Cycles, read from ``folder`` where they are there already."""
    from gi_addon.host.cycles import Reference, render_passes, set_up

    result = {}
    for kind, bounces in BOUNCES.items():
        size = f"{scene.render.resolution_x}x{scene.render.resolution_y}"
        file = folder / f"{name}.{kind}.{size}.{samples}.npz"
        if not file.is_file():
            set_up(scene, Reference(bounces, samples))
            folder.mkdir(parents=True, exist_ok=True)
            np.savez_compressed(file, **{p: v[..., :3] for p, v in render_passes(scene, PASSES).items() if p in PASSES})
        with np.load(file) as data:
            result[kind] = {p: data[p] for p in PASSES}
    return result


def split(ours: dict[str, np.ndarray], cycles: dict[str, dict[str, np.ndarray]]) -> list[tuple[str, float, float]]:
    """(part, FLIP with Cycles' part in our picture, FLIP with our part in Cycles' picture) of every part."""
    from gi_addon.compare.metrics import hdr_flip

    many = cycles["Rinf"]
    target = many["Combined"]

    def error(change: dict[str, np.ndarray], base: dict[str, np.ndarray]) -> float:
        return hdr_flip(sum({**base, **change}.values()), target)[0]

    mine, theirs, one = parts(ours), parts(many), parts(cycles["R1"])
    groups = {name: (name,) for name in mine}
    groups["both direct"] = ("direct diffuse", "direct glossy")
    groups["both indirect"] = ("indirect diffuse", "indirect glossy")
    rows = [("nothing exchanged", error({}, mine), float("nan"))]
    for name, group in groups.items():
        rows.append((name, error({g: theirs[g] for g in group}, mine), error({g: mine[g] for g in group}, theirs)))
    rows.append(("colours", error(parts(ours, many), {}), error(parts(many, ours), {})))
    indirect = groups["both indirect"]
    rows.append(("R1 for R∞", error({g: one[g] for g in indirect}, mine), error({g: one[g] for g in indirect}, theirs)))
    return rows


def main() -> None:

    import gi_addon
    from gi_addon.host import files, properties
    from gi_addon.host.cycles import render_passes

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", type=Path)
    parser.add_argument("--technique", default="RSM", help="one, or several with commas between")
    parser.add_argument("--set", action="append", default=["samples=4"], help="a setting; samples=4 unless said")
    parser.add_argument("--also", action="append", default=[], help="further settings, with spaces between, for one more picture")
    parser.add_argument("--references", type=Path, default=Path("references"), help="folder of Cycles' pictures")
    parser.add_argument("--cycles-samples", type=int, default=256)
    arguments = parser.parse_args()
    gi_addon.register()
    scene, _ = files.load(arguments.scene)
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 256, 144, 100
    scene.render.use_border = False
    name = arguments.scene.stem
    cycles = ready(name) if arguments.scene.suffix == ".blend" else None
    cycles = cycles or render_cycles(scene, arguments.references, name, arguments.cycles_samples)
    scene.render.engine = "QUARTET"
    for technique in arguments.technique.split(","):
        for more in ("", *arguments.also):
            settings = properties.read(scene)
            before = properties.read(scene)
            for assignment in (f"technique={technique}", *arguments.set, *more.split()):
                settings.set(*assignment.split("=", 1))
            properties.write(scene, settings)
            ours = render_passes(scene, PASSES)
            properties.write(scene, before)
            gain = float(ours["Combined"][..., :3].sum() / cycles["Rinf"]["Combined"].sum())
            print(f"{name} {technique} {more}: gain {gain:.3f}\n    {'part':18s} theirs  ours alone")
            for part, with_theirs, alone in split(ours, cycles):
                print(f"    {part:18s} {with_theirs:.3f}   {alone:.3f}", flush=True)
    gi_addon.unregister()


if __name__ == "__main__":
    main()
