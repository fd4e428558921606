# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure Blender's Hosek–Wilkie sky in Cycles and fit R. Perez's formula to it, for ``gi_addon/materials/hosek_numbers.py``.

``python scripts/fit_sky.py``. Panoramas of the sky for every turbidity, elevation of the sun and ground albedo of a grid;
per panorama and channel six numbers of L = S (1 + A e^(B/(cosθ + .01))) (1 + C e^(Dγ) + E cos²γ) by Levenberg's and
Marquardt's method, least in relative error; θ is the angle from the zenith, γ that from the sun (R. Perez et al., "All-Weather
Model for Sky Luminance Distribution", Solar Energy 50, 1993). Blender's sky drops in its last degree above the horizon, and goes
on below it as at it: there only γ matters, and four numbers more are the weights of 1, cosγ, cos²γ and e^(−3γ).
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))
TURBIDITIES = (1.0, 2.0, 3.0, 4.0, 6.0, 10.0)
ELEVATIONS = (0.0, 4.0, 10.0, 18.0, 28.0, 42.0, 60.0, 90.0)  # degrees
ALBEDOS = (0.0, 1.0)
SIZE = (36, 36)
HORIZON = 1e-3  # Blender's least cosθ
START = (1.0, -1.0, -0.3, 3.0, -3.0, 0.3)


def panorama(scene, sky, turbidity: float, elevation: float, albedo: float) -> np.ndarray:
    """Radiance (H, W, 3) all around; row 0 at the bottom."""
    from gi_addon.host.cycles import render_passes

    e = math.radians(elevation)
    sky.turbidity, sky.ground_albedo, sky.sun_direction = turbidity, albedo, (math.cos(e), 0.0, math.sin(e))
    return render_passes(scene, ["Combined"])["Combined"][..., :3].astype("f8")


def angles(elevation: float) -> tuple[np.ndarray, np.ndarray]:
    """(cosθ, γ) of the panorama's pixels, whose middle is +X; below the horizon θ stays what it is there."""
    rows = ((np.arange(SIZE[1]) + 0.5) / SIZE[1] - 0.5) * np.pi
    columns = (0.5 - (np.arange(SIZE[0]) + 0.5) / SIZE[0]) * 2.0 * np.pi
    r, c = np.meshgrid(rows, columns, indexing="ij")
    e = math.radians(elevation)
    mu = np.cos(r) * np.cos(c) * math.cos(e) + np.sin(r) * math.sin(e)
    return np.maximum(np.sin(r), HORIZON), np.arccos(np.clip(mu, -1.0, 1.0))


def fit(radiance: np.ndarray, cos: np.ndarray, gamma: np.ndarray) -> tuple[np.ndarray, float]:
    """(numbers, root mean square of the relative error above the horizon) for one channel."""
    from gi_addon.materials.hosek import HOSEK_SLANT, horizon_basis
    from gi_addon.materials.sky import perez

    scale = max(float(radiance.mean()), 1e-12)
    target = radiance.ravel() / scale
    weight = (cos.ravel() > HORIZON) / np.maximum(target, 0.05)

    def residual(p: np.ndarray) -> np.ndarray:
        return (perez(p, 1.0 / (cos + HOSEK_SLANT), gamma).ravel() - target) * weight

    best = np.array(START)
    error, damping = residual(best), 1e-2
    for _ in range(60):
        step = 1e-5 * (1.0 + np.abs(best))
        jacobian = np.stack([(residual(best + step * d) - error) / step[k] for k, d in enumerate(np.eye(6))], axis=1)
        normal = jacobian.T @ jacobian
        delta = np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-9), -jacobian.T @ error)
        trial = best + delta
        trial[[2, 4]] = np.clip(trial[[2, 4]], -40.0, -1e-3)  # glows fade away from the horizon and from the sun
        after = residual(trial)
        if np.isfinite(after).all() and after @ after < error @ error:
            best, error, damping = trial, after, max(damping * 0.3, 1e-9)
        else:
            damping = min(damping * 4.0, 1e9)
    below = cos <= HORIZON
    ground = np.linalg.lstsq(horizon_basis(gamma[below]), radiance[below], rcond=None)[0]
    numbers = np.array([best[0] * scale, *best[1:], *ground])
    return numbers, float(np.sqrt(np.sum(error**2) / np.count_nonzero(weight)))


def main() -> None:
    import bpy

    from gi_addon.host.compat import node_tree
    from gi_addon.host.cycles import Reference, set_up

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    set_up(scene, Reference(0, 4))
    scene.world = bpy.data.worlds.new("Sky")
    tree = node_tree(scene.world)
    sky = tree.nodes.new("ShaderNodeTexSky")
    sky.sky_type = "HOSEK_WILKIE"
    tree.links.new(sky.outputs[0], tree.nodes["Background"].inputs["Color"])
    data = bpy.data.cameras.new("Camera")
    data.type = "PANO"
    data.panorama_type = "EQUIRECTANGULAR"
    camera = bpy.data.objects.new("Camera", data)
    camera.rotation_euler = (math.radians(90.0), 0.0, math.radians(-90.0))  # towards +X, +Z up
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = *SIZE, 100
    numbers = np.zeros((len(TURBIDITIES), len(ELEVATIONS), len(ALBEDOS), 3, 10))
    errors = np.zeros(numbers.shape[:4])
    for i, turbidity in enumerate(TURBIDITIES):
        for j, elevation in enumerate(ELEVATIONS):
            for k, albedo in enumerate(ALBEDOS):
                image, at = panorama(scene, sky, turbidity, elevation, albedo), angles(elevation)
                for channel in range(3):
                    numbers[i, j, k, channel], errors[i, j, k, channel] = fit(image[..., channel], *at)
        print(f"turbidity {turbidity:g}: relative error {errors[i].mean():.3f}, worst {errors[i].max():.3f}", flush=True)
    write(numbers)


def write(numbers: np.ndarray) -> None:
    """The numbers as a module."""
    lines = [
        "# SPDX-License-Identifier: GPL-3.0-or-later",
        '"""Written by scripts/fit_sky.py: rows by turbidity, elevation, albedo and channel, see hosek.py."""',
        "", f"TURBIDITIES = {TURBIDITIES}", f"ELEVATIONS = {ELEVATIONS}  # degrees", f"ALBEDOS = {ALBEDOS}", "NUMBERS = (",
    ]  # fmt: skip
    lines += ["    (" + ", ".join(f"{v:.5g}" for v in row) + ")," for row in numbers.reshape(-1, 10)]
    (ROOT / "gi_addon" / "materials" / "hosek_numbers.py").write_text("\n".join([*lines, ")", ""]))


if __name__ == "__main__":
    main()
