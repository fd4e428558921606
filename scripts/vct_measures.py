# SPDX-License-Identifier: GPL-3.0-or-later
"""Print what docs/techniques/vct.md states of voxel cone tracing: error by resolution, time and memory by pass, and what a
sparse store would hold.

``.venv/bin/python scripts/vct_measures.py resolution passes sparse``
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))
SIZE, REFERENCE_SAMPLES = (128, 72), 512
BRICK = 8
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


def resolution() -> None:
    """Diffuse Indirect of the Cornell box with blocks against Cycles, 16 sub-frames, by cells along the longest side."""
    from gi_addon.compare.metrics import score
    from gi_addon.compare.studio import Studio, settings_for

    output = "Diffuse Indirect"
    scene, one = halves("cornell", "R1", (output,))
    _, many = halves("cornell", "Rinf", (output,))
    for cells in (32, 64, 128, 256):
        with Studio() as studio:
            # The fourth bounce at 256 cells takes minutes on a software driver.
            for bounces, kind, reference in ((1, "R1", one), (4, "Rinf", many))[: 1 if cells == 256 else 2]:
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


def sparse() -> None:
    """Share of cells, and of bricks of 8³ cells, that hold surfaces; MiB of all volumes dense and in bricks with a table."""
    from gi_addon.compare import scenes
    from gi_addon.compare.studio import Studio, settings_for
    from gi_addon.gl.formats import FORMATS

    # Per cell: six sheets, extents and lights, one light of backs, albedo.
    kept = (("rgba16", 6), ("rgba8", 6), ("rgba16f", 6), ("rgba16f", 1), ("rgba8", 1))
    each = sum(FORMATS[name].bytes * count for name, count in kept)
    for name in ("cornell", "corridor"):
        for cells in (64, 128):
            with Studio() as studio:
                settings = settings_for("VCT", samples=1, vct__resolution=cells)
                studio.render(scenes.BUILTIN[name](), settings, ("Diffuse Indirect",), (32, 18))

                def read(gl, studio=studio):
                    texture = studio.renderer.frame.resources["voxels.kinds"]
                    return texture.size, texture.read(alignment=1)

                (x, y, z), raw = studio.call(read)
            held = np.frombuffer(raw, np.uint8).reshape(z, y, x, 2)[..., 0] < 64
            padded = np.pad(held, [(0, -n % BRICK) for n in held.shape])
            a, b, c = (n // BRICK for n in padded.shape)
            bricks = padded.reshape(a, BRICK, b, BRICK, c, BRICK).any((1, 3, 5))
            dense, sparse_ = held.size * each / MIB, (bricks.sum() * BRICK**3 * each + 4 * bricks.size) / MIB
            print(f"{name}, {cells} cells: {held.mean():.3f} of cells, {bricks.mean():.3f} of bricks; dense {dense:.1f} MiB, "
                  f"bricks {sparse_:.1f} MiB", flush=True)  # fmt: skip


def main() -> None:
    for name in sys.argv[1:] or ("resolution", "passes", "sparse"):
        {"resolution": resolution, "passes": passes, "sparse": sparse}[name]()


if __name__ == "__main__":
    main()
