# SPDX-License-Identifier: GPL-3.0-or-later
"""The Blender side: the only room that imports bpy (with ``ui.py``)."""


def register() -> None:
    """Register settings, engine, operators, panels and preferences."""
    from .. import ui
    from . import comparison, engine, operators, preferences, properties

    properties.register()
    engine.register()
    operators.register()
    comparison.register()
    ui.register()
    preferences.register()


def unregister() -> None:
    """Undo :func:`register` and release the GPU."""
    from .. import ui
    from ..gl import shutdown
    from . import comparison, engine, operators, preferences, properties, status

    preferences.unregister()
    ui.unregister()
    comparison.unregister()
    operators.unregister()
    engine.unregister()
    properties.unregister()
    status.clear()
    shutdown()
