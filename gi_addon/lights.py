# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights as one point each per sub-frame, and the maps that show what that point sees.

A light with an extent (sun disc, sphere, area, emissive mesh, world) is another point of itself in every sub-frame, by
the low-discrepancy sequence. Averaged over sub-frames that gives soft shadows and area light without a method of its
own; with one sub-frame every light is its centre.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass, field

import numpy as np

from . import atlas
from .emitters import Emitters
from .focus import Focus
from .gpu_types import (
    LIGHT,
    LIGHT_AREA,
    LIGHT_FLAG_BOUNCE,
    LIGHT_FLAG_SHADOW,
    LIGHT_MESH,
    LIGHT_POINT,
    LIGHT_SPOT,
    LIGHT_SUN,
    LIGHT_VIEW,
    LIGHT_WORLD,
    MAP_BOUNCE,
    MAP_SHADOW,
    SHAPE_ELLIPSE,
    SHAPE_RECTANGLE,
)
from .scene import EVERY_SET, Light
from .sequence import sobol_2d
from .world_map import WorldMap

# A single perspective map serves spots up to this full angle; its edge texels then see 4 × the solid angle share
# of the centre's, (1 + tan²)^1.5 at 60°/2 … beyond it the cube's faces are the better map.
_WIDEST_SINGLE_VIEW = np.radians(120.0)
# Nearest distance a light's map shows, as a share of the farthest: a 24-bit depth buffer then resolves 1/16000 there.
_NEAR_SHARE = 1e-3
# Texels around a shadow tile that its filter may read: bilinear footprint plus one.
_GUARD_TEXELS = 2.0

_FACES = np.array([
    # axis_x, axis_y, axis_z of the six faces; the first is +z, and the first five face the upper half space.
    [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    [[0, 1, 0], [0, 0, 1], [1, 0, 0]],
    [[0, 1, 0], [0, 0, 1], [-1, 0, 0]],
    [[1, 0, 0], [0, 0, 1], [0, 1, 0]],
    [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
    [[1, 0, 0], [0, 1, 0], [0, 0, -1]],
], "f8")  # fmt: skip


@dataclass
class Source:
    """Something that shines: a Light, a share of the world, or of the emissive meshes."""

    kind: int
    seed: int
    light: Light | None = None
    views: int = 0
    soft: bool = False
    # World and meshes: this source draws points `index` of every `count` per sub-frame.
    index: int = 0
    count: int = 1
    # Of the sequences that are the light's own, whatever else shines.
    salt: int = 0
    # A second shadow map, of the focus alone, where a backdrop would leave the first one coarse.
    near: bool = False


@dataclass
class Maps:
    """Tiles of all sources' views in one atlas."""

    sizes: list[int]
    corners: list[tuple[int, int]]
    size: tuple[int, int]
    first: list[int]  # per source, into the tile list; -1 without views


@dataclass
class Sample:
    """All sources at one sub-frame: ``lights`` (LIGHT), ``views`` (LIGHT_VIEW) and their ``clip_from_world``."""

    lights: np.ndarray
    views: np.ndarray
    clip_from_world: np.ndarray


@dataclass
class LightRig:
    """The scene's sources, where their shadow and bounce maps lie, and what they are at a sub-frame."""

    sources: list[Source]
    focus: Focus
    world: WorldMap | None
    emitters: Emitters
    shadow: Maps
    bounce: Maps
    notes: list[str] = field(default_factory=list)
    direct_world: WorldMap | None = None  # the same world, its directions drawn as suits direct light

    @property
    def bounds(self) -> np.ndarray:
        """Box (2, 3) of everything drawn, m."""
        return self.focus.whole

    @property
    def region(self) -> np.ndarray:
        """Box (2, 3) of what grids and bounce maps are for, m."""
        return self.focus.region

    def moves(self, index: int, *, bounce: bool) -> bool:
        """Whether source ``index`` is another point in each sub-frame. Suns, spheres and discs bounce from their
        centre: where their light lands hardly depends on the point."""
        source = self.sources[index]
        return source.soft and not (bounce and source.kind in (LIGHT_SUN, LIGHT_POINT, LIGHT_SPOT))

    def any_moves(self, maps: Maps, *, bounce: bool) -> bool:
        """Whether any view in ``maps`` differs between sub-frames."""
        return any(maps.first[i] >= 0 and self.moves(i, bounce=bounce) for i in range(len(self.sources)))

    def sample(self, subframe: int, subframes: int, *, bounce: bool) -> Sample:
        """Every source's point at ``subframe`` of ``subframes``, with its views into the bounce or shadow maps."""
        maps = self.bounce if bounce else self.shadow
        lights = np.zeros(len(self.sources), LIGHT)
        views: list[np.ndarray] = []
        clips: list[np.ndarray] = []
        for i, source in enumerate(self.sources):
            if source.kind in (LIGHT_WORLD, LIGHT_MESH):
                u = sobol_2d(subframe * source.count + source.index, source.seed)
            elif subframes == 1 or not self.moves(i, bounce=bounce):
                u = np.array([0.5, 0.5])
            else:
                u = sobol_2d(subframe, source.seed)
            self._place(lights[i], source, u, subframes, bounce=bounce)
            lights[i]["first_view"] = maps.first[i]
            if maps.first[i] < 0:
                lights[i]["views"] = 0
                continue
            faces = list(self._faces(lights[i], source))
            # What the map covers across; of two maps of one light, the narrow one comes first.
            spans = [self.region if bounce else self.bounds] * len(faces)
            if source.near and not bounce:
                faces, spans = faces * 2, [self.focus.core, *spans]
                lights[i]["views"] = len(faces)
            for face, ((rows, perspective), span) in enumerate(zip(faces, spans, strict=True)):
                tile = maps.first[i] + face
                view = np.zeros((), LIGHT_VIEW)
                guard = 1.0 + 2.0 * _GUARD_TEXELS / maps.sizes[tile]
                clips.append(self._fill_view(view, lights[i], rows, perspective, guard, span))
                view["rect"] = (*maps.corners[tile], maps.sizes[tile], maps.sizes[tile])
                view["light"] = i
                view["map"] = MAP_BOUNCE if bounce else MAP_SHADOW
                views.append(view)
        return Sample(
            lights,
            np.array(views, LIGHT_VIEW) if views else np.zeros(0, LIGHT_VIEW),
            np.array(clips, "f4").reshape(-1, 4, 4),
        )

    def direct_sample(self, subframe: int, subframes: int) -> tuple[np.ndarray, np.ndarray]:
        """(lights, views) for direct light: shadow maps, and bounce maps for sources that have no shadow map of their
        own because the bounce map is one."""
        shadow = self.sample(subframe, subframes, bounce=False)
        lights = shadow.lights.copy()
        shared = [i for i in range(len(self.sources)) if self.shares(i)]
        if not shared:
            return lights, shadow.views
        bounce = self.sample(subframe, subframes, bounce=True)
        for i in shared:
            lights[i]["first_view"] = len(shadow.views) + self.bounce.first[i]
            lights[i]["views"] = self.sources[i].views
        return lights, np.concatenate([shadow.views, bounce.views])

    def shares(self, index: int) -> bool:
        """Whether the source's bounce map serves as its shadow map."""
        return self.shadow.first[index] < 0 <= self.bounce.first[index] and self.casts_shadow(index)

    def beyond(self, view: int, light: int) -> np.ndarray | None:
        """The box (2, 3) whose contents shadow map ``view`` of source ``light`` leaves out: what shades nothing outside the
        narrow map of the same source. Coarse texels would."""
        wide = self.sources[light].near and view > self.shadow.first[light]
        return self.focus.core if wide else None

    def casts_shadow(self, index: int) -> bool:
        light = self.sources[index].light
        return light is None or light.use_shadow

    @property
    def linked(self) -> bool:
        """Whether some light lights only some objects."""
        return any(s.light is not None and s.light.receivers != EVERY_SET for s in self.sources)

    def lights_kind(self, index: int, receivers: int) -> bool:
        """Whether source ``index`` lights objects of set ``receivers``."""
        light = self.sources[index].light
        return light is None or bool(light.receivers >> receivers & 1)

    def blocked_by(self, index: int, blockers: int) -> bool:
        """Whether objects of set ``blockers`` shade source ``index``."""
        light = self.sources[index].light
        return light is None or bool(light.blockers >> blockers & 1)

    # -- sources -------------------------------------------------------------------------------------------------

    def _place(self, out: np.ndarray, source: Source, u: np.ndarray, subframes: int, *, bounce: bool) -> None:
        out["kind"] = source.kind
        out["views"] = source.views
        out["flags"] = LIGHT_FLAG_BOUNCE
        out["diffuse"] = out["glossy"] = 1.0
        out["salt"] = source.salt
        out["receivers"] = EVERY_SET
        light = source.light
        if source.kind == LIGHT_WORLD:
            world = self.world if bounce or self.direct_world is None else self.direct_world
            direction, weight, pdf = world.sample(u[None])
            out["axis_ws"] = -direction[0]
            out["emission"] = weight[0] / source.count
            out["patch_radius"] = np.sqrt(1.0 / (np.pi * max(pdf[0], 1e-12) * source.count * subframes))
            out["flags"] |= LIGHT_FLAG_SHADOW
            out["position_ws"] = out["center_ws"] = self.bounds.mean(axis=0)
            return
        if source.kind == LIGHT_MESH:
            self._place_on_mesh(out, source, u, subframes)
            return
        out["diffuse"], out["glossy"] = light.visible_diffuse, light.visible_glossy
        out["falloff"], out["falloff_smooth"] = light.falloff, light.falloff_smooth
        out["receivers"] = light.receivers
        matrix = light.matrix
        center = matrix[:3, 3]
        x, y, z = (_unit(matrix[:3, k]) for k in range(3))
        out["axis_ws"], out["u_ws"], out["v_ws"] = -z, x, y
        out["position_ws"] = out["center_ws"] = center
        out["emission"] = light.emission
        out["flags"] |= LIGHT_FLAG_SHADOW if light.use_shadow else 0
        disc = _disc(u)
        share = 1.0 / np.sqrt(subframes)
        if source.kind == LIGHT_SUN:
            half = 0.5 * light.angle
            # Uniform over the disc's projection, where a direction at angle α from the axis stands for dω = dA/cosα:
            # all of them together then light a facing surface by the sun's strength exactly.
            planar = disc * np.sin(half)
            cos = float(np.sqrt(max(0.0, 1.0 - planar @ planar)))
            out["axis_ws"] = -_unit(planar[0] * x + planar[1] * y + cos * z)
            out["emission"] = light.emission / max(cos, 1e-3)
            out["patch_radius"] = half * share
            return
        if source.kind in (LIGHT_POINT, LIGHT_SPOT):
            out["emission"] = light.emission / (4.0 * np.pi)
            out["patch_radius"] = light.radius * share
            out["soft_radius2"] = light.radius**2 if light.soft_falloff else 0.0
            if light.radius > 0.0 and (disc != 0).any():
                # Cycles shows soft lights as a disc facing the shaded point. One point serves all points here, so it
                # is drawn from the ball whose projection onto any plane has the disc's spread about its centre: the
                # sphere of radius r √3/2 has variance r²/4 per axis, as the disc has.
                out["position_ws"] = center + light.radius * np.sqrt(0.75) * _sphere(u)
            if source.kind == LIGHT_SPOT:
                cos = np.cos(0.5 * light.spot_size)
                out["spot_cos"] = cos
                out["spot_scale"] = 1.0 / max((1.0 - cos) * light.spot_blend, 1e-6)
                # A scaled or sheared spot shines through an ellipse: directions are measured in its own frame.
                out["u_ws"], out["v_ws"], out["axis_ws"] = _own_frame(matrix)
            return
        # Area: width and height come with the object's scale.
        size_u, size_v = light.size[0] * np.linalg.norm(matrix[:3, 0]), light.size[1] * np.linalg.norm(matrix[:3, 1])
        ellipse = light.shape in ("DISK", "ELLIPSE")
        area = size_u * size_v * (np.pi / 4.0 if ellipse else 1.0)
        half_spread = 0.5 * min(max(light.spread, 0.0), np.pi)
        out["shape"] = SHAPE_ELLIPSE if ellipse else SHAPE_RECTANGLE
        out["u_ws"], out["v_ws"] = x * size_u, y * size_v
        offset = 0.5 * disc if ellipse else u - 0.5
        out["position_ws"] = center + out["u_ws"] * offset[0] + out["v_ws"] * offset[1]
        # Radiance Φ/(πA) × area: intensity on the axis. The spread's profile is normalised to keep Φ.
        out["emission"] = light.emission / np.pi
        out["spread_tan"], out["spread_scale"] = spread_profile(half_spread)
        out["patch_radius"] = np.sqrt(max(area, 0.0) / np.pi) * share

    def _place_on_mesh(self, out: np.ndarray, source: Source, u: np.ndarray, subframes: int) -> None:
        cdf = self.emitters.cumulative
        index = int(np.searchsorted(cdf, u[0], side="right").clip(0, len(cdf) - 1))
        low = cdf[index - 1] if index else 0.0
        # The rest of the number that chose the triangle is as good as new.
        first = np.sqrt((u[0] - low) / max(cdf[index] - low, 1e-12))
        a, b, c = self.emitters.corners[index]
        out["position_ws"] = a * (1.0 - first) + b * first * (1.0 - u[1]) + c * first * u[1]
        # The triangle itself: what it lights from behind it also hides.
        out["axis_ws"], out["center_ws"], out["u_ws"], out["v_ws"] = _unit(np.cross(b - a, c - a)), a, b - a, c - a
        area = 0.5 * np.linalg.norm(np.cross(b - a, c - a))
        share = area / (self.emitters.share[index] * source.count)
        out["emission"] = self.emitters.radiance[index] * share
        out["spread_tan"], out["spread_scale"] = spread_profile(0.5 * np.pi)
        out["flags"] |= LIGHT_FLAG_SHADOW
        out["patch_radius"] = np.sqrt(share / (np.pi * subframes))

    # -- views ---------------------------------------------------------------------------------------------------

    def _faces(self, light: np.ndarray, source: Source):
        """(axis_x, axis_y, axis_z) rows and perspective of each of a source's views."""
        if source.kind in (LIGHT_SUN, LIGHT_WORLD):
            z = light["axis_ws"].astype("f8")
            x, y = _frame(z)
            yield np.stack([x, y, z]), False
        elif source.kind == LIGHT_SPOT and source.views == 1:
            rotation = np.stack([_unit(light["u_ws"]), _unit(light["v_ws"]), _unit(light["axis_ws"])]).astype("f8")
            # The scaled frame of u and v is narrower in the world where it is longer.
            tan = np.sqrt(max(1.0 / light["spot_cos"] ** 2 - 1.0, 1e-12))
            rotation[0] *= tan / max(np.linalg.norm(light["u_ws"]), 1e-6)
            rotation[1] *= tan / max(np.linalg.norm(light["v_ws"]), 1e-6)
            yield rotation, True
        else:
            if source.kind == LIGHT_POINT:
                basis = np.eye(3)
            else:
                z = light["axis_ws"].astype("f8")
                x, y = _frame(z)
                basis = np.stack([x, y, z])
            for face in _FACES[: source.views]:
                yield face @ basis, True

    def _fill_view(self, view, light, rows: np.ndarray, perspective: bool, guard: float, span: np.ndarray) -> np.ndarray:
        """Fill a LIGHT_VIEW; returns its clip_from_world (4, 4) for drawing into the guarded tile. ``span`` is the box
        (2, 3) that parallel light's map covers across; along the light all maps hold everything."""
        low, high = self.bounds
        center, half = (low + high) / 2.0, (high - low) / 2.0
        rows = rows.copy()
        if perspective:
            origin = light["position_ws"].astype("f8")
            far = float(np.linalg.norm(np.abs(origin - center) + half)) * 1.001
            nearest = float(np.linalg.norm(np.maximum(np.abs(origin - center) - half, 0.0)))
            middle, reach = self.region.mean(axis=0), (self.region[1] - self.region[0]) / 2.0
            share = _NEAR_SHARE * float(np.linalg.norm(np.abs(origin - middle) + reach))
            near = max(min(share, _NEAR_SHARE * far), 0.5 * nearest / np.sqrt(3.0))
            far = max(far, near * 2.0, 1e-12)
        else:
            extent = np.abs(rows) @ half * 1.001 + 1e-9 * (1.0 + np.abs(center).max())
            middle = rows @ center
            if span is not self.bounds:
                extent[:2] = (np.abs(rows) @ (span[1] - span[0]) / 2.0 * 1.001)[:2] + 1e-9 * (1.0 + np.abs(center).max())
                middle[:2] = (rows @ span.mean(axis=0))[:2]
            origin = rows.T @ np.array([middle[0], middle[1], middle[2] - extent[2]])
            rows[0] *= extent[0]
            rows[1] *= extent[1]
            near, far = 0.0, float(2.0 * extent[2])
        view["origin_ws"], view["perspective"] = origin, float(perspective)
        view["axis_x"], view["axis_y"], view["axis_z"] = rows
        view["near"], view["far"], view["guard"] = near, far, guard
        clip = np.zeros((4, 4))
        for k in range(2):
            clip[k, :3] = rows[k] / (rows[k] @ rows[k]) / guard
        depth = np.append(rows[2], -rows[2] @ origin)
        clip[:2, 3] = -clip[:2, :3] @ origin
        if perspective:
            clip[2] = depth * (far + near) / (far - near)
            clip[2, 3] -= 2.0 * far * near / (far - near)
            clip[3] = depth
        else:
            clip[2] = depth * 2.0 / (far - near)
            clip[2, 3] -= (far + near) / (far - near)
            clip[3, 3] = 1.0
        return clip


def spread_profile(half_spread: float) -> tuple[float, float]:
    """(tan, scale) of an area light's spread: radiance × max(tan − tanθ, 0) · scale, of the same flux as without.

    ∫ cosθ (1 − tanθ/t) dω over the cone is π (1 − a/tan a) for half angle a, whence scale = 1/(t − a); half a turn is
    no spread at all, written as tan = −1.
    """
    if half_spread >= 0.5 * np.pi - 1e-4:
        return -1.0, 1.0
    half_spread = max(half_spread, np.radians(0.5))  # Blender's least spread is 1°
    tan = np.tan(half_spread)
    return float(tan), float(1.0 / (tan - half_spread))


def build_rig(
    lights: list[Light],
    focus: Focus,
    *,
    world: WorldMap | None,
    world_samples: int,
    emitters: Emitters,
    emitter_samples: int,
    area_lights: bool,
    shadows: bool,
    bounces: bool,
    shadow_resolution: int,
    bounce_resolution: int,
    world_resolution: int,
    tinted: bool = False,
    texel_budget: int = 1 << 25,
) -> LightRig:
    """Collect what shines and lay out its maps. Lights without power, or with a broken transform, are left out with a
    note. Where see-through surfaces are ``tinted`` every light has a shadow map of its own, which knows the tint."""
    sources: list[Source] = []
    notes: list[str] = []
    for index, light in enumerate(lights):
        if not np.isfinite(light.matrix).all() or not np.isfinite(light.emission).all():
            notes.append(f"light {light.name} is left out: its transform or power is not a number")
            continue
        if not (np.asarray(light.emission) != 0.0).any():
            continue
        seed = 100 + index
        if light.kind == "SUN":
            sources.append(Source(LIGHT_SUN, seed, light, 1, light.angle > 0.0))
        elif light.kind == "POINT":
            sources.append(Source(LIGHT_POINT, seed, light, 6, light.radius > 0.0))
        elif light.kind == "SPOT":
            # A map's axes are at right angles; a cone that is sheared by its parents has none.
            single = light.spot_size <= _WIDEST_SINGLE_VIEW and not _sheared(light.matrix)
            sources.append(Source(LIGHT_SPOT, seed, light, 1 if single else 5, light.radius > 0.0))
        elif light.kind == "AREA" and area_lights:
            sources.append(Source(LIGHT_AREA, seed, light, 5, True))
    if world is not None and not world.black:
        sources += [Source(LIGHT_WORLD, 11, None, 1, True, k, world_samples) for k in range(world_samples)]
    if len(emitters) and area_lights:
        sources += [Source(LIGHT_MESH, 12, None, 6, True, k, emitter_samples) for k in range(emitter_samples)]

    for source in sources:
        source.near = focus.narrow and source.kind in (LIGHT_SUN, LIGHT_WORLD)
        source.salt = source.seed if source.light is None else zlib.crc32(source.light.name.encode())
    radius = 0.5 * float(np.linalg.norm(focus.region[1] - focus.region[0]))
    coarser = _coarser_maps({s.seed: _power(s.light, radius) for s in sources if s.light is not None})

    def tiles(resolution: int, used, *, bounce: bool) -> Maps:
        sizes: list[int] = []
        first: list[int] = []
        for source in sources:
            if not used(source):
                first.append(-1)
                continue
            first.append(len(sizes))
            base = resolution
            if source.kind == LIGHT_WORLD:
                # The sky's bounce needs no detail: its many directions blur it. Materials are dear to draw, depth is not.
                base = min(resolution, world_resolution // 2 if bounce else world_resolution)
            if bounce and source.light is not None:
                base = max(16, base >> coarser[source.seed])
            size = base if source.views == 1 else base // 2
            sizes += [max(16, size)] * (source.views + int(source.near and not bounce))
        while sum(s * s for s in sizes) > texel_budget and max(sizes) > 16:
            sizes = [max(16, s // 2) for s in sizes]
        corners, size = atlas.pack(sizes, power_of_two=True)
        return Maps(sizes, corners, size, first)

    def bounced(source: Source) -> bool:
        return bounces and (source.light is None or source.light.visible_diffuse)

    def own_shadow_map(source: Source) -> bool:
        if not shadows or (source.light is not None and not source.light.use_shadow):
            return False
        # What is drawn anew in each sub-frame anyway, at the very point that direct light comes from, is drawn once if
        # it is fine enough.
        drawn_anew = source.kind in (LIGHT_AREA, LIGHT_MESH) and bounced(source)
        coarse = source.light is not None and coarser[source.seed] > 0
        # What the light lights but is not shaded by is in its bounce map too.
        linked = source.light is not None and source.light.blockers != EVERY_SET
        return not (drawn_anew and bounce_resolution >= shadow_resolution and not coarse and not linked and not tinted)

    return LightRig(
        sources, focus, world, emitters,
        tiles(shadow_resolution, own_shadow_map, bounce=False), tiles(bounce_resolution, bounced, bounce=True),
        notes,
    )  # fmt: skip


# As many lamps have bounce maps of full resolution, whatever they shine; more share those texels by their power.
_FULL_MAPS = 4


def _power(light: Light, radius: float) -> float:
    """Luminous power that a lamp sends into a scene of ``radius`` m, W."""
    power = float(np.abs(light.emission) @ np.array([0.2126, 0.7152, 0.0722]))
    if light.kind == "SUN":
        return power * np.pi * radius**2
    return power * (0.5 * (1.0 - np.cos(0.5 * light.spot_size)) if light.kind == "SPOT" else 1.0)


def _coarser_maps(powers: dict[int, float]) -> dict[int, int]:
    """By how many powers of two each lamp's bounce map is coarser: a texel of any stands for as much flux, and all maps
    together have the texels of ``_FULL_MAPS``."""
    total = sum(powers.values())
    if len(powers) <= _FULL_MAPS or not total > 0.0:
        return dict.fromkeys(powers, 0)
    # Half the side is a fourth of the texels.
    steps = {k: -0.5 * np.log2(max(_FULL_MAPS * p / total, 1e-6)) for k, p in powers.items()}
    return {k: int(np.clip(np.floor(v), 0, 5)) for k, v in steps.items()}


def _unit(v: np.ndarray) -> np.ndarray:
    v = np.asarray(v, "f8")
    length = np.linalg.norm(v)
    return v / length if length > 0 else np.array([0.0, 0.0, 1.0])


def _own_frame(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What a direction's products with are its coordinates x, y and −z in the frame of ``matrix`` (4, 4), to a scale: the
    rows of its inverse, the last one of unit length."""
    axes = matrix[:3, :3].copy()
    flat = np.linalg.norm(axes, axis=0) <= 0.0
    axes[:, flat] = np.eye(3)[:, flat]
    rows = np.linalg.pinv(axes)
    rows /= max(float(np.linalg.norm(rows[2])), 1e-30)
    return rows[0], rows[1], -rows[2]


def _sheared(matrix: np.ndarray) -> bool:
    """Whether the axes of ``matrix`` (4, 4) are not at right angles, to what rounding leaves."""
    axes = np.stack([_unit(matrix[:3, k]) for k in range(3)])
    return bool(np.abs(axes @ axes.T - np.eye(3)).max() > 1e-4)


def _frame(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors across z; a frame that follows z without a seam in the half space where lights point."""
    z = _unit(z)
    helper = np.array([1.0, 0.0, 0.0]) if abs(z[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    x = _unit(helper - z * (helper @ z))
    return x, np.cross(z, x)


def _disc(u: np.ndarray) -> np.ndarray:
    """Concentric map of the unit square to the unit disc; (½, ½) is the centre."""
    p = 2.0 * np.asarray(u) - 1.0
    if p[0] == 0.0 and p[1] == 0.0:
        return np.zeros(2)
    if abs(p[0]) > abs(p[1]):
        r, phi = p[0], np.pi / 4.0 * p[1] / p[0]
    else:
        r, phi = p[1], np.pi / 2.0 - np.pi / 4.0 * p[0] / p[1]
    return r * np.array([np.cos(phi), np.sin(phi)])


def _sphere(u: np.ndarray) -> np.ndarray:
    """Uniform on the unit sphere."""
    z = 1.0 - 2.0 * u[1]
    r = np.sqrt(max(0.0, 1.0 - z * z))
    return np.array([r * np.cos(2 * np.pi * u[0]), r * np.sin(2 * np.pi * u[0]), z])
