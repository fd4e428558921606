# SPDX-License-Identifier: GPL-3.0-or-later
"""Print what docs/techniques/vct.md states of voxel cone tracing: error by resolution, ambient occlusion and shadows against
Cycles, time and memory by pass, and what the store of sheets holds.

``.venv/bin/python scripts/vct_measures.py resolution occlusion passes store [scene.blend …]``
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))
SIZE, REFERENCE_SAMPLES = (128, 72), 512
BRICKS = (4, 8)
# Bytes a cell when each had room for six sheets (planes, extents), albedo and, with mips, six lights, one of backs, and kinds.
DENSE = 6 * (8 + 4) + 4 + (6 * 8 + 8 + 2) * 8 / 7
MIB = 1 << 20


def halves(name: str, kind: str, passes: tuple[str, ...]):
    """(scene, Cycles' two halves) of a scene by code, from the cache or by Blender."""
    from gi_addon.cli import _blender
    from gi_addon.compare.references import reference
    from gi_addon.host import cycles, embedded

    with _blender(Path(f"builtin:{name}"), None, None, SIZE, None, ()) as scene:
        plain, size = embedded.plain(scene)

        def run_cycles(bounces: int, count: int, seed: int):
            cycles.set_up(scene, cycles.Reference(bounces, count, seed))
            return {n: p[..., :3] for n, p in cycles.render_passes(scene, passes).items()}

        return plain, reference(kind, plain.digest(), size, REFERENCE_SAMPLES, passes, run_cycles)


def resolution(every: tuple[int, ...] = (32, 64, 128, 256)) -> None:
    """Diffuse Indirect of the Cornell box with blocks against Cycles, 16 sub-frames, by cells along the longest side."""
    from gi_addon.compare.metrics import score
    from gi_addon.compare.studio import Studio, settings_for

    output = "Diffuse Indirect"
    scene, one = halves("cornell", "R1", (output,))
    _, many = halves("cornell", "Rinf", (output,))
    for cells in every:
        with Studio() as studio:
            for bounces, kind, reference in ((1, "R1", one), (4, "Rinf", many)):
                settings = settings_for("VCT", samples=16, bounces=bounces, vct__resolution=cells)
                result = studio.render(scene, settings, (output,), SIZE)
                s = score(result.passes[output][..., :3], reference.a[output], reference.b[output])
                text = f"gain {s.gain:.3f}, relMSE {s.rel_mse:.4f}, first frame {result.seconds:.2f} s"
                print(f"{cells} cells, {bounces} bounces, {kind}: {text}, {result.plan.nbytes() / MIB:.0f} MiB", flush=True)


def passes() -> None:
    """Wall milliseconds and kept MiB of each pass of one sub-frame, 256 × 144, 64 cells, voxels made once and anew."""
    from gi_addon.compare.scenes import cornell
    from gi_addon.compare.studio import Studio, settings_for

    scene = cornell()
    for anew in (False, True):
        with Studio() as studio:
            settings = settings_for("VCT", samples=1, vct__continuous_voxelization=anew)
            studio.render(scene, settings, ("Combined",), (256, 144))
            timers = studio.renderer.frame.timers
            timers.enabled = timers.wall = True
            result = studio.render(scene, settings, ("Combined",), (256, 144), timed=True)
            ms = result.milliseconds or studio.call(lambda gl: timers.collect())  # noqa: B023 — called at once
            facts = result.plan.facts
            print("continuous voxelization", "on" if anew else "off")
            for planned in result.plan.run:
                title = planned.title
                mib = sum(w.nbytes(facts) for w in planned.writes) / MIB
                print(f"  {title}: {sum(map(float, ms.get(title, [0.0]))):.1f} ms, {mib:.2f} MiB", flush=True)


def occlusion() -> None:
    """Ambient Occlusion, and Diffuse Direct by shadow cones, of the Cornell box with blocks against Cycles, 16 sub-frames at the
    defaults and at 64 and 128 cells."""
    from gi_addon.compare.metrics import score
    from gi_addon.compare.studio import Studio, settings_for

    names = ("Ambient Occlusion", "Diffuse Direct")
    scene, reference = halves("cornell", "R1", names)
    for cells in (64, 128):
        with Studio() as studio:
            settings = settings_for("VCT", samples=16, use_ao=True, vct__shadow_cones=True, vct__resolution=cells)
            result = studio.render(scene, settings, names, SIZE)
            for name in names:
                s = score(result.passes[name][..., :3], reference.a[name], reference.b[name])
                print(f"{cells} cells, {name}: gain {s.gain:.3f}, relMSE {s.rel_mse:.4f}", flush=True)


def store(*files: str) -> None:
    """Share of cells, and of bricks of 4³ and 8³ cells, that hold surfaces; sheets found and planned for; MiB; ms by pass."""
    from gi_addon.cli import _blender
    from gi_addon.compare import scenes
    from gi_addon.compare.studio import Studio, settings_for
    from gi_addon.host import embedded
    from gi_addon.passes.voxels import sheet_counts, voxel_grid

    named = {name: scenes.BUILTIN[name]() for name in ("cornell", "corridor")}
    for file in files:
        with _blender(Path(file), None, None, SIZE, None, ()) as scene:
            named[Path(file).stem] = embedded.plain(scene)[0]
    for name, scene in named.items():
        for cells in (64, 128, 256):
            with Studio() as studio:
                settings = settings_for("VCT", samples=1, vct__resolution=cells)
                studio.render(scene, settings, ("Diffuse Indirect",), SIZE)

                def again(gl, studio=studio):
                    """Places of the cells' sheets; ms of a frame all of whose passes are due, as none is compiled anew."""
                    renderer = studio.renderer
                    renderer.timers.enabled = renderer.timers.wall = True
                    renderer.timers.reset()
                    renderer._static.clear()
                    renderer.subframe(0)
                    gl.ctx.finish()
                    resources = renderer.frame.resources
                    total = np.frombuffer(resources["voxels.total"].read(), "u4")
                    places = np.frombuffer(resources["voxels.places"].read(), "u4")[: total[0]]
                    return renderer._plan, total, places, renderer.timers.collect()

                plan, total, places, ms = studio.call(again)
            facts = plan.facts
            size = np.array(voxel_grid(facts).size)
            cell = np.stack([places, places >> 9, places >> 18], -1).astype(int) & 511
            held = len(np.unique(places & (1 << 27) - 1)) / size.prod()
            bricks = [len(np.unique(cell // b, axis=0)) / np.ceil(size / b).prod() for b in BRICKS]
            mib = {r: w.nbytes(facts) / MIB for r, w in plan.resources.items() if r.startswith(("voxels.", "vct.r", "vct.b"))}
            sums = mib.pop("voxels.sums")
            times = ", ".join(f"{title} {sum(map(float, each)):.0f}" for title, each in ms.items() if title.startswith("Voxel"))
            print(f"{name}, {cells} cells: {held:.4f} of cells held, {bricks[0]:.3f} of bricks of 4³, {bricks[1]:.3f} of 8³; "
                  f"{total[0]} sheets, {total[1]} with mips, planned {sum(sheet_counts(facts))}")
            print(f"  MiB: {sum(mib.values()):.1f} kept, {mib['voxels.kinds']:.1f} of it cells, {sums:.1f} of sums, dense "
                  f"{size.prod() * DENSE / MIB:.0f}; ms: {times}", flush=True)


def main() -> None:
    names = [a for a in sys.argv[1:] if not a.endswith(".blend")]
    files = [a for a in sys.argv[1:] if a.endswith(".blend")]
    for name in names or ("resolution", "occlusion", "passes", "store"):
        {"resolution": resolution, "occlusion": occlusion, "passes": passes, "store": lambda: store(*files)}[name]()


if __name__ == "__main__":
    main()
