# SPDX-License-Identifier: GPL-3.0-or-later
"""Every scene file in a folder, rendered by Quartet and by Cycles: a contact sheet with FLIP and gain, and a table.

``python scripts/contact_sheet.py SCENES_FOLDER -o FOLDER --technique RSM --samples 16``. Each scene runs in a process of
its own; Cycles' pictures (denoised, R∞) are kept in FOLDER and rendered once. A scene that fails is a row that says so.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))
SUFFIXES = (".blend", ".glb", ".gltf", ".obj", ".ply")
LABEL = 26


def one(arguments) -> None:
    """Render one scene in this process; results go to files beside each other."""
    import bpy

    import gi_addon
    from gi_addon.host import files, properties
    from gi_addon.host.cycles import Reference, quiet, render_passes, set_up
    from gi_addon.host.sync import SceneSync
    from gi_addon.materials import compile_surface, compile_world

    gi_addon.register()
    scene, notes = files.load(arguments.one)
    width, height = (int(v) for v in arguments.resolution.split("x"))
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = width, height, 100
    scene.render.use_border = False
    target = arguments.output / name_of(arguments.one)
    reference = target.with_suffix(f".cycles{suffix(arguments)}.npy")
    if not reference.is_file():
        # What a user would compare with: many bounces, denoised, nothing clamped, a fixed seed.
        set_up(scene, Reference(arguments.bounces, arguments.cycles_samples, unbiased=True, denoise=True))
        start = time.perf_counter()
        image = render_passes(scene, ["Combined"])["Combined"][..., :3]
        np.save(reference, image)
        print(f"{arguments.one.name}: Cycles {time.perf_counter() - start:.1f} s", flush=True)
    if arguments.technique == "none":
        gi_addon.unregister()
        return
    scene.render.engine = "QUARTET"
    settings = properties.read(scene)
    settings.set("technique", arguments.technique)
    settings.set("samples", arguments.samples)
    for assignment in arguments.set:
        settings.set(*assignment.split("=", 1))
    properties.write(scene, settings)
    sync = SceneSync()
    with quiet():
        depsgraph = bpy.context.evaluated_depsgraph_get()
        start = time.perf_counter()
        plain = sync.read(depsgraph, resolution=(width, height))
        seconds = time.perf_counter() - start
    approximated = [
        f"{m.name}: {text}" for m in plain.materials for text in compile_surface(m.graph, plain.images).approximated
    ] + [f"world: {text}" for text in compile_world(plain.world.graph, plain.images).approximated]
    start = time.perf_counter()
    image = render_passes(scene, ["Combined"])["Combined"][..., :3]
    frame = time.perf_counter() - start
    np.save(target.with_suffix(f".{arguments.technique}.npy"), image)
    target.with_suffix(f".{arguments.technique}.json").write_text(json.dumps({
        "triangles": plain.triangle_count(), "instances": len(plain.instances), "lights": len(plain.lights),
        "sync": seconds, "frame": frame, "approximated": approximated, "notes": [*notes, *plain.notes],
        "finite": bool(np.isfinite(image).all()),
    }))  # fmt: skip
    gi_addon.unregister()


def suffix(arguments) -> str:
    """What tells one kind of Cycles picture from another in a file's name."""
    return (f".{arguments.bounces}" if arguments.bounces != 12 else "") + f".{arguments.resolution}"


def name_of(path: Path) -> str:
    return f"{path.parent.name}-{path.stem}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", type=Path, nargs="?")
    parser.add_argument("--one", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--technique", default="RSM", help="or 'none': Cycles' pictures only")
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--set", action="append", default=[])
    parser.add_argument("--resolution", default="320x180")
    parser.add_argument("--cycles-samples", type=int, default=64)
    parser.add_argument("--bounces", type=int, default=12, help="of Cycles; 1 is what one-bounce techniques approximate")
    parser.add_argument("--compose", action="store_true", help="only put what is rendered already on a sheet")
    parser.add_argument("--only", default="", help="part of a scene's name")
    parser.add_argument("-o", "--output", type=Path, required=True)
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    if arguments.one is not None:
        one(arguments)
        return
    paths = sorted(p for p in arguments.scenes.rglob("*") if p.suffix in SUFFIXES and arguments.only in name_of(p))
    rows = []
    for path in paths if not arguments.compose else ():
        command = [sys.executable, __file__, "--one", str(path), "--technique", arguments.technique,
                   "--samples", str(arguments.samples), "--resolution", arguments.resolution,
                   "--cycles-samples", str(arguments.cycles_samples), "--bounces", str(arguments.bounces),
                   "-o", str(arguments.output)]  # fmt: skip
        for assignment in arguments.set:
            command += ["--set", assignment]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            print(f"{name_of(path)} failed:\n{done.stdout[-500:]}\n{done.stderr[-2000:]}", flush=True)
        rows.append((path, done.returncode))
        if arguments.technique != "none" and done.returncode == 0:
            print(line(path, arguments), flush=True)
    if arguments.compose:
        rows = [(p, 0) for p in paths if (arguments.output / f"{name_of(p)}.{arguments.technique}.json").is_file()]
    if arguments.technique != "none":
        write_sheet([p for p, code in rows if code == 0], arguments)


_results: dict[Path, tuple] = {}


def results(path: Path, arguments):
    """(facts, test, reference, score) of a rendered scene, found once: FLIP takes its time."""
    if path not in _results:
        _results[path] = _find_results(path, arguments)
    return _results[path]


def _find_results(path: Path, arguments) -> tuple:
    from gi_addon.compare.metrics import score

    target = arguments.output / name_of(path)
    facts = json.loads(target.with_suffix(f".{arguments.technique}.json").read_text())
    test = np.load(target.with_suffix(f".{arguments.technique}.npy"))
    reference = np.load(target.with_suffix(f".cycles{suffix(arguments)}.npy"))
    return facts, test, reference, score(test, reference, flip=True)


def line(path: Path, arguments) -> str:
    """A row of the Markdown table."""
    facts, _, _, s = results(path, arguments)
    return (
        f"| {name_of(path)} | {facts['triangles']:,} | {s.flip:.3f} | {s.gain:.2f} | {s.rel_mse:.3f} | {facts['sync']:.2f} | "
        f"{facts['frame']:.1f} | {len(facts['approximated'])} |"
    )


def write_sheet(paths: list[Path], arguments) -> None:
    """The pictures in pairs, three scenes a row."""
    from PIL import Image, ImageDraw

    from gi_addon.compare.sheet import exposure, srgb

    width, height = (int(v) // 2 * 2 for v in arguments.resolution.split("x"))
    small = (width // 2, height // 2)
    columns = 3
    lines = -(-len(paths) // columns)
    sheet = Image.new("RGB", (columns * (2 * small[0] + 6), lines * (small[1] + LABEL)), (24, 24, 24))
    draw = ImageDraw.Draw(sheet)
    for i, path in enumerate(paths):
        _, test, reference, s = results(path, arguments)
        x, y = (i % columns) * (2 * small[0] + 6), (i // columns) * (small[1] + LABEL)
        scale = exposure(reference)
        for k, picture in enumerate((test, reference)):
            sheet.paste(Image.fromarray(srgb(picture[::-1] * scale)).resize(small), (x + k * small[0], y + LABEL))
        draw.text((x + 2, y + 1), name_of(path), fill=(230, 230, 230))
        draw.text((x + 2, y + 12), f"{arguments.technique} | Cycles   FLIP {s.flip:.3f}  gain {s.gain:.2f}", fill=(190, 190, 190))
    sheet.save(arguments.output / f"sheet-{arguments.technique}.png")
    table = ["| scene | triangles | FLIP | gain | relMSE | sync s | frame s | approximated |", "|---" * 8 + "|"]
    table += [line(p, arguments) for p in paths]
    (arguments.output / f"table-{arguments.technique}.md").write_text("\n".join(table) + "\n")


if __name__ == "__main__":
    main()
