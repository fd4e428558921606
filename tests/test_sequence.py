# SPDX-License-Identifier: GPL-3.0-or-later
"""The low-discrepancy sequence, in Python and on the GPU."""

from __future__ import annotations

import numpy as np
import pytest
from gpu import evaluate

from gi_addon.frame import pixel_jitter
from gi_addon.sequence import hash_u32, sobol_2d
from gi_addon.settings import Settings


def test_gpu_and_cpu_draw_the_same_points_bit_for_bit(gl):
    """Not a formality: one driver's compiler got a data-dependent loop in here wrong."""
    index = np.arange(4096)
    for seed in (0, 1, 30, 12345):
        inputs = np.stack([index, np.full_like(index, seed), index, index], axis=1)
        code = "vec4 evaluate(vec4 v) { return vec4(sobol_2d(uint(v.x), uint(v.y)), 0.0, 0.0); }"
        out = gl(evaluate, code, inputs, "lib/sequence_lib.glsl")
        np.testing.assert_array_equal(out[:, :2], sobol_2d(index, seed).astype("f4"))


def test_gpu_and_cpu_hash_alike(gl):
    x = np.arange(1000)
    code = "vec4 evaluate(vec4 v) { uint h = hash_u32(uint(v.x)); return vec4(h >> 16, h & 65535u, 0.0, 0.0); }"
    out = gl(evaluate, code, np.stack([x] * 4, 1), "lib/sequence_lib.glsl")
    h = hash_u32(x)
    np.testing.assert_array_equal(out[:, 0], h >> 16)
    np.testing.assert_array_equal(out[:, 1], h & 65535)


@pytest.mark.parametrize("seed", [0, 7, 100])
def test_every_aligned_block_of_256_is_a_0_2_net(seed):
    """One point in each of the 256 elementary boxes of every shape 2^-i × 2^-(8-i): what Owen scrambling keeps."""
    for start in (0, 256, 1024):
        points = sobol_2d(np.arange(start, start + 256), seed)
        assert (points >= 0).all() and (points < 1).all()
        for i in range(9):
            cells = (np.floor(points[:, 0] * 2**i) * 2 ** (8 - i) + np.floor(points[:, 1] * 2 ** (8 - i))).astype(int)
            assert len(np.unique(cells)) == 256


def test_purposes_are_independent():
    a, b = sobol_2d(np.arange(1024), 1), sobol_2d(np.arange(1024), 2)
    assert abs(np.corrcoef(a[:, 0], b[:, 0])[0, 1]) < 0.1


@pytest.mark.parametrize("name", ["BOX", "BLACKMAN_HARRIS"])
def test_pixel_jitter_follows_the_filter(name):
    """Mean 0; variance of a box of width w is w²/12, of the Blackman-Harris window 0.0162 w² (by quadrature here)."""
    settings = Settings()
    settings.pixel_filter, settings.filter_width = name, 1.5
    jitter = np.array([pixel_jitter(settings, i, 4096) for i in range(4096)])
    x = np.linspace(-0.5, 0.5, 20001)
    t = 2 * np.pi * (x + 0.5)
    window = 0.35875 - 0.48829 * np.cos(t) + 0.14128 * np.cos(2 * t) - 0.01168 * np.cos(3 * t)
    variance = {"BOX": 1 / 12, "BLACKMAN_HARRIS": (window * x * x).sum() / window.sum()}[name] * 1.5**2
    np.testing.assert_allclose(jitter.mean(axis=0), 0.0, atol=1e-3)
    np.testing.assert_allclose(jitter.var(axis=0), variance, rtol=5e-3)
    assert (pixel_jitter(settings, 0, 1) == 0).all(), "a single sub-frame looks through the pixel's centre"
