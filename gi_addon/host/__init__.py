# SPDX-License-Identifier: GPL-3.0-or-later
"""The Blender side: the only room that imports bpy (with ``ui.py``)."""


def register() -> None:
    """Register settings, engine and panels."""
    from .. import ui
    from . import engine, properties

    properties.register()
    engine.register()
    ui.register()


def unregister() -> None:
    """Undo :func:`register` and release the GPU."""
    from .. import ui
    from ..gl import shutdown
    from . import engine, properties

    ui.unregister()
    engine.unregister()
    properties.unregister()
    shutdown()
