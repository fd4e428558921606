# SPDX-License-Identifier: GPL-3.0-or-later
"""Every scene file in a folder, rendered with every technique beside Cycles: a contact sheet with FLIP and gain, and a table.

``python scripts/contact_sheet.py SCENES -o FOLDER --samples 16``. What FOLDER holds already is not rendered again, so that a run
can be stopped and goes on; ``--references`` keeps Cycles' pictures in a folder of their own. Each scene is a process; one that
ends by itself costs the technique it was at, which becomes a row that says so, and the others go on.

A scene with ready references (``--ready``, as scripts/score_shared.py reads them) is rendered at their size and scored against
both halves; else Cycles renders R∞ here: gain is against its own samples, FLIP and relMSE against the same ones denoised.
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
TECHNIQUES = ("RSM", "LPV", "VCT", "SSDO")
# Cycles writes the picture before the denoiser beside the denoised one, under this name.
NOISY = "Noisy Image"


def name_of(path: Path) -> str:
    return f"{path.parent.name}-{path.stem}"


class Files:
    """Where the pictures and figures of a scene lie."""

    def __init__(self, arguments, path: Path) -> None:
        self.name, self.output = name_of(path), arguments.output
        ready = arguments.ready / f"{path.stem}.npz" if arguments.ready else None
        self.ready = ready if ready is not None and ready.is_file() and path.suffix == ".blend" else None
        self.bounces = arguments.bounces
        self.reference = (arguments.references or arguments.output) / f"{self.name}.R{self.bounces}.{arguments.resolution}.npz"

    def picture(self, technique: str) -> Path:
        return self.output / f"{self.name}.{technique}.npy"

    def facts(self, technique: str) -> Path:
        return self.output / f"{self.name}.{technique}.json"

    def read_reference(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(picture, half A, half B) of R∞ or, with ``--bounces 1``, R1; the halves are the same without ready references."""
        if self.ready is None:
            with np.load(self.reference) as data:
                return data["picture"], data["samples"], data["samples"]
        kind = "R1" if self.bounces == 1 else "Rinf"
        with np.load(self.ready) as data:
            a, b = (np.ascontiguousarray(data[f"{kind}.{half}.Combined"][::-1].astype("f4")) for half in "AB")
        return (a + b) / 2.0, a, b


def missing(files: Files, arguments) -> list[str]:
    """What of a scene is still to be rendered."""
    cycles = ["Cycles"] if files.ready is None and not files.reference.is_file() else []
    return cycles + [t for t in arguments.technique_list if not files.facts(t).is_file()]


def one(arguments) -> None:
    """Render what is missing of one scene in this process; each result is written when it is there."""
    import gi_addon
    from gi_addon.host import files as scene_files

    gi_addon.register()
    files = Files(arguments, arguments.one)
    scene, notes = scene_files.load(arguments.one)
    size = (256, 144) if files.ready is not None else tuple(int(v) for v in arguments.resolution.split("x"))
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = *size, 100
    scene.render.use_border = False
    for step in missing(files, arguments):
        print(step, flush=True)
        if step == "Cycles":
            render_reference(scene, files, arguments)
        else:
            render_technique(scene, step, files, arguments, notes)
    gi_addon.unregister()


def render_reference(scene, files: Files, arguments) -> None:
    """Cycles with many bounces: its samples, and the denoised picture of the same."""
    import bpy

    from gi_addon.host.cycles import Reference, render_passes, set_up

    set_up(scene, Reference(arguments.bounces, arguments.cycles_samples, unbiased=True, denoise=True))
    layer = bpy.context.view_layer
    layer.cycles.denoising_store_passes = True
    passes = render_passes(scene, ["Combined"])
    layer.cycles.denoising_store_passes = False
    np.savez_compressed(files.reference, picture=passes["Combined"][..., :3], samples=passes[NOISY][..., :3])


def render_technique(scene, technique: str, files: Files, arguments, notes: list[str]) -> None:
    """One technique's picture, and what there is to say of it."""
    import bpy

    from gi_addon.host import properties, status
    from gi_addon.host.cycles import quiet, render_passes
    from gi_addon.host.sync import SceneSync

    scene.render.engine = "QUARTET"
    settings = properties.read(scene)
    settings.set("technique", technique)
    settings.set("samples", arguments.samples)
    for assignment in arguments.set:
        settings.set(*assignment.split("=", 1))
    properties.write(scene, settings)
    size = (scene.render.resolution_x, scene.render.resolution_y)
    with quiet():
        depsgraph = bpy.context.evaluated_depsgraph_get()
        start = time.perf_counter()
        plain = SceneSync().read(depsgraph, resolution=size)
        sync = time.perf_counter() - start
    status.latest.clear()
    image = render_passes(scene, ["Combined"])["Combined"][..., :3]
    report = status.latest.get("final")
    if report is None:
        raise RuntimeError(status.problem or "no picture")
    world = compile_world_notes(plain)
    np.save(files.picture(technique), image)
    files.facts(technique).write_text(json.dumps({
        "triangles": plain.triangle_count(), "instances": len(plain.instances), "lights": len(plain.lights), "sync": sync,
        "frame": report.seconds / report.subframes, "subframes": report.subframes, "mib": report.mib,
        "approximated": [f"{m}: {text}" for m, text in report.approximated] + world,
        "notes": list(dict.fromkeys([*notes, *report.notes])), "finite": bool(np.isfinite(image).all()),
    }))  # fmt: skip


def compile_world_notes(plain) -> list[str]:
    """What of the world is approximated."""
    from gi_addon.materials import compile_world

    return [f"world: {text}" for text in compile_world(plain.world.graph, plain.images).approximated]


def run_scene(path: Path, arguments) -> None:
    """Render a scene in processes of its own until nothing is missing; what fails is written down as failed."""
    files = Files(arguments, path)
    while missing(files, arguments):
        done = subprocess.run([sys.executable, __file__, "--one", str(path), *sys.argv[1:]], capture_output=True, text=True,
                              check=False)  # fmt: skip
        left = missing(files, arguments)
        if not left:
            break
        failed = left[0]
        text = (done.stderr.strip().splitlines() or ["no message"])[-1]
        print(f"{name_of(path)} {failed} failed ({done.returncode}): {done.stderr[-1500:]}", flush=True)
        if failed == "Cycles":
            break
        files.facts(failed).write_text(json.dumps({"failed": f"{done.returncode}: {text}"}))


def result(path: Path, technique: str, arguments) -> dict:
    """The facts of a rendered scene with its ``flip``, ``gain`` and ``relmse``, found once: FLIP takes its time."""
    from gi_addon.compare.metrics import score

    files = Files(arguments, path)
    facts = json.loads(files.facts(technique).read_text())
    key = f"R{arguments.bounces}"
    if "failed" in facts or key in facts:
        return facts
    picture, a, b = files.read_reference()
    test = np.load(files.picture(technique))
    halves = (a, b) if files.ready else (picture, None)
    facts[key] = {
        "flip": score(test, picture, flip=True).flip, "gain": float(test.sum() / (0.5 * (a.sum() + b.sum()))),
        "relmse": score(test, *halves).rel_mse,
    }  # fmt: skip
    files.facts(technique).write_text(json.dumps(facts))
    return facts


def line(path: Path, arguments) -> str:
    """A row of the Markdown table: FLIP and gain of every technique, then what is the same for all."""
    rows = {t: result(path, t, arguments) for t in arguments.technique_list if Files(arguments, path).facts(t).is_file()}
    cells, key = [], f"R{arguments.bounces}"
    for technique in arguments.technique_list:
        row = rows.get(technique, {})
        cells.append(f"{row[key]['flip']:.3f} / {row[key]['gain']:.2f}" if key in row else "failed" if "failed" in row else "")
    first = next((r for r in rows.values() if key in r), None)
    if first is None:
        return f"| {name_of(path)} |" + "".join(f" {c} |" for c in cells) + " | | | |"
    frames = ", ".join(f"{1e3 * r['frame']:.0f}" for r in rows.values() if key in r)
    return (
        f"| {name_of(path)} | " + " | ".join(cells) + f" | {first['triangles']:,} | {1e3 * first['sync']:.0f} | {frames} | "
        f"{'; '.join(first['approximated'])} |"
    )


def write_sheet(paths: list[Path], arguments) -> None:
    """Two scenes a row, each Cycles and the techniques; and the table."""
    from PIL import Image, ImageDraw

    from gi_addon.compare.sheet import exposure, srgb

    width, height, label, columns = 128, 72, 24, 2
    block = width * (1 + len(arguments.technique_list)) + 8
    sheet = Image.new("RGB", (columns * block, -(-len(paths) // columns) * (height + label)), (24, 24, 24))
    draw = ImageDraw.Draw(sheet)
    for i, path in enumerate(paths):
        files = Files(arguments, path)
        x, y = (i % columns) * block, (i // columns) * (height + label)
        reference = files.read_reference()[0]
        scale = exposure(reference)
        draw.text((x + 2, y), name_of(path), fill=(230, 230, 230))
        pictures = [("Cycles", reference)]
        for technique in arguments.technique_list:
            if files.picture(technique).is_file():
                figures = result(path, technique, arguments)[f"R{arguments.bounces}"]
                pictures.append((f"{technique} {figures['flip']:.3f} g {figures['gain']:.2f}", np.load(files.picture(technique))))
        for k, (text, picture) in enumerate(pictures):
            small = Image.fromarray(srgb(picture[::-1] * scale)).resize((width, height), Image.LANCZOS)
            sheet.paste(small, (x + k * width, y + label))
            draw.text((x + k * width + 2, y + 11), text, fill=(190, 190, 190))
    sheet.save(arguments.output / "sheet.jpg", quality=80)
    techniques = arguments.technique_list
    heads = ["scene", *(f"{t} FLIP / gain" for t in techniques), "triangles", "sync ms", "sub-frame ms", "approximated"]
    table = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    (arguments.output / "table.md").write_text("\n".join(table + [line(p, arguments) for p in paths]) + "\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", type=Path, help="folder with scene files, or one file")
    parser.add_argument("--one", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--techniques", default=",".join(TECHNIQUES), help="'' for Cycles' pictures only")
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--set", action="append", default=[], help="a setting, as 'bounces=4'")
    parser.add_argument("--resolution", default="320x180")
    parser.add_argument("--cycles-samples", type=int, default=128)
    parser.add_argument("--bounces", type=int, default=32, help="of Cycles; 1 is what one-bounce techniques approximate")
    parser.add_argument("--references", type=Path, help="folder of Cycles' pictures; that of the output unless given")
    parser.add_argument("--ready", type=Path, help="folder of ready references, NAME.npz for NAME.blend")
    parser.add_argument("--compose", action="store_true", help="only put what is rendered already on a sheet")
    parser.add_argument("--only", default="", help="parts of scenes' names, with commas between; in the order given")
    parser.add_argument("-o", "--output", type=Path, required=True)
    arguments = parser.parse_args()
    arguments.technique_list = [t for t in arguments.techniques.split(",") if t]
    for folder in (arguments.output, arguments.references):
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
    if arguments.one is not None:
        one(arguments)
        return
    every = [arguments.scenes]
    if arguments.scenes.is_dir():
        every = sorted(p for p in arguments.scenes.rglob("*") if p.suffix in SUFFIXES)
    paths = list(dict.fromkeys(p for part in arguments.only.split(",") for p in every if part in name_of(p)))
    for path in paths if not arguments.compose else ():
        run_scene(path, arguments)
        if arguments.technique_list and not missing(Files(arguments, path), arguments):
            print(line(path, arguments), flush=True)
    whole = [p for p in paths if not missing(Files(arguments, p), arguments)]
    if arguments.technique_list and whole:
        write_sheet(whole, arguments)


if __name__ == "__main__":
    main()
