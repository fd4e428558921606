# SPDX-License-Identifier: GPL-3.0-or-later
"""The Sky Texture: sunlight scattered by an atmosphere, computed once into an image that the shader looks up.

Two models, as in Blender: single scattering (T. Nishita et al., "Display of the Earth Taking into Account Atmospheric
Scattering", SIGGRAPH 1993) at 21 wavelengths, and multiple scattering at four (F. García Liñán, "A Spectral Sky Model",
2024, with his fits). Radiances are in Blender's units: what a sky of strength 1 has.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .hosek import HOSEK_SLANT, horizon_basis, hosek_neighbours
from .spectrum import OBSERVER, REC709_FROM_XYZ

SIZE = (256, 128)  # of the image; half of the azimuths are computed, the sky is symmetric about its sun
_STEPS_SINGLE = 32
_STEPS_MULTIPLE = 64


@dataclass(frozen=True)
class Sky:
    """``pixels`` (H, W, 4) f4, linear Rec.709: azimuth from opposite the sun along u; v = ½ + ½ sign(e)√|e/90°| of elevation
    e. ``sun_low``, ``sun_high``: radiance (3,) of the sun's disc at its lowest and highest point, before limb darkening."""

    pixels: np.ndarray
    sun_low: np.ndarray
    sun_high: np.ndarray


def sky(params: Mapping[str, Any]) -> Sky | None:
    """The sky of a TEX_SKY node's settings; None for a model that is not known."""
    kind = params.get("sky_type", "MULTIPLE_SCATTERING")
    elevation, _ = sun_angles(params)
    dust = params.get("aerosol_density", params.get("dust_density", 1.0))
    densities = (params.get("air_density", 1.0), dust, params.get("ozone_density", 1.0))
    turbidity = float(params.get("turbidity", 2.2))
    if kind == "PREETHAM":
        return preetham(elevation, turbidity)
    if kind == "HOSEK_WILKIE":
        return hosek(elevation, turbidity, float(params.get("ground_albedo", 0.3)))
    size = max(float(params.get("sun_size", 0.00951)), 1e-6)
    altitude = float(params.get("altitude", 0.0))
    model = {"SINGLE_SCATTERING": _Single, "NISHITA": _Single, "MULTIPLE_SCATTERING": _Multiple}.get(kind)
    if model is None:
        return None
    return model(altitude, *(float(d) for d in densities)).sky(elevation, size)


def sun_angles(params: Mapping[str, Any]) -> tuple[float, float]:
    """(elevation in ±90°, rotation) of the sun, rad: an elevation beyond the zenith is seen from the other side."""
    if params.get("sky_type") in ("PREETHAM", "HOSEK_WILKIE"):
        x, y, z = params.get("sun_direction", (0.0, 0.0, 1.0))
        return float(np.arctan2(z, np.hypot(x, y))), float(np.arctan2(x, y)) % (2.0 * np.pi)
    elevation = (float(params.get("sun_elevation", 0.26)) + np.pi) % (2.0 * np.pi) - np.pi
    rotation = float(params.get("sun_rotation", 0.0))
    if abs(elevation) > 0.5 * np.pi:
        elevation, rotation = np.copysign(np.pi, elevation) - elevation, rotation + np.pi
    return float(elevation), rotation % (2.0 * np.pi)


def sun_direction(params: Mapping[str, Any]) -> np.ndarray:
    """Unit vector (3,) towards the sun, world space."""
    elevation, rotation = sun_angles(params)
    return np.array([np.cos(elevation) * np.sin(rotation), np.cos(elevation) * np.cos(rotation), np.sin(elevation)])


def sun_irradiance(found: Sky, params: Mapping[str, Any]) -> np.ndarray:
    """Irradiance (3,) of the disc on a surface facing it. Limb darkening 1 − 0.6 (1 − √(1 − r²)) averages to 0.8."""
    half = 0.5 * float(params.get("sun_size", 0.00951))
    mean = 0.5 * (found.sun_low + found.sun_high) * float(params.get("sun_intensity", 1.0))
    return mean * 0.8 * np.pi * np.sin(half) ** 2


def _rays() -> tuple[np.ndarray, np.ndarray]:
    """Elevations (H,) of the image's rows and azimuths (W/2,) of its first half; the sun's is π."""
    width, height = SIZE
    level = 2.0 * (np.arange(height) + 0.5) / height - 1.0
    return np.sign(level) * level**2 * 0.5 * np.pi, 2.0 * np.pi * (np.arange(width // 2) + 0.5) / width


def _directions(elevation: np.ndarray, azimuth: np.ndarray) -> np.ndarray:
    e, a = np.broadcast_arrays(elevation[:, None], azimuth[None])
    return np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)], -1)


def _image(xyz: np.ndarray) -> np.ndarray:
    """Half an image (H, W/2, 3) of XYZ to whole pixels."""
    return _mirrored(np.maximum(xyz @ REC709_FROM_XYZ.T, 0.0))


def _mirrored(rgb: np.ndarray) -> np.ndarray:
    """Half an image (H, W/2, 3) to whole pixels."""
    pixels = np.ones((SIZE[1], SIZE[0], 4), "f4")
    pixels[:, : SIZE[0] // 2, :3] = rgb
    pixels[:, SIZE[0] // 2 :, :3] = rgb[:, ::-1]
    return pixels


def _exit(position: np.ndarray, direction: np.ndarray, radius: float) -> np.ndarray:
    """Distance along rays from inside to a sphere about the origin."""
    b = (position * direction).sum(-1)
    return -b + np.sqrt(np.maximum(b * b - (position * position).sum(-1) + radius**2, 0.0))


def _hit(position: np.ndarray, direction: np.ndarray, radius: float) -> np.ndarray:
    """Distance along rays from outside to a sphere; inf where they miss."""
    b = (position * direction).sum(-1)
    d = b * b - (position * position).sum(-1) + radius**2
    return np.where((d >= 0.0) & (b < 0.0), -b - np.sqrt(np.maximum(d, 0.0)), np.inf)


class _Single:
    """Metres. Rayleigh, Mie and ozone with heights of scale 8 and 1.2 km and a tent about 25 km."""

    earth, top = 6360e3, 6420e3
    mie, g = 2e-5, 0.76
    # Per 20 nm from 380 to 780: the sun's irradiance outside (W/(m² nm)), Rayleigh scattering and ozone absorption (1/m).
    irradiance = np.array([
        1.457568, 1.565963, 1.651484, 1.714962, 1.757980, 1.782564, 1.790951, 1.785416, 1.768156, 1.741221, 1.706471,
        1.665561, 1.619932, 1.570836, 1.519323, 1.466285, 1.412459, 1.358450, 1.304749, 1.251750, 1.199760,
    ])  # fmt: skip
    rayleigh = 1e-6 * np.array([
        54.248201, 44.185499, 36.351519, 30.179290, 25.263202, 21.308593, 18.098380, 15.470571, 13.302850, 11.501848,
        9.995574, 8.728000, 7.655137, 6.742172, 5.961341, 5.290346, 4.711157, 4.209105, 3.772184, 3.390513, 3.055915,
    ])  # fmt: skip
    ozone = 1e-6 * np.array([
        0.003251, 0.005854, 0.019772, 0.073096, 0.200846, 0.403840, 0.635513, 0.967070, 1.547974, 2.090386, 2.461281,
        2.735513, 2.151259, 1.590518, 1.123562, 0.735276, 0.464501, 0.330961, 0.225126, 0.148791, 0.168286,
    ])  # fmt: skip

    def __init__(self, altitude: float, air: float, dust: float, ozone: float) -> None:
        self.position = np.array([0.0, 0.0, self.earth + np.clip(altitude, 1.0, 59999.0)])
        self.scale = np.array([air, dust, ozone])
        self.extinction = np.stack([self.rayleigh, np.full(21, 1.11 * self.mie), self.ozone])
        self.observer = OBSERVER[::4]
        nodes, weights = np.polynomial.laguerre.laggauss(8)
        # The optical depth falls off exponentially along a ray: Gauss-Laguerre, its last node just inside the atmosphere.
        self.nodes, self.weights = nodes / 25.0, weights * np.exp(nodes) / 25.0

    def density(self, position: np.ndarray) -> np.ndarray:
        h = np.linalg.norm(position, axis=-1) - self.earth
        return np.stack([np.exp(-h / 8e3), np.exp(-h / 1.2e3), np.maximum(0.0, 1.0 - np.abs(h - 25e3) / 15e3)], -1)

    def depth(self, position: np.ndarray, direction: np.ndarray) -> np.ndarray:
        """Optical depth (…, 3) to the atmosphere's end, in lengths of unit density."""
        length = _exit(position, direction, self.top)[..., None]
        parts = (self.density(position + node * length * direction) * w for node, w in zip(self.nodes, self.weights, strict=True))
        return sum(parts) * length

    def sky(self, elevation: float, size: float) -> Sky:
        sun = _directions(np.array([elevation]), np.array([np.pi]))[0, 0]
        rows, azimuths = _rays()
        up = rows > 0.0
        radiance = np.zeros((len(rows), len(azimuths), 3))
        radiance[up] = self.scattered(_directions(rows[up], azimuths), sun)
        # Below the horizon its colour fades out.
        horizon = radiance[np.flatnonzero(up)[0]]
        fade = np.where(np.sin(rows) > -0.4, np.maximum(1.0 + 2.5 * np.sin(rows), 0.0) ** 3, 0.0)
        radiance[~up] = horizon[None] * fade[~up, None, None]
        ends = [self.sun(max(elevation + s * size / 2.0, 0.0), size) if elevation + size / 2.0 > 0.0 else np.zeros(3)
                for s in (-1.0, 1.0)]  # fmt: skip
        return Sky(_image(radiance), *ends)

    def scattered(self, direction: np.ndarray, sun: np.ndarray) -> np.ndarray:
        step = _exit(self.position, direction, self.top) / _STEPS_SINGLE
        mu = direction @ sun
        g2 = self.g**2
        phase_air = 3.0 / (16.0 * np.pi) * (1.0 + mu**2)
        phase_dust = 3.0 * (1.0 - g2) * (1.0 + mu**2) / (8.0 * np.pi * (2.0 + g2) * (1.0 + g2 - 2.0 * self.g * mu) ** 1.5)
        depth = np.zeros((*mu.shape, 3))
        spectrum = np.zeros((*mu.shape, 21))
        for i in range(_STEPS_SINGLE):
            position = self.position + ((i + 0.5) * step)[..., None] * direction
            density = self.scale * self.density(position)
            depth += step[..., None] * density
            total = depth + self.scale * self.depth(position, np.broadcast_to(sun, position.shape))
            shadowed = np.isfinite(_hit(position, sun, self.earth)) if sun[2] < 0.0 else np.zeros(mu.shape, bool)
            light = np.where(shadowed[..., None], 0.0, np.exp(-total @ self.extinction))
            scattering = (phase_air * density[..., 0])[..., None] * self.rayleigh + (
                phase_dust * density[..., 1] * self.mie)[..., None]  # fmt: skip
            spectrum += light * scattering * self.irradiance * step[..., None]
        return spectrum @ self.observer * 20.0

    def sun(self, elevation: float, size: float) -> np.ndarray:
        direction = _directions(np.array([elevation]), np.array([0.0]))[0, 0]
        depth = self.scale * self.depth(self.position, direction)
        through = np.exp(-depth[:2] @ self.extinction[:2])
        xyz = (self.irradiance * through / _disc(size)) @ self.observer * 20.0
        return np.maximum(REC709_FROM_XYZ @ xyz, 0.0)


class _Multiple:
    """Kilometres; four wavelengths: 630, 560, 490 and 430 nm."""

    earth, thickness, g = 6371.0, 100.0, 0.8
    ground = 0.3  # albedo
    irradiance = np.array([1.679, 1.828, 1.986, 1.307])
    molecules = np.array([6.605e-3, 1.067e-2, 1.842e-2, 3.156e-2])
    ozone = np.array([3.472e-25, 3.914e-25, 1.349e-25, 11.03e-27]) * 334.5
    absorbing = np.array([2.8722e-24, 4.6168e-24, 7.9706e-24, 1.3578e-23])
    scattering = np.array([1.5908e-22, 1.7711e-22, 2.0942e-22, 2.4033e-22])
    aerosols, background = 1.3681e20, 2e6
    xyz = np.array([
        [53.38691774, 22.98133751, 0.0], [43.90484447, 71.34779570, 0.10250687], [1.61372783, 18.42296059, 31.74292119],
        [20.76266867, 2.36142135, 110.48009643],
    ])  # fmt: skip
    table = (256, 64)  # sun's cosine × altitude

    def __init__(self, altitude: float, air: float, dust: float, ozone: float) -> None:
        self.altitude = np.clip(altitude, 1.0, 99999.0) / 1000.0
        self.air, self.dust, self.ozone_scale = air, dust, ozone
        cosine = np.linspace(-1.0, 1.0, self.table[0])
        self.transmittances = self.to_sun(cosine[None], np.linspace(0.0, 1.0, self.table[1])[:, None])

    def coefficients(self, h: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(molecular scattering, aerosol scattering, extinction), each (…, 4), 1/km at height h km."""
        air = np.exp(-0.07771971 * h**1.16364243)[..., None] * self.molecules * self.air
        log = np.log(np.maximum(h, 1e-4))
        ozone = (3.78547397e20 * np.exp(-((log - 3.22261) ** 2) * 5.55555555 - log))[..., None] * self.ozone
        dust = (self.aerosols * np.exp(-h / 0.73) + self.background)[..., None] * self.dust
        return air, dust * self.scattering, air + dust * (self.scattering + self.absorbing) + ozone * self.ozone_scale

    def to_sun(self, cosine: np.ndarray, height: np.ndarray) -> np.ndarray:
        """Transmittance (…, 4) from a relative height towards the sun."""
        cosine, height = np.broadcast_arrays(cosine, height)
        direction = np.stack([-np.sqrt(np.maximum(1.0 - cosine**2, 0.0)), np.zeros_like(cosine), cosine], -1)
        position = np.zeros_like(direction)
        position[..., 2] = self.earth + height * self.thickness
        step = _exit(position, direction, self.earth + self.thickness) / _STEPS_MULTIPLE
        depth = np.zeros((*cosine.shape, 4))
        for i in range(_STEPS_MULTIPLE):
            at = position + ((i + 0.5) * step)[..., None] * direction
            h = np.maximum(np.linalg.norm(at, axis=-1) - self.earth, 0.0)
            depth += self.coefficients(h)[2] * step[..., None]
        return np.exp(-depth)

    def look_up(self, cosine: np.ndarray, height: np.ndarray) -> np.ndarray:
        x = np.clip(cosine * 0.5 + 0.5, 0.0, 1.0) * (self.table[0] - 1)
        y = np.clip(height, 0.0, 1.0) * (self.table[1] - 1)
        i, j = np.minimum(x.astype(int), self.table[0] - 2), np.minimum(y.astype(int), self.table[1] - 2)
        fx, fy = (x - i)[..., None], (y - j)[..., None]
        t = self.transmittances
        return (t[j, i] * (1 - fx) + t[j, i + 1] * fx) * (1 - fy) + (t[j + 1, i] * (1 - fx) + t[j + 1, i + 1] * fx) * fy

    def again(self, cosine: np.ndarray, height: np.ndarray, radius: np.ndarray) -> np.ndarray:
        """What other points of the atmosphere (a fit) and the lit ground add to the light at a point."""
        omega = 2.0 * np.pi * (1.0 - np.sqrt(np.maximum(1.0 - (self.earth / radius) ** 2, 0.0)))
        one, zero = np.ones_like(height), np.zeros_like(height)
        to_ground = self.look_up(one, zero) / self.look_up(one, height)
        ground = (omega * cosine)[..., None] * self.ground / (4.0 * np.pi**2) * self.look_up(cosine, zero) * to_ground
        fit = 0.02 * np.array([0.217, 0.347, 0.594, 1.0]) / (1.0 + 5.0 * np.exp(-17.92 * cosine))[..., None]
        return fit + ground

    def sky(self, elevation: float, size: float) -> Sky:
        sun = _directions(np.array([elevation]), np.array([np.pi]))[0, 0]
        rows, azimuths = _rays()
        direction = _directions(rows, azimuths)
        origin = np.array([0.0, 0.0, self.earth + self.altitude])
        end = np.minimum(_exit(origin, direction, self.earth + self.thickness), _hit(origin, direction, self.earth))
        step = end / _STEPS_MULTIPLE
        mu = direction @ sun
        phase_air = 3.0 / (16.0 * np.pi) * (1.0 + mu**2)
        g2 = self.g**2
        phase_dust = (1.0 - g2) / (4.0 * np.pi) / (1.0 + g2 - 2.0 * self.g * mu) ** 1.5
        light = np.zeros((*mu.shape, 4))
        through = np.ones((*mu.shape, 4))
        for i in range(_STEPS_MULTIPLE):
            at = origin + ((i + 0.5) * step)[..., None] * direction
            radius = np.linalg.norm(at, axis=-1)
            h = np.maximum(radius - self.earth, 0.0)
            cosine = (at @ sun) / radius
            air, dust, extinction = self.coefficients(h)
            arriving = self.look_up(cosine, h / self.thickness)
            again = self.again(cosine, h / self.thickness, radius)
            source = air * (phase_air[..., None] * arriving + again) + dust * (phase_dust[..., None] * arriving + again)
            passed = np.exp(-step[..., None] * extinction)
            # The integral over the step is exact where source and extinction are constant (S. Hillaire, 2016).
            light += through * self.irradiance * source * (1.0 - passed) / np.maximum(extinction, 1e-7)
            through *= passed
        ends = [self.sun(elevation + s * size / 2.0, size) for s in (-1.0, 1.0)]
        return Sky(_image(light @ self.xyz), *ends)

    def sun(self, elevation: float, size: float) -> np.ndarray:
        through = self.to_sun(np.array([np.sin(elevation)]), np.array([self.altitude / self.thickness]))[0]
        return np.maximum(REC709_FROM_XYZ @ (self.irradiance * through / _disc(size) @ self.xyz), 0.0)


# A. J. Preetham et al., "A Practical Analytic Model for Daylight", SIGGRAPH 1999: Perez' coefficients of Y, x and y, each
# (slope over turbidity, value at none), and the zenith's chromaticities as polynomials of turbidity and the sun's angle.
_PEREZ = {
    "Y": ((0.1787, -1.4630), (-0.3554, 0.4275), (-0.0227, 5.3251), (0.1206, -2.5771), (-0.0670, 0.3703)),
    "x": ((-0.0193, -0.2592), (-0.0665, 0.0008), (-0.0004, 0.2125), (-0.0641, -0.8989), (-0.0033, 0.0452)),
    "y": ((-0.0167, -0.2608), (-0.0950, 0.0092), (-0.0079, 0.2102), (-0.0441, -1.6537), (-0.0109, 0.0529)),
}
_ZENITH = {
    "x": ((0.00166, -0.00375, 0.00209, 0.0), (-0.02903, 0.06377, -0.03202, 0.00394), (0.11693, -0.21196, 0.06052, 0.25886)),
    "y": ((0.00275, -0.00610, 0.00317, 0.0), (-0.04214, 0.08970, -0.04153, 0.00516), (0.15346, -0.26756, 0.06670, 0.26688)),
}
_PREETHAM_UNIT = 0.06  # Blender's radiance per kcd/m²


def perez(numbers, slant, gamma) -> np.ndarray:
    """R. Perez's formula S (1 + A e^(B·slant)) (1 + C e^(Dγ) + E cos²γ) for ``numbers`` (S, A, B, C, D, E), ``slant`` the
    length of the way through the air and ``gamma`` the angle to the sun, rad."""
    s, a, b, c, d, e = numbers
    return s * (1.0 + a * np.exp(b * slant)) * (1.0 + c * np.exp(d * gamma) + e * np.cos(gamma) ** 2)


def hosek(elevation: float, turbidity: float, albedo: float) -> Sky:
    """L. Hosek's and A. Wilkie's sky ("An Analytic Model for Full Spectral Sky-Dome Radiance", SIGGRAPH 2012) as Blender has
    it, by fits of Perez's formula (scripts/fit_sky.py), between which radiance is interpolated. It has no ground: below the
    horizon it goes on as at it."""
    rows, azimuths = _rays()
    mu = np.clip(_directions(rows, azimuths) @ _directions(np.array([elevation]), np.array([np.pi]))[0, 0], -1.0, 1.0)
    gamma, slant = np.arccos(mu), 1.0 / (np.maximum(np.sin(rows), 1e-3) + HOSEK_SLANT)[:, None]
    rgb = np.zeros((*mu.shape, 3))
    for weight, numbers in hosek_neighbours(turbidity, elevation, albedo):
        above = np.stack([perez(n[:6], slant, gamma) for n in numbers], -1)
        rgb += weight * np.where(rows[:, None, None] < 0.0, horizon_basis(gamma) @ numbers[:, 6:].T, above)
    return Sky(_mirrored(np.maximum(rgb, 0.0)), np.zeros(3), np.zeros(3))


def preetham(elevation: float, turbidity: float) -> Sky:
    """Preetham's clear sky; below the horizon it goes on as at it."""
    theta_sun = 0.5 * np.pi - elevation
    rows, azimuths = _rays()
    mu = np.clip(_directions(rows, azimuths) @ _directions(np.array([elevation]), np.array([np.pi]))[0, 0], -1.0, 1.0)
    theta = np.minimum(0.5 * np.pi - rows, 0.5 * np.pi - 0.001)[:, None]

    def relative(name: str, theta, gamma):
        return perez((1.0, *(slope * turbidity + base for slope, base in _PEREZ[name])), 1.0 / np.cos(theta), gamma)

    chi = (4.0 / 9.0 - turbidity / 120.0) * (np.pi - 2.0 * theta_sun)
    zenith = {"Y": _PREETHAM_UNIT * ((4.0453 * turbidity - 4.9710) * np.tan(chi) - 0.2155 * turbidity + 2.4192)}
    for name, rows_of in _ZENITH.items():
        zenith[name] = sum(np.polyval(p, theta_sun) * turbidity ** (2 - k) for k, p in enumerate(rows_of))
    values = {n: zenith[n] * relative(n, theta, np.arccos(mu)) / relative(n, 0.0, theta_sun) for n in ("Y", "x", "y")}
    ratio = values["Y"] / np.maximum(values["y"], 1e-6)
    xyz = np.stack([values["x"] * ratio, values["Y"] + 0.0 * ratio, (1.0 - values["x"] - values["y"]) * ratio], -1)
    return Sky(_image(xyz), np.zeros(3), np.zeros(3))


def _disc(size: float) -> float:
    """Solid angle of a disc of that angular diameter."""
    return 2.0 * np.pi * (1.0 - np.cos(0.5 * size))
