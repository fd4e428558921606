# SPDX-License-Identifier: GPL-3.0-or-later
"""Shader graphs to GLSL: a material is one generated function that every pass drawing surfaces includes."""

from . import textures  # noqa: F401  registers its nodes
from .compiler import CompiledGraph, compile_surface, compile_world
from .means import Medium, mean_albedo, mean_emission, mean_medium

__all__ = ["CompiledGraph", "Medium", "compile_surface", "compile_world", "mean_albedo", "mean_emission", "mean_medium"]
