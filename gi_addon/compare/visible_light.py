# SPDX-License-Identifier: GPL-3.0-or-later
"""How much of a scene's bounced light a screen-space technique can know of: what lights the visible surfaces, by whether the
surface that sends it is in the picture (stability test 1's ``g = visible lit share``, for any scene)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..gl import GL
from ..gpu_types import VPL
from ..scene import Scene
from ..settings import Settings
from .studio import Studio, settings_for

# Senders: virtual lights of reflective shadow maps, SUBFRAMES sets of them, each with new directions of the world's light.
SUBFRAMES, SENDERS = 16, 64
# More than this share missing is worth a word: test 1 allows no more.
NOTABLE = 0.03
WIDE = (0.5, 3)  # margin and layers


@dataclass(frozen=True)
class VisibleLight:
    """Shares of the light that lit surfaces send to the visible ones, by where they are: ``known`` to the technique's layers of
    depth, ``hidden`` behind something within what is drawn, ``outside`` it. They sum to 1; all 0 where nothing is lit."""

    known: float
    hidden: float
    outside: float

    def text(self) -> str:
        """For people."""
        if self.known + self.hidden + self.outside <= 0.0:
            return "no lit surface faces what the camera sees"
        return (
            f"lit surfaces off screen: {100 * (self.hidden + self.outside):.0f} % of the bounced light comes from them "
            f"({100 * self.outside:.0f} % from outside the picture, {100 * self.hidden:.0f} % from behind something)"
        )


def visible_light(scene: Scene, settings: Settings, size: tuple[int, int] = (160, 90)) -> VisibleLight:
    """Measure it for ``settings`` of SSDO (their margin and layers count).

    Light per sender is its flux times the mean form factor to the picture's surfaces, Σ cosθ_p cosθ_x / (d² + A/π), with what
    is in the way left out of account. A sender is known if a layer's plane within a pixel of its place in the picture passes it
    by no more than a pixel's width. Raises RenderError as rendering does.
    """
    chosen = settings.copy()
    for path, value in (("technique", "SSDO"), ("use_indirect_diffuse", True), ("gather_scale", 8)):
        chosen.set(path, value)
    chosen.set("bounces", 1)
    chosen.set("ssdo.samples", 8)  # the planes are wanted, not the light
    with Studio() as studio:
        senders, weight = _senders(studio, scene)
        if not len(senders):
            return VisibleLight(0.0, 0.0, 0.0)
        studio.render(scene, chosen, ("Diffuse Indirect", "Normal"), size, subframes=1)
        screen = studio.call(lambda gl: _Screen(gl, studio.renderer.frame, chosen.ssdo.layers))
    weight = weight * screen.form_factors(senders)
    if weight.sum() <= 0.0:
        return VisibleLight(0.0, 0.0, 0.0)
    inside, known = screen.knows(senders)
    weight /= weight.sum()
    return VisibleLight(float(weight[known].sum()), float(weight[inside & ~known].sum()), float(weight[~inside].sum()))


def _senders(studio: Studio, scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Virtual lights (N,) as VPL of what one bounce lights, and their luminous flux (N,), W."""
    settings = settings_for("RSM", rsm__samples=SENDERS, rsm__resolution=256, use_ao=False, use_glossy=False)

    def job(gl: GL) -> list[np.ndarray]:
        renderer, found = studio.renderer, []
        renderer.begin(scene, settings, ("Diffuse Indirect",), resolution=(16, 9), subframes=SUBFRAMES)
        if "vpls" not in renderer.frame.resources:
            return [np.zeros(0, VPL)]
        for index in range(SUBFRAMES):
            renderer.subframe(index)
            found.append(np.frombuffer(renderer.frame.resources["vpls"].read(), VPL)[:SENDERS].copy())
        return found

    senders = np.concatenate(studio.call(job))
    flux = senders["flux"].astype("f8") @ (0.2126, 0.7152, 0.0722)
    return senders[flux > 0.0], flux[flux > 0.0]


class _Screen:
    """What one sub-frame of SSDO knows: its planes, and the surfaces that the picture shows."""

    def __init__(self, gl: GL, frame, layers: int) -> None:
        width, height = frame.facts.resolution
        names = ("ssdo.planes", *(f"ssdo.planes.{k}" for k in range(2, layers + 1)))
        self.planes = [_read(frame, name, 4).astype("f8") for name in names]
        self.view = {name: frame.view[name].astype("f8") for name in frame.view.dtype.names}
        margin = frame.facts.margin
        self.size = np.array([width, height])
        x, y = np.meshgrid(np.arange(margin, width - margin), np.arange(margin, height - margin))
        depth = _read(frame, "gbuffer.depth", 2)[y, x, 0].astype("f8")
        seen = depth > 0.0
        u, v = (x[seen] + 0.5) / width, (y[seen] + 0.5) / height
        self.points = self._ray("origin", u, v) + self._ray("direction", u, v) * depth[seen][:, None]
        self.normals = _normals(_read(frame, "gbuffer.normal", 4)[y[seen], x[seen], :2])

    def _ray(self, what: str, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        return self.view[f"{what}_ws"] + u[:, None] * self.view[f"{what}_u"] + v[:, None] * self.view[f"{what}_v"]

    def form_factors(self, senders: np.ndarray) -> np.ndarray:
        """Mean over the picture of what each sender's (N,) watt brings, up to a factor common to all."""
        out = np.zeros(len(senders))
        every = max(1, len(self.points) // 1000)  # a thousand receivers tell the mean to a few per cent
        for p, n in zip(self.points[::every], self.normals[::every], strict=True):
            way = senders["position_ws"] - p
            d2 = np.sum(way**2, axis=1)
            here = np.maximum(way @ n, 0.0)
            there = np.maximum(-np.sum(way * senders["normal_ws"], axis=1), 0.0)
            out += here * there / np.maximum(d2 * (d2 + senders["area"] / np.pi), 1e-30)
        return out

    def knows(self, senders: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(N,) whether a sender lies within what is drawn, and whether a layer shows it there from its front."""
        position = np.c_[senders["position_ws"].astype("f8"), np.ones(len(senders))]
        clip = position @ self.view["clip_from_world"]  # stored by columns
        w = np.maximum(clip[:, 3], 1e-30)
        at = np.clip(clip[:, :2] / w[:, None] * 0.5 + 0.5, -1.0, 2.0) * self.size
        inside = (clip[:, 3] > 0) & (at >= 0).all(axis=1) & (at < self.size).all(axis=1)
        depth = -(position @ self.view["view_from_world"])[:, 2]
        orthographic = self.view["orthographic"] > 0.5
        q = -depth if orthographic else 1.0 / np.maximum(depth, 1e-30)
        uv = at / self.size
        eye_side = np.sign(-np.sum(senders["normal_ws"] * self._ray("direction", uv[:, 0], uv[:, 1]), axis=1))
        # A pixel's width in nearness, and the most that a plane's own slope makes of it.
        wide = self.view["pixel_size"] * (1.0 if orthographic else q)
        known = np.zeros(len(senders), bool)
        for planes in self.planes:
            for dy in (-1, 0, 1):
                for dx in (-1, 0, 1):
                    pixel = np.floor(at).astype(int) + (dx, dy)
                    near = np.clip(pixel, 0, self.size - 1)
                    plane = planes[near[:, 1], near[:, 0]]
                    slope = plane[:, 1:3]
                    off = np.abs(plane[:, 0] + np.sum(slope * (at - near - 0.5), axis=1) - q)
                    close = off <= wide * np.sqrt(1.0 + np.sum((slope / wide[:, None]) ** 2, axis=1))
                    known |= inside & close & (plane[:, 3] == eye_side)
        return inside, known


def _read(frame, name: str, channels: int) -> np.ndarray:
    width, height = frame.facts.resolution
    texture = frame.resources[name]
    kind = np.float32 if texture.dtype == "f4" else np.uint16
    return np.frombuffer(texture.read(alignment=1), kind).reshape(height, width, channels)


def _normals(packed: np.ndarray) -> np.ndarray:
    """Unit vectors (N, 3) of octahedral 16-bit pairs (lib/view_lib.glsl)."""
    xy = packed.astype("f8") / 65535.0 * 2.0 - 1.0
    n = np.c_[xy, 1.0 - np.abs(xy).sum(axis=1)]
    fold = np.maximum(-n[:, 2:], 0.0)
    n[:, :2] -= np.where(n[:, :2] >= 0.0, fold, -fold)
    return n / np.linalg.norm(n, axis=1, keepdims=True)


def light_unseen(scene: Scene, settings: Settings, size: tuple[int, int] = (160, 90)) -> list[str]:
    """Lines for people: what a screen-space technique misses with these settings, and what a wider margin and more layers would
    leave; none of the second where that is little."""
    now = visible_light(scene, settings, size)
    lines = [now.text()]
    if now.hidden + now.outside > NOTABLE:
        wide = settings.copy()
        wide.set("ssdo.margin", max(WIDE[0], settings.ssdo.margin))
        wide.set("ssdo.layers", max(WIDE[1], settings.ssdo.layers))
        then = visible_light(scene, wide, size)
        missing = then.hidden + then.outside
        widest = f"ssdo.margin {wide.ssdo.margin:g} and ssdo.layers {wide.ssdo.layers}"
        lines.append(f"with {widest} it would be {100 * missing:.0f} %")
        if missing > 0.5:
            lines.append("another technique suits this scene: most of its light is where the camera does not look")
    return lines
