# SPDX-License-Identifier: GPL-3.0-or-later
"""The GL context and everything that lives in it: programs, textures, buffers, their bytes, and errors.

Only the GL thread (``thread.py``) touches an instance of :class:`GL`.
"""

from __future__ import annotations

import os
import platform
import weakref
from collections.abc import Mapping

import moderngl
import numpy as np

from .errors import GLContextLost, GLError, GLOutOfMemory, GLTooOld, GLUnavailable, ShaderError
from .formats import FORMATS
from .shader import ShaderLibrary, Source

MIB = 1024.0 * 1024.0
_SOFTWARE_DRIVERS = ("llvmpipe", "softpipe", "swrast", "software", "gdi generic")


class GL:
    """A moderngl context with byte accounting, a program cache and errors that say what to do."""

    def __init__(self) -> None:
        self.ctx = _create_context()
        info = self.ctx.info
        self.renderer: str = info.get("GL_RENDERER", "unknown")
        self.version: str = info.get("GL_VERSION", "unknown")
        if self.ctx.version_code < 430:
            version, renderer = self.version, self.renderer
            self.ctx.release()
            raise GLTooOld(
                f"Quartet needs OpenGL 4.3, this driver offers {version} ({renderer}). Update the graphics driver"
                + (" — macOS stops at OpenGL 4.1." if platform.system() == "Darwin" else ".")
            )
        self.software = any(s in self.renderer.lower() for s in _SOFTWARE_DRIVERS)
        self.max_texture_size = int(info["GL_MAX_TEXTURE_SIZE"])
        self.max_3d_texture_size = int(info["GL_MAX_3D_TEXTURE_SIZE"])
        self.max_texture_units = int(info["GL_MAX_TEXTURE_IMAGE_UNITS"])
        self.library = ShaderLibrary()
        self._programs: dict[tuple, moderngl.Program | moderngl.ComputeShader] = {}
        self._resources: dict[int, tuple[weakref.ref, str, int]] = {}
        # A software driver draws from main memory and would rather be killed than say no; a GPU's driver says no.
        self.budget = int(0.75 * _physical_memory()) if self.software else None
        self.compiled = 0
        # Textures' contents that depend on nothing, by the pass that made them: the next renderer need not.
        self.kept: dict[str, list[bytes]] = {}
        # Bound whenever a framebuffer is about to go: moderngl returns to the last bound one by its name.
        self.idle = self.ctx.simple_framebuffer((1, 1))

    # -- facts ---------------------------------------------------------------------------------------------------

    @property
    def driver(self) -> str:
        """One line naming renderer and version."""
        return f"{self.renderer}, OpenGL {self.version}"

    def bytes(self) -> int:
        """Bytes held by live textures and buffers."""
        return sum(size for ref, _, size in self._resources.values() if ref() is not None)

    def resources(self) -> list[tuple[str, int]]:
        """(label, bytes) of every live texture and buffer, largest first."""
        live = [(label, size) for ref, label, size in self._resources.values() if ref() is not None]
        return sorted(live, key=lambda item: -item[1])

    # -- resources -----------------------------------------------------------------------------------------------

    def texture(
        self,
        label: str,
        size: tuple[int, ...],
        fmt: str,
        data: bytes | np.ndarray | None = None,
        *,
        layers: bool = False,
        filter: str = "nearest",
    ) -> moderngl.Texture | moderngl.Texture3D | moderngl.TextureArray:
        """Allocate a 2D ``(w, h)``, 3D ``(w, h, d)`` or, with ``layers``, 2D-array texture of a named format.

        Clamps to the edge. Raises GLOutOfMemory where the driver's limits or memory don't allow it.
        """
        f = FORMATS[fmt]
        size = tuple(int(max(1, s)) for s in size)
        limit = self.max_3d_texture_size if len(size) == 3 and not layers else self.max_texture_size
        if max(size[:2] if layers else size) > limit:
            raise GLOutOfMemory(f"{label}: {'×'.join(map(str, size))} is over this driver's limit of {limit} texels")
        nbytes = int(np.prod(size)) * f.bytes
        self._reserve(label, nbytes)
        if data is not None:
            data = data if isinstance(data, bytes) else np.ascontiguousarray(data)
        try:
            if fmt == "depth24":
                texture = self.ctx.depth_texture(size)
                texture.compare_func = ""
            elif layers:
                texture = self.ctx.texture_array(size, f.components, data, dtype=f.dtype)
            elif len(size) == 3:
                texture = self.ctx.texture3d(size, f.components, data, dtype=f.dtype)
            else:
                texture = self.ctx.texture(size, f.components, data, dtype=f.dtype)
        except Exception as error:
            raise self._allocation_error(label, nbytes, error) from error
        self._check_allocation(label, nbytes)
        texture.repeat_x = texture.repeat_y = False
        if len(size) == 3 and not layers:
            texture.repeat_z = False
        mode = moderngl.LINEAR if filter == "linear" else moderngl.NEAREST
        if f.glsl == "":
            texture.filter = (mode, mode)
        else:
            texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self._register(texture, label, nbytes)
        return texture

    def buffer(self, label: str, data: np.ndarray | bytes | None = None, *, size: int = 0) -> moderngl.Buffer:
        """Allocate a buffer with ``data``, or ``size`` bytes of zeros. A buffer is never empty: 16 bytes at least."""
        raw = data.tobytes() if isinstance(data, np.ndarray) and not data.flags.c_contiguous else data
        nbytes = max(16, size if raw is None else (raw.nbytes if isinstance(raw, np.ndarray) else len(raw)))
        self._reserve(label, nbytes)
        try:
            if raw is None or nbytes > (raw.nbytes if isinstance(raw, np.ndarray) else len(raw)):
                buffer = self.ctx.buffer(reserve=nbytes)
                buffer.clear()
                if raw is not None and len(raw):
                    buffer.write(raw)
            else:
                buffer = self.ctx.buffer(raw)
        except Exception as error:
            raise self._allocation_error(label, nbytes, error) from error
        self._check_allocation(label, nbytes)
        self._register(buffer, label, nbytes)
        return buffer

    def framebuffer(self, color: list, depth=None) -> moderngl.Framebuffer:
        """A framebuffer over existing textures. Raises GLError if the driver can't render to them."""
        try:
            return self.ctx.framebuffer(color, depth)
        except Exception as error:
            raise GLError(f"this driver cannot render to the requested targets: {error}") from error

    def release(self, *resources) -> None:
        """Free textures, buffers, vertex arrays or framebuffers now rather than when Python gets to it."""
        for resource in resources:
            if resource is not None:
                if isinstance(resource, moderngl.Framebuffer):
                    self.idle.use()
                self._resources.pop(id(resource), None)
                resource.release()

    def _register(self, resource, label: str, nbytes: int) -> None:
        key = id(resource)
        self._resources[key] = (weakref.ref(resource, lambda _, k=key: self._resources.pop(k, None)), label, nbytes)

    def _reserve(self, label: str, nbytes: int) -> None:
        if self.budget is not None and self.bytes() + nbytes > self.budget:
            raise self._allocation_error(label, nbytes)

    def _check_allocation(self, label: str, nbytes: int) -> None:
        # glGetError drains a pipeline on some drivers; small resources don't run out of memory by themselves.
        if nbytes > 4 * MIB and self.ctx.error == "GL_OUT_OF_MEMORY":
            raise self._allocation_error(label, nbytes)

    def _allocation_error(self, label: str, nbytes: int, cause: Exception | None = None) -> GLOutOfMemory:
        held = ", ".join(f"{name} {size / MIB:.0f}" for name, size in self.resources()[:5])
        return GLOutOfMemory(
            f"{label} needs {nbytes / MIB:.0f} MiB and does not fit beside the {self.bytes() / MIB:.0f} MiB held"
            + (f" (MiB: {held})" if held else "")
            + ". Lower the resolution of the picture or of the technique."
            + (f" [{cause}]" if cause else "")
        )

    # -- programs ------------------------------------------------------------------------------------------------

    def program(
        self,
        title: str,
        stages: Mapping[str, str],
        *,
        prelude: Mapping[str, str] | None = None,
        defines: Mapping[str, int] | None = None,
        virtual: Mapping[str, str] | None = None,
    ) -> moderngl.Program | moderngl.ComputeShader:
        """Compile (once) a program from shader files.

        ``stages`` maps ``vertex``/``fragment``/``geometry``/``compute`` to paths below ``glsl/``; ``prelude`` holds
        generated declarations per stage; ``virtual`` holds generated files that the sources include.
        """
        prelude = prelude or {}
        sources = {
            stage: self.library.source(path, prelude=prelude.get(stage, ""), defines=defines, virtual=virtual)
            for stage, path in stages.items()
        }
        key = tuple(sorted((stage, source.text) for stage, source in sources.items()))
        if key not in self._programs:
            self._programs[key] = self._compile(title, sources)
            self.compiled += 1
        return self._programs[key]

    def _compile(self, title: str, sources: dict[str, Source]):
        try:
            if "compute" in sources:
                return self.ctx.compute_shader(sources["compute"].text)
            return self.ctx.program(**{f"{stage}_shader": source.text for stage, source in sources.items()})
        except Exception as error:
            log = str(error)
            stage = next((s for s in sources if f"{s}_shader" in log), next(iter(sources)))
            raise ShaderError(sources[stage].explain(log, title)) from None

    # -- errors --------------------------------------------------------------------------------------------------

    def check(self, where: str) -> None:
        """Raise for a pending GL error. Call at the end of a frame, not in its middle: it can stall."""
        error = self.ctx.error
        if error in ("GL_NO_ERROR", None):
            return
        if error == "GL_OUT_OF_MEMORY":
            raise GLOutOfMemory(f"the driver ran out of memory in {where} ({self.bytes() / MIB:.0f} MiB held)")
        if "CONTEXT_LOST" in error or error == "GL_UNKNOWN_ERROR":
            raise GLContextLost(f"the graphics driver dropped the context in {where}; rendering again starts a new one")
        raise GLError(f"{where}: {error} from the graphics driver {self.driver}")

    def close(self) -> None:
        """Release the context and all it owns."""
        self._programs.clear()
        self._resources.clear()
        self.ctx.release()


def _create_context() -> moderngl.Context:
    if platform.system() == "Darwin":
        raise GLTooOld("Quartet needs OpenGL 4.3; macOS stops at OpenGL 4.1. Use Linux or Windows.")
    options = {} if platform.system() == "Windows" else {"backend": "egl"}
    try:
        return moderngl.create_context(standalone=True, require=330, **options)
    except Exception as error:
        raise GLUnavailable(
            f"no OpenGL context on this machine ({error}). Install the graphics driver; without a GPU, Mesa's software "
            "driver will do (Debian/Ubuntu: apt install libegl1 libgl1-mesa-dri)."
        ) from error


def _physical_memory() -> int:
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        return 8 << 30
