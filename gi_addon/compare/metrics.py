# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a picture is from its reference, in linear light.

``reference`` may come as two halves A and B of independent noise; then the error is debiased: the noise of the two is
uncorrelated, so mean[(T − A)(T − B)] has none of it.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cache
from types import ModuleType

import numpy as np


@dataclass(frozen=True)
class Score:
    """Error figures of one pass. ``gain`` ΣT/ΣR; ``rel_mse`` debiased where halves were given; ``trimmed`` without the
    0.1 % worst pixels; ``shape`` the least rel_mse over all scale factors, ``best_scale`` where it is reached;
    ``black`` and ``constant`` the rel_mse of nothing and of the best constant; ``noise_floor`` that of the reference
    itself. ``flip`` mean and ``flip_p95`` are NaN where not computed."""

    gain: float
    rel_mse: float
    trimmed: float
    shape: float
    best_scale: float
    black: float
    constant: float
    noise_floor: float
    flip: float = float("nan")
    flip_p95: float = float("nan")

    def text(self) -> str:
        """One line."""
        flip = "" if np.isnan(self.flip) else f", FLIP {self.flip:.3f} (p95 {self.flip_p95:.3f})"
        return (
            f"gain {self.gain:.3f}, relMSE {self.rel_mse:.4f} (trimmed {self.trimmed:.4f}, shape {self.shape:.4f}), "
            f"black {self.black:.3f}, constant {self.constant:.4f}, noise floor {self.noise_floor:.5f}{flip}"
        )


def _epsilon(reference: np.ndarray) -> float:
    """ε = 0.1 mean(R): smaller lets truly black regions drown the rest."""
    return max(0.1 * float(np.mean(reference)), 1e-12)


def weight(reference: np.ndarray) -> np.ndarray:
    """1/(R² + ε²), the weight of relative squared errors."""
    return 1.0 / (reference.astype("f8") ** 2 + _epsilon(reference) ** 2)


def rel_mse(test: np.ndarray, reference: np.ndarray, half_b: np.ndarray | None = None) -> float:
    """mean[(T − R)²/(R² + ε²)]; with ``half_b`` the debiased mean[(T − A)(T − B)/(R² + ε²)], R = (A + B)/2."""
    return float(np.mean(error_map(test, reference, half_b)))


def error_map(test: np.ndarray, reference: np.ndarray, half_b: np.ndarray | None = None) -> np.ndarray:
    """The relative squared error per value, same shape as the input."""
    test, a = test.astype("f8"), reference.astype("f8")
    b = a if half_b is None else half_b.astype("f8")
    return (test - a) * (test - b) * weight((a + b) / 2.0)


def noise_floor(half_a: np.ndarray, half_b: np.ndarray) -> float:
    """rel_mse of the reference's own noise: mean[(A − B)²/4/(R² + ε²)]."""
    a, b = half_a.astype("f8"), half_b.astype("f8")
    return float(np.mean((a - b) ** 2 / 4.0 * weight((a + b) / 2.0)))


def score(
    test: np.ndarray,
    reference: np.ndarray,
    half_b: np.ndarray | None = None,
    *,
    mask: np.ndarray | None = None,
    flip: bool = False,
) -> Score:
    """All figures of (H, W, 3) ``test`` against ``reference`` (or halves A and B), within ``mask`` (H, W)."""
    if test.shape != reference.shape:
        raise ValueError(f"pictures differ in size: {test.shape} and {reference.shape}")
    a = reference
    r = a if half_b is None else (a.astype("f8") + half_b.astype("f8")) / 2.0
    flips = (float("nan"), float("nan"))
    if flip:
        flips = hdr_flip(test, np.asarray(r, "f4"))
    if mask is not None:
        test, a, r = test[mask], a[mask], r[mask]
        half_b = None if half_b is None else half_b[mask]
    test8 = test.astype("f8")
    w = weight(r)
    errors = error_map(test, a, half_b)
    flat = np.sort(errors.reshape(-1))
    kept = flat[: max(1, len(flat) - len(flat) // 1000)]
    # error(s) = mean[w (sT − A)(sT − B)] = s² Σ w T² − 2 s Σ w T R + Σ w A B is a parabola in s.
    b = a if half_b is None else half_b
    tt, tr = float(np.mean(w * test8 * test8)), float(np.mean(w * test8 * r))
    ab = float(np.mean(w * a.astype("f8") * b.astype("f8")))
    scale = tr / tt if tt > 0 else 1.0
    constant = float(np.sum(w * r) / np.sum(w))
    total = float(np.sum(r))
    return Score(
        gain=float(np.sum(test8)) / total if total > 0 else float("nan"),
        rel_mse=float(np.mean(errors)),
        trimmed=float(np.mean(kept)),
        shape=ab - tr * tr / tt if tt > 0 else ab,
        best_scale=scale,
        black=ab,
        constant=float(np.mean(w * (constant - a.astype("f8")) * (constant - b.astype("f8")))),
        noise_floor=0.0 if half_b is None else noise_floor(a, half_b),
        flip=flips[0],
        flip_p95=flips[1],
    )


def hdr_flip(test: np.ndarray, reference: np.ndarray) -> tuple[float, float]:
    """HDR-FLIP mean and 95th percentile at 67 pixels per degree, exposures from the reference.

    NaN without the ``flip-evaluator`` package, or on a reference that is black or not finite: the package ends the whole
    process on those.
    """
    package = _flip_package()
    if package is None:
        return float("nan"), float("nan")
    reference = np.ascontiguousarray(np.maximum(reference, 0.0), np.float32)
    test = np.ascontiguousarray(np.maximum(test, 0.0), np.float32)
    if not np.isfinite(reference).all() or not np.isfinite(test).all() or reference.max() <= 1e-8:
        return float("nan"), float("nan")
    errors, mean, _ = package.evaluate(
        reference, test, "HDR", inputsRGB=False, applyMagma=False, computeMeanError=True, parameters={"ppd": 67.0}
    )
    return float(mean), float(np.percentile(np.asarray(errors), 95))


@cache
def _flip_package() -> ModuleType | None:
    """flip-evaluator with one thread: on small pictures its threads wait for each other five times longer than they work."""
    before = os.environ.get("OMP_NUM_THREADS")
    os.environ["OMP_NUM_THREADS"] = "1"  # read once, when its library loads
    try:
        import flip_evaluator
    except ImportError:
        return None
    finally:
        if before is None:
            del os.environ["OMP_NUM_THREADS"]
        else:
            os.environ["OMP_NUM_THREADS"] = before
    return flip_evaluator
