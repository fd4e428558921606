# SPDX-License-Identifier: GPL-3.0-or-later
"""Quartet GI: four real-time global illumination techniques in Blender's own units, next to Cycles."""

__version__ = "0.1.0"


def register() -> None:
    """Register engine, settings and panels with Blender."""
    from . import host

    host.register()


def unregister() -> None:
    """Take everything back out of Blender."""
    from . import host

    host.unregister()
