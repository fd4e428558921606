# SPDX-License-Identifier: GPL-3.0-or-later
"""Print what docs/techniques/vct.md states of voxel cone tracing: error by resolution, time and memory by pass, and what a
sparse store would hold.

``.venv/bin/python scripts/vct_measures.py resolution passes sparse``
"""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))
SIZE, REFERENCE_SAMPLES = (128, 72), 512
BRICK = 8


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


def rendered(scene, output: str, **values):
    """(pass (H, W, 3), renderer's report, seconds) after a first frame that builds all."""
    from gi_addon.compare.studio import Studio, settings_for

    with Studio() as studio:
        settings = settings_for("VCT", **values)
        studio.render(scene, settings, (output,), SIZE)
        result = studio.render(scene, settings, (output,), SIZE)
    return result


def resolution() -> None:
    """Diffuse Indirect of the Cornell box with blocks, 16 sub-frames, by cells along the longest side."""
    from gi_addon.compare.metrics import score

    output = "Diffuse Indirect"
    scene, one = halves("cornell", "R1", (output,))
    _, many = halves("cornell", "Rinf", (output,))
    for cells in (32, 64, 128, 256):
        for bounces, kind, reference in ((1, "R1", one), (4, "Rinf", many)):
            if cells == 256 and bounces > 1:
                continue
            result = rendered(scene, output, samples=16, bounces=bounces, vct__resolution=cells)
            s = score(result.passes[output][..., :3], reference.a[output], reference.b[output])
            print(f"{cells} cells, {kind}: gain {s.gain:.3f}, relMSE {s.rel_mse:.4f}, {result.seconds * 1e3:.0f} ms", flush=True)


def main() -> None:
    for name in sys.argv[1:] or ("resolution",):
        {"resolution": resolution}[name]()


if __name__ == "__main__":
    main()
