# SPDX-License-Identifier: GPL-3.0-or-later
"""Which sources made a result: what is kept on disk is named by them, so that nothing old passes for new."""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path

from .. import __version__


@cache
def source_version() -> str:
    """The version with a fingerprint of everything that makes pictures."""
    root = Path(__file__).resolve().parent.parent
    h = hashlib.blake2b(digest_size=6)
    for path in sorted([*root.rglob("*.py"), *root.rglob("*.glsl")]):
        if "compare" not in path.relative_to(root).parts and not path.name.startswith("cli"):
            h.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    return f"{__version__}+{h.hexdigest()}"


def _fingerprint_of(*names: str) -> str:
    h = hashlib.blake2b(digest_size=6)
    for name in names:
        h.update((Path(__file__).parent / name).read_bytes())
    return h.hexdigest()


@cache
def scoring_version() -> str:
    """A fingerprint of what makes figures of pictures."""
    return _fingerprint_of("metrics.py", "study.py")


@cache
def checks_version() -> str:
    """A fingerprint of what the stability suite checks."""
    return _fingerprint_of("stability.py", "stability_checks.py", "closed_forms.py", "scenes.py", "metrics.py")
