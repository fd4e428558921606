# SPDX-License-Identifier: GPL-3.0-or-later
"""Shader loading: includes, line numbers, macros."""

from __future__ import annotations

import pytest

from gi_addon.gl import ShaderError
from gi_addon.gl.shader import ShaderLibrary


def test_files_are_included_once():
    library = ShaderLibrary()
    virtual = {"a.glsl": '#include "b.glsl"\n#include "b.glsl"\nint a;', "b.glsl": "int b;"}
    assert library.source("a.glsl", virtual=virtual).text.count("int b;") == 1


def test_a_missing_include_names_the_line_that_asks_for_it():
    with pytest.raises(ShaderError, match=r"a\.glsl:2: .*nothing\.glsl"):
        ShaderLibrary().source("a.glsl", virtual={"a.glsl": '// a\n#include "nothing.glsl"'})


def test_an_undefined_macro_is_an_error():
    """GLSL would take it for 0 in silence."""
    with pytest.raises(ShaderError, match=r"a\.glsl:1: macro TYPO"):
        ShaderLibrary().source("a.glsl", virtual={"a.glsl": "#if TYPO\n#endif"}, defines={"TYPE": 1})
    ShaderLibrary().source("a.glsl", virtual={"a.glsl": "#if TYPE\n#endif"}, defines={"TYPE": 1})


@pytest.mark.gl
def test_a_compile_error_names_file_and_line_through_includes(gl):
    virtual = {
        "main_comp.glsl": '// one\n#include "inner_lib.glsl"\nlayout(local_size_x = 1) in;\nvoid main() { f(); }',
        "inner_lib.glsl": "// helper\n\nvoid f() { float x = ; }",
    }
    with pytest.raises(ShaderError, match=r"(?s)inner_lib\.glsl:3:.*float x = ;"):
        gl(lambda g: g.program("broken", {"compute": "main_comp.glsl"}, virtual=virtual))
    virtual["inner_lib.glsl"] = "void f() {}"
    virtual["main_comp.glsl"] = virtual["main_comp.glsl"].replace("f();", "g();")
    with pytest.raises(ShaderError, match=r"main_comp\.glsl:4:"):
        gl(lambda g: g.program("broken", {"compute": "main_comp.glsl"}, virtual=virtual))
