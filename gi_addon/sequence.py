# SPDX-License-Identifier: GPL-3.0-or-later
"""The one low-discrepancy sequence: Sobol's (0, 2)-sequence with hashed Owen scrambling.

Every sub-frame takes one point per purpose (pixel, lens, each light …); purposes differ by ``seed``. The scrambled
points keep the (0, 2) property: any aligned power-of-two run of them is stratified. ``glsl/lib/sequence_lib.glsl`` is
the same on the GPU, and a test compares the two bit by bit.

B. Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020; the hash constants are Laine and Karras' as improved
there (eq. in listing 3) and N. Vegdahl's, https://psychopath.io/post/2021_01_30_building_a_better_lk_hash.
"""

from __future__ import annotations

import numpy as np

_U = np.uint32


def _reverse_bits(x: np.ndarray) -> np.ndarray:
    x = ((x >> _U(1)) & _U(0x55555555)) | ((x & _U(0x55555555)) << _U(1))
    x = ((x >> _U(2)) & _U(0x33333333)) | ((x & _U(0x33333333)) << _U(2))
    x = ((x >> _U(4)) & _U(0x0F0F0F0F)) | ((x & _U(0x0F0F0F0F)) << _U(4))
    x = ((x >> _U(8)) & _U(0x00FF00FF)) | ((x & _U(0x00FF00FF)) << _U(8))
    return (x >> _U(16)) | (x << _U(16))


def _owen_hash(x: np.ndarray, seed: np.ndarray) -> np.ndarray:
    """Laine-Karras style permutation: each bit is flipped depending on lower bits only (on bit-reversed input)."""
    with np.errstate(over="ignore"):
        x = x ^ (x * _U(0x3D20ADEA))
        x = x + seed
        x = x * ((seed >> _U(16)) | _U(1))
        x = x ^ (x * _U(0x05526C56))
        return x ^ (x * _U(0x53A22864))


def hash_u32(x: np.ndarray | int) -> np.ndarray:
    """Integer hash (C. Wellons' lowbias32)."""
    with np.errstate(over="ignore"):
        x = np.asarray(x, np.uint32).copy()
        x ^= x >> _U(16)
        x *= _U(0x7FEB352D)
        x ^= x >> _U(15)
        x *= _U(0x846CA68B)
        return x ^ (x >> _U(16))


def _scramble(x: np.ndarray, seed: np.ndarray) -> np.ndarray:
    return _reverse_bits(_owen_hash(_reverse_bits(x), seed))


def _sobol_2d(index: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The first two Sobol dimensions as 32-bit fractions: van der Corput, and Pascal's triangle mod 2."""
    x = _reverse_bits(index)
    y = np.zeros_like(index)
    v = _U(1 << 31)
    i = index.copy()
    while i.any():
        y ^= np.where(i & _U(1), v, _U(0))
        i >>= _U(1)
        v ^= v >> _U(1)
    return x, y


def sobol_2d(index: np.ndarray | int, seed: int = 0) -> np.ndarray:
    """Points (..., 2) in [0, 1) of the scrambled sequence at ``index``; ``seed`` names the purpose."""
    with np.errstate(over="ignore"):
        index = np.asarray(index, np.uint32)
        seed0 = hash_u32(seed)
        index = _scramble(index, seed0)
        x, y = _sobol_2d(index)
        x = _scramble(x, hash_u32(seed0 ^ _U(0x9E3779B9)))
        y = _scramble(y, hash_u32(seed0 ^ _U(0x7F4A7C15)))
    # 24 bits, so that float32 can hold it and 1.0 is never reached.
    return np.stack([x >> _U(8), y >> _U(8)], axis=-1).astype(np.float64) / float(1 << 24)
