# SPDX-License-Identifier: GPL-3.0-or-later
"""Call GLSL functions from Python: the harness of the shader unit tests."""

from __future__ import annotations

import numpy as np

from gi_addon.gl import GL
from gi_addon.gpu_types import GENERATED

_MAIN = """
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer in_block { vec4 inputs[]; };
layout(std430, binding = 1) buffer out_block { vec4 outputs[]; };
uniform int count;
#include "under_test.glsl"
void main()
{
    int i = int(gl_GlobalInvocationID.x);
    if (i >= count) { return; }
    outputs[i] = evaluate(inputs[i]);
}
"""


def evaluate(gl: GL, code: str, inputs: np.ndarray, *includes: str, textures=(), **defines: int) -> np.ndarray:
    """``vec4 evaluate(vec4)`` of GLSL ``code`` for inputs (N, 4) -> (N, 4) f4.

    ``includes`` are library files in front of it; ``textures`` are (declaration, moderngl texture), bound in order.
    """
    inputs = np.ascontiguousarray(np.atleast_2d(inputs), "f4")
    declared = "\n".join(f"layout(binding = {i}) uniform {text};" for i, (text, _) in enumerate(textures))
    body = declared + "\n" + "\n".join(f'#include "{name}"' for name in includes) + "\n" + code
    program = gl.program(
        "unit test",
        {"compute": "test_main.glsl"},
        defines=defines,
        virtual={**GENERATED, "test_main.glsl": _MAIN, "under_test.glsl": body},
    )
    source, target = gl.ctx.buffer(inputs), gl.ctx.buffer(reserve=inputs.nbytes)
    source.bind_to_storage_buffer(0)
    target.bind_to_storage_buffer(1)
    for unit, (_, texture) in enumerate(textures):
        texture.use(unit)
    program["count"].value = len(inputs)
    program.run(-(-len(inputs) // 64))
    gl.ctx.memory_barrier()
    out = np.frombuffer(target.read(), "f4").reshape(-1, 4).copy()
    source.release()
    target.release()
    return out
