# SPDX-License-Identifier: GPL-3.0-or-later
"""FLIP, the error that an eye sees when two pictures alternate, in NumPy: for where the flip-evaluator package is not.

P. Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", HPG 2020, and "Visualizing Errors in Rendered
High Dynamic Range Images", Eurographics 2021. Numbers in the code are the papers'.
"""

from __future__ import annotations

import numpy as np

PIXELS_PER_DEGREE = 67.0

_XYZ = np.array([[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]])
_WHITE = _XYZ.sum(axis=1)
# Sensitivity to contrast of each opponent channel (Y, C_x, C_z), as sums of Gaussians (a, b): HPG 2020, table 1.
_SENSITIVITY = (((1.0, 0.0047),), ((1.0, 0.0053),), ((34.1, 0.04), (13.5, 0.025)))
_FEATURE_WIDTH = 0.082  # degrees
# ACES as the HDR paper has it: (k0 x² + k1 x + k2) / (k3 x² + k4 x + k5), pre-scaled by 0.6.
_ACES = (0.6 * 0.6 * 2.51, 0.6 * 0.03, 0.0, 0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14)


def hdr_flip_map(test: np.ndarray, reference: np.ndarray, ppd: float = PIXELS_PER_DEGREE) -> np.ndarray:
    """HDR-FLIP (H, W) in [0, 1] of linear pictures (H, W, 3): the worst over exposures that show the reference's range."""
    test, reference = (np.maximum(np.nan_to_num(x.astype("f8")), 0.0) for x in (test, reference))
    start, stop, count = exposures(reference)
    worst = np.zeros(reference.shape[:2])
    for exposure in np.linspace(start, stop, count):
        a, b = (_tone_map(x * 2.0**exposure) for x in (test, reference))
        worst = np.maximum(worst, ldr_flip_map(a, b, ppd))
    return worst


def exposures(reference: np.ndarray) -> tuple[float, float, int]:
    """First and last exposure (stops) and how many: where the median, and where the maximum, turns nearly white."""
    luminance = reference @ _XYZ[1]
    k0, k1, k2, k3, k4, k5 = _ACES
    white = 0.85
    a, b, c = k0 - white * k3, k1 - white * k4, k2 - white * k5
    bright = (-b + np.sqrt(b * b - 4.0 * a * c)) / (2.0 * a)
    high = float(luminance.max())
    # The upper of the two middle values, as the authors' code takes it.
    middle = float(np.sort(luminance.reshape(-1))[luminance.size // 2])
    middle = max(middle, float(np.finfo(np.float32).eps))
    start, stop = np.log2(bright / max(high, middle)), np.log2(bright / middle)
    return float(start), float(stop), int(max(2, np.ceil(stop - start)))


def ldr_flip_map(test: np.ndarray, reference: np.ndarray, ppd: float = PIXELS_PER_DEGREE) -> np.ndarray:
    """FLIP (H, W) in [0, 1] of display-linear pictures (H, W, 3) in [0, 1]."""
    color = _color_difference(test, reference, ppd)
    feature = _feature_difference(test, reference, ppd)
    return color ** (1.0 - feature)


def _tone_map(x: np.ndarray) -> np.ndarray:
    k0, k1, k2, k3, k4, k5 = _ACES
    return np.clip((k0 * x * x + k1 * x + k2) / (k3 * x * x + k4 * x + k5), 0.0, 1.0)


# --- colour -----------------------------------------------------------------------------------------------------------


def _opponent(linear: np.ndarray) -> np.ndarray:
    """Y C_x C_z of linear RGB."""
    x, y, z = np.moveaxis((linear @ _XYZ.T) / _WHITE, -1, 0)
    return np.stack([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)], axis=-1)


def _linear(opponent: np.ndarray) -> np.ndarray:
    y = (opponent[..., 0] + 16.0) / 116.0
    x, z = opponent[..., 1] / 500.0 + y, y - opponent[..., 2] / 200.0
    return (np.stack([x, y, z], axis=-1) * _WHITE) @ np.linalg.inv(_XYZ).T


def _lab_hunt(linear: np.ndarray) -> np.ndarray:
    """CIELAB with the chroma scaled by lightness (Hunt's effect)."""
    t = (linear @ _XYZ.T) / _WHITE
    delta = 6.0 / 29.0
    f = np.where(t > delta**3, np.cbrt(t), t / (3.0 * delta**2) + 4.0 / 29.0)
    lightness = 116.0 * f[..., 1] - 16.0
    chroma = np.stack([500.0 * (f[..., 0] - f[..., 1]), 200.0 * (f[..., 1] - f[..., 2])], axis=-1)
    return np.concatenate([lightness[..., None], 0.01 * lightness[..., None] * chroma], axis=-1)


def _hyab(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    d = a - b
    return np.abs(d[..., 0]) + np.hypot(d[..., 1], d[..., 2])


def _color_difference(test: np.ndarray, reference: np.ndarray, ppd: float) -> np.ndarray:
    seen = [_lab_hunt(np.clip(_linear(_blurred(_opponent(x), ppd)), 0.0, 1.0)) for x in (test, reference)]
    difference = _hyab(*seen) ** 0.7
    green, blue = _lab_hunt(np.array([0.0, 1.0, 0.0])), _lab_hunt(np.array([0.0, 0.0, 1.0]))
    most = float(_hyab(green, blue)) ** 0.7
    low, share = 0.4 * most, 0.95
    return np.where(difference < low, difference * share / low, share + (difference - low) / (most - low) * (1.0 - share))


def _blurred(opponent: np.ndarray, ppd: float) -> np.ndarray:
    """What is left of each channel at this distance."""
    widest = max(b for terms in _SENSITIVITY for _, b in terms)
    radius = int(np.ceil(3.0 * np.sqrt(widest / (2.0 * np.pi**2)) * ppd))
    x = np.arange(-radius, radius + 1) / ppd
    out = np.empty_like(opponent)
    for channel, terms in enumerate(_SENSITIVITY):
        total = np.zeros(opponent.shape[:2])
        weight = 0.0
        for a, b in terms:
            kernel = np.exp(-(np.pi**2) * x * x / b)
            scale = a * np.pi / b  # of the two-dimensional Gaussian
            total += scale * _along(_along(opponent[..., channel], kernel, 1), kernel, 0)
            weight += scale * kernel.sum() ** 2
        out[..., channel] = total / weight
    return out


def _along(image: np.ndarray, kernel: np.ndarray, axis: int) -> np.ndarray:
    """Correlation with ``kernel`` along an axis; the border repeats."""
    radius = len(kernel) // 2
    pad = [(radius, radius) if k == axis else (0, 0) for k in range(2)]
    padded = np.pad(image, pad, mode="edge")
    size = image.shape[axis]
    return sum(w * padded.take(range(i, i + size), axis) for i, w in enumerate(kernel))


# --- edges and points -------------------------------------------------------------------------------------------------


def _feature_difference(test: np.ndarray, reference: np.ndarray, ppd: float) -> np.ndarray:
    deviation = 0.5 * _FEATURE_WIDTH * ppd
    radius = int(np.ceil(3.0 * deviation))
    x = np.arange(-radius, radius + 1, dtype="f8")
    gauss = np.exp(-x * x / (2.0 * deviation**2))
    smooth = gauss / gauss.sum()
    first = _balanced(-x * gauss)
    second = _balanced((x * x / deviation**2 - 1.0) * gauss)
    strengths = []
    for image in (test, reference):
        y = (image @ _XYZ[1]) / _WHITE[1]
        strengths.append([
            np.hypot(_along(_along(y, kernel, 1), smooth, 0), _along(_along(y, kernel, 0), smooth, 1))
            for kernel in (first, second)
        ])  # fmt: skip
    (edge_a, point_a), (edge_b, point_b) = strengths
    difference = np.maximum(np.abs(edge_a - edge_b), np.abs(point_a - point_b))
    return np.sqrt(difference / np.sqrt(2.0))


def _balanced(kernel: np.ndarray) -> np.ndarray:
    """A kernel whose positive weights sum to 1 and whose negative ones to −1."""
    positive, negative = kernel[kernel > 0].sum(), -kernel[kernel < 0].sum()
    return np.where(kernel > 0, kernel / positive, kernel / negative)
