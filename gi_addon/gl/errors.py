# SPDX-License-Identifier: GPL-3.0-or-later
"""What can go wrong with OpenGL, each with a message a user can act on."""


class GLError(RuntimeError):
    """Any failure of the GL room. ``str(error)`` is fit for the user's eyes."""


class GLUnavailable(GLError):
    """No OpenGL context could be made on this machine."""


class GLTooOld(GLError):
    """A context was made, but it is older than OpenGL 4.3."""


class GLContextLost(GLError):
    """The driver dropped the context (driver reset, GPU removed). The next job makes a new one."""


class GLOutOfMemory(GLError):
    """A texture or buffer does not fit in the memory that the driver grants."""


class ShaderError(GLError):
    """A shader did not preprocess, compile or link; the message names file and line."""


class Cancelled(Exception):
    """The job was cancelled by its owner. Not an error: nothing is lost but the job's own result."""
