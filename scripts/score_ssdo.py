# SPDX-License-Identifier: GPL-3.0-or-later
"""SSDO on scenes made by code against one bounce of Cycles: the numbers of docs/techniques/ssdo.md.

``.venv/bin/python scripts/score_ssdo.py indirect mirrors occlusion translucency sweep`` prints tables; ``-o FOLDER`` writes
sheets. ``time`` prints what each pass takes, without a reference; ``--scene FILE.npz`` of a snapshot in place of the Cornell box.
"""

from __future__ import annotations

import argparse
import sys
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
    elif what == "sweep":
        for name in ("cornell", "corridor"):
            scene = getattr(scenes, name)()
            for samples in (50, 100, 200, 400):
                yield name, scene, "Diffuse Indirect", {"ssdo.samples": samples, "ssdo.steps": 25}
    else:
        yield "refraction and subsurface", scenes.effect("translucency"), "Combined", {}


def settings_of(values: dict):
    """SSDO's settings with ``values`` by dotted name."""
    from gi_addon.settings import Settings

    settings = Settings()
    for path, value in {"technique": "SSDO", **values}.items():
        settings.set(path, value)
    return settings


def print_times(scene, subframes: int, values: dict, size=(320, 180), rounds: int = 3) -> None:
    """Milliseconds a sub-frame of each pass of Combined (the least of ``rounds`` frames), and in units of direct lighting."""
    from gi_addon.compare.studio import Studio

    best: dict[str, float] = {}
    with Studio() as studio:
        for _ in range(rounds + 1):  # the first compiles
            result = studio.render(scene, settings_of(values), ("Combined",), size, subframes=subframes, timed=True)
            found = {name: sum(ms) / subframes for name, ms in result.milliseconds.items()}
            best = {name: min(ms, best.get(name, ms)) if _ else ms for name, ms in found.items()}
    unit = best["Direct Lighting Computation"]
    for name, ms in sorted(best.items(), key=lambda item: -item[1]):
        print(f"{name}: {ms:.2f} ms, {ms / unit:.2f}")
    print(f"all: {sum(best.values()):.1f} ms", flush=True)


def main() -> None:
    import gi_addon
    from gi_addon.compare import scenes
    from gi_addon.compare.metrics import score
    from gi_addon.compare.sheet import comparison
    from gi_addon.compare.studio import Studio
    from gi_addon.compare.visible_light import visible_light
    from gi_addon.host import build, cycles
    from gi_addon.scene import Scene

    parser = argparse.ArgumentParser(description=__doc__)
    tables = ("indirect", "mirrors", "occlusion", "translucency", "sweep", "time")
    parser.add_argument("tables", nargs="+", choices=tables)
    parser.add_argument("--scene", type=Path, help="snapshot (quartet snapshot) for the table time; else the Cornell box")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE")
    parser.add_argument("--samples", type=int, default=8, help="sub-frames")
    parser.add_argument("--reference-samples", type=int, default=256)
    parser.add_argument("-o", "--output", type=Path)
    arguments = parser.parse_args()
    gi_addon.register()
    studio = Studio()
    given = dict(assignment.split("=", 1) for assignment in arguments.set)
    for table in arguments.tables:
        if table == "time":
            scene = Scene.load(arguments.scene) if arguments.scene else scenes.cornell()
            print_times(scene, arguments.samples, given)
            continue
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
            settings = settings_of({**values, **given})
            result = studio.render(scene, settings, (wanted,), SIZE, subframes=arguments.samples)
            image = result.passes[wanted][..., :3]
            if table == "sweep":  # again, with all programs built
                rounds = [studio.render(scene, settings, (wanted,), SIZE, subframes=arguments.samples) for _ in range(3)]
                result = min(rounds, key=lambda r: r.seconds)
            known = f", known {visible_light(scene, settings).known:.3f}" if table == "indirect" else ""
            chosen = ", ".join(f"{k} {v}" for k, v in values.items())
            ms = 1000.0 * result.seconds / arguments.samples
            print(f"{name} [{chosen}]: {score(image, *halves).text()}{known}, {ms:.1f} ms a sub-frame", flush=True)
            rows.append((f"{name} {chosen}", image, (halves[0] + halves[1]) / 2))
        if arguments.output:
            arguments.output.mkdir(parents=True, exist_ok=True)
            comparison(arguments.output / f"{table}.png", rows, ("SSDO", "Cycles R1"))
    studio.close()
    gi_addon.unregister()


if __name__ == "__main__":
    main()
