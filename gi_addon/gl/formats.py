# SPDX-License-Identifier: GPL-3.0-or-later
"""Texel formats by their OpenGL names: the one table that allocation, shader declarations and MiB accounting share."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Format:
    """A texel format.

    ``components``/``dtype`` are moderngl's; ``glsl`` is the prefix of its sampler and image types ('' float, 'u' uint);
    ``image`` the layout qualifier for image load/store, or None where OpenGL 4.3 has none.
    """

    name: str
    components: int
    dtype: str
    bytes: int
    glsl: str = ""
    image: str | None = None

    @property
    def value_type(self) -> str:
        """The GLSL type of one texel as a fragment output, e.g. ``vec4`` or ``uint``."""
        if self.components == 1:
            return "uint" if self.glsl == "u" else "float"
        return f"{self.glsl}vec{self.components}"


FORMATS: dict[str, Format] = {
    f.name: f
    for f in (
        Format("r8", 1, "f1", 1, image="r8"),
        Format("rg8", 2, "f1", 2, image="rg8"),
        Format("rgba8", 4, "f1", 4, image="rgba8"),
        Format("rg16", 2, "nu2", 4, image="rg16"),
        Format("rgba16", 4, "nu2", 8, image="rgba16"),
        Format("r16f", 1, "f2", 2, image="r16f"),
        Format("rg16f", 2, "f2", 4, image="rg16f"),
        Format("rgba16f", 4, "f2", 8, image="rgba16f"),
        Format("r32f", 1, "f4", 4, image="r32f"),
        Format("rg32f", 2, "f4", 8, image="rg32f"),
        Format("rgba32f", 4, "f4", 16, image="rgba32f"),
        Format("r32ui", 1, "u4", 4, glsl="u", image="r32ui"),
        Format("rg32ui", 2, "u4", 8, glsl="u", image="rg32ui"),
        Format("rgba32ui", 4, "u4", 16, glsl="u", image="rgba32ui"),
        # moderngl's depth texture: a 24-bit depth buffer, read back and sampled as float.
        Format("depth24", 1, "f4", 4),
    )
}
