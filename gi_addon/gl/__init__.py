# SPDX-License-Identifier: GPL-3.0-or-later
"""The GL room: thread, context, shaders, formats, timers. It knows nothing of scenes or techniques."""

from .context import GL, MIB
from .errors import Cancelled, GLContextLost, GLError, GLOutOfMemory, GLTooOld, GLUnavailable, ShaderError
from .structs import glsl_struct, struct
from .thread import CancelToken, GLThread, driver, shared, shutdown

__all__ = [
    "GL",
    "MIB",
    "CancelToken",
    "Cancelled",
    "GLContextLost",
    "GLError",
    "GLOutOfMemory",
    "GLThread",
    "GLTooOld",
    "GLUnavailable",
    "ShaderError",
    "driver",
    "glsl_struct",
    "shared",
    "shutdown",
    "struct",
]  # fmt: skip
