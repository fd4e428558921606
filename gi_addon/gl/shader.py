# SPDX-License-Identifier: GPL-3.0-or-later
"""Shader files to GLSL text: ``#include``, defines, line numbers that survive, and undefined macros as errors."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from .errors import ShaderError

ROOT = Path(__file__).resolve().parent.parent / "glsl"
VERSION = "#version 430 core"
DECLARATIONS = "generated/declarations.glsl"

_INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"\s*$')
_DEFINE = re.compile(r"^\s*#\s*(?:define|undef)\s+(\w+)")
_CONDITION = re.compile(r"^\s*#\s*(?:if|elif)\s+(.*)$")
_IDENTIFIER = re.compile(r"\b[A-Za-z_]\w*\b")
_COMMENT = re.compile(r"//.*$|/\*.*?\*/")
# Mesa: "3:10(52): error: ..."; NVIDIA: "3(10) : error C0000: ..."; AMD and Intel: "ERROR: 3:10: ...".
_MESSAGE = re.compile(r"^(?:ERROR:\s*|WARNING:\s*)?(\d+)(?::(\d+)(?:\((\d+)\))?|\((\d+)\))\s*:\s*(.*)$")
# Some compilers forget the file number of ``#line`` in half of their messages; the line number survives everywhere, so
# it carries both: file × this + line.
_FILE_STRIDE = 100_000
_MACROS_OF_GLSL = {"defined", "GL_core_profile", "__VERSION__", "GL_es_profile"}


@dataclass
class Source:
    """Preprocessed text of one shader stage and the files its ``#line`` numbers refer to."""

    text: str
    files: list[str] = field(default_factory=list)

    def explain(self, log: str, title: str) -> str:
        """Rewrite a driver's compile log so that it names files and shows the offending lines."""
        lines = [f"{title} did not compile:"]
        for raw in log.splitlines():
            match = _MESSAGE.match(raw.strip())
            if not match:
                continue
            index, line = divmod(int(match[2] or match[4]), _FILE_STRIDE)
            text = match[5]
            name = self.files[index] if index < len(self.files) else f"source {index}"
            lines.append(f"  {name}:{line}: {text}")
            excerpt = self._line(index, line)
            if excerpt:
                lines.append(f"      {excerpt.strip()}")
        if len(lines) == 1:
            lines.append("  " + log.strip().replace("\n", "\n  "))
        return "\n".join(lines)

    def _line(self, index: int, line: int) -> str:
        """The text at ``line`` of file ``index``, found by replaying the ``#line`` directives."""
        current = 0
        for text in self.text.splitlines():
            directive = re.match(r"^#line (\d+)$", text)
            if directive:
                current = int(directive[1]) - 1
                continue
            current += 1
            if current == index * _FILE_STRIDE + line:
                return text
        return ""


class ShaderLibrary:
    """Loads shader files below ``roots`` (first match wins) and generated text from ``virtual`` (path -> text)."""

    def __init__(self, *roots: Path) -> None:
        self.roots = roots or (ROOT,)
        self._cache: dict[str, str] = {}

    def read(self, path: str, virtual: Mapping[str, str] | None = None) -> str:
        """Text of a shader file by its path below ``glsl/``. Raises ShaderError when there is none."""
        if virtual and path in virtual:
            return virtual[path]
        if path not in self._cache:
            for root in self.roots:
                if (root / path).is_file():
                    self._cache[path] = (root / path).read_text(encoding="utf-8")
                    break
            else:
                raise ShaderError(f"shader file {path!r} is missing")
        return self._cache[path]

    def source(
        self,
        path: str,
        *,
        prelude: str = "",
        defines: Mapping[str, int] | None = None,
        virtual: Mapping[str, str] | None = None,
    ) -> Source:
        """Flatten ``path``: version, defines, ``prelude`` (generated declarations), then the file with its includes.

        Every file is included once. Raises ShaderError for a missing include and for a macro that is tested by
        ``#if`` but never defined: GLSL would take it for 0 in silence.
        """
        out = [VERSION]
        defines = dict(defines or {})
        out += [f"#define {name} {value}" for name, value in sorted(defines.items())]
        source = Source("", [])
        known = _MACROS_OF_GLSL | set(defines)
        virtual = {**(virtual or {}), DECLARATIONS: prelude}
        seen: set[str] = set()
        self._append(DECLARATIONS, out, source.files, seen, known, virtual, "")
        self._append(path, out, source.files, seen, known, virtual, "")
        source.text = "\n".join(out) + "\n"
        return source

    def _append(self, path, out, files, seen, known, virtual, origin) -> None:
        if path in seen:
            return
        seen.add(path)
        try:
            text = self.read(path, virtual)
        except ShaderError as error:
            raise ShaderError(f"{origin}: {error}" if origin else str(error)) from None
        index = len(files)
        files.append(path)
        out.append(f"#line {index * _FILE_STRIDE + 1}")
        for number, line in enumerate(text.splitlines(), start=1):
            include = _INCLUDE.match(line)
            if include:
                self._append(include[1], out, files, seen, known, virtual, f"{path}:{number}")
                out.append(f"#line {index * _FILE_STRIDE + number + 1}")
                continue
            define = _DEFINE.match(line)
            if define:
                known.add(define[1])
            condition = _CONDITION.match(_COMMENT.sub("", line))
            if condition:
                for name in _IDENTIFIER.findall(condition[1]):
                    if name not in known:
                        raise ShaderError(f"{path}:{number}: macro {name} is tested but never defined")
            out.append(line)

