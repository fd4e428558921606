# SPDX-License-Identifier: GPL-3.0-or-later
"""What differs between Blender 4.5 and 5.x."""

from __future__ import annotations

import math

import bpy

from ..outputs import Output

ALWAYS_NODES = bpy.app.version >= (5, 0, 0)

# Mean free path of Cycles' random walk over a node's subsurface radius. Blender 4.5's is 1/(4π), 5.2's 1 (a ball lit from behind,
# albedo .8 and .5, radius times 4π in 4.5: the same picture within 1 %).
SUBSURFACE_PATH = 1.0 if ALWAYS_NODES else 0.25 / math.pi


def uses_nodes(data) -> bool:
    """Whether a material, world or light is shaded by its nodes. From 5.0 on it always is."""
    return data.node_tree is not None and (ALWAYS_NODES or data.use_nodes)


def node_tree(data) -> bpy.types.NodeTree:
    """The node tree of a material, world or light, switched on."""
    if not ALWAYS_NODES or data.node_tree is None:
        data.use_nodes = True
    return data.node_tree


def pass_name(output: Output) -> str:
    """A pass's name in this Blender: 5.0 spelled them out."""
    return output.name if bpy.app.version >= (5, 0, 0) else output.short
