# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles without its shortcuts, as the reference (shared measurement protocol, §1), and Cycles as users run it."""

from __future__ import annotations

import contextlib
import os
import sys
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ..compare import exr
from ..outputs import OUTPUTS


@dataclass(frozen=True)
class Reference:
    """A way to run Cycles. ``bounces`` of diffuse and glossy light each, ``denoise`` with OpenImageDenoise; an
    unbiased reference has ``unbiased``: no clamps, thresholds or filters, a box pixel filter."""

    bounces: int
    samples: int
    seed: int = 1
    unbiased: bool = True
    denoise: bool = False


def set_up(scene: bpy.types.Scene, how: Reference) -> None:
    """Make ``scene`` render with Cycles as ``how`` says."""
    scene.render.engine = "CYCLES"
    c = scene.cycles
    c.device = "CPU"
    c.samples, c.seed = how.samples, how.seed
    c.use_adaptive_sampling = False
    c.use_denoising = how.denoise
    if how.denoise:
        c.denoiser = "OPENIMAGEDENOISE"
    if how.unbiased:
        c.sample_clamp_direct = c.sample_clamp_indirect = 0.0
        c.blur_glossy = 0.0
        c.light_sampling_threshold = 0.0
        c.use_light_tree = False
        c.pixel_filter_type = "BOX"
        c.filter_width = 1.0
    c.diffuse_bounces = c.glossy_bounces = how.bounces
    # R1 is one diffuse and one glossy bounce; the camera's own ray to a surface is not a bounce, its reflection is one.
    c.max_bounces = how.bounces + 1 if how.bounces == 1 else how.bounces
    c.transmission_bounces = max(how.bounces, 1)
    c.volume_bounces = how.bounces
    c.use_fast_gi = False


def render_passes(scene: bpy.types.Scene, names: Iterable[str]) -> dict[str, np.ndarray]:
    """Render the current frame with the scene's engine and return passes by name, row 0 at the bottom.

    Goes through a 32-bit multilayer EXR: Blender shows scripts no other way to a pass's pixels. The scene's output
    settings and pass switches are put back.
    """
    names = list(names)
    layer = bpy.context.view_layer if bpy.context.view_layer.name in scene.view_layers else scene.view_layers[0]
    with tempfile.TemporaryDirectory(prefix="quartet-") as folder, _restored(scene, layer):
        for output in OUTPUTS.values():
            owner, _, flag = output.flag.rpartition(".")
            target = getattr(layer, owner) if owner else layer
            if hasattr(target, flag):
                setattr(target, flag, output.name in names)
        image = scene.render.image_settings
        if hasattr(image, "media_type"):
            image.media_type = "MULTI_LAYER_IMAGE"
        image.file_format = "OPEN_EXR_MULTILAYER"
        image.color_depth, image.exr_codec = "32", "ZIP"
        scene.render.use_overwrite = True
        scene.render.use_file_extension = True
        scene.render.filepath = str(Path(folder) / "passes")
        if hasattr(scene.render, "use_compositing"):
            scene.render.use_compositing = scene.render.use_sequencer = False
        with quiet():
            bpy.ops.render.render(write_still=True, scene=scene.name)
        files = sorted(Path(folder).glob("passes*.exr"))
        if not files:
            raise RuntimeError(f"{scene.render.engine} wrote no picture of scene {scene.name}")
        return exr.read(files[0])


@contextlib.contextmanager
def _restored(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> Iterator[None]:
    render, image = scene.render, scene.render.image_settings
    saved = [(render, "filepath"), (render, "use_overwrite"), (render, "use_file_extension"),
             (render, "use_compositing"), (render, "use_sequencer"), (image, "media_type"), (image, "file_format"),
             (image, "color_depth"), (image, "exr_codec")]  # fmt: skip
    saved += [(layer, o.flag) for o in OUTPUTS.values() if "." not in o.flag]
    values = [(owner, name, getattr(owner, name)) for owner, name in saved if hasattr(owner, name)]
    try:
        yield
    finally:
        for owner, name, value in values:
            with contextlib.suppress(TypeError):  # an enum whose items hang on another one, restored before it
                setattr(owner, name, value)


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Keep Blender's own progress lines off the terminal, whatever the embedding program does with it."""
    if os.environ.get("QUARTET_VERBOSE"):
        yield
        return
    sys.stdout.flush()
    saved = os.dup(1)
    # Blender's C code writes to the descriptor, its Python side to sys.stdout.
    with open(os.devnull, "w") as nothing, contextlib.redirect_stdout(nothing):
        os.dup2(nothing.fileno(), 1)
        try:
            yield
        finally:
            os.dup2(saved, 1)
            os.close(saved)
