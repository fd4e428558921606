# SPDX-License-Identifier: GPL-3.0-or-later
"""The passes written, with Blender's names and Cycles' meanings, and the film layers they are made of.

A light pass is light without the surface's colour: the film adds light × colour and colour over the sub-frames, and the
pass is their ratio, as in Cycles. So Combined is exactly Σ light × colour + emission + environment.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Output:
    """A pass: Blender's ``name`` (``short`` before 5.0), ``channels`` (as in ``register_pass``), socket ``kind``, the view
    layer's ``flag``, the film ``layers`` it needs, and ``divide``: the layer of colour that its light is divided by."""

    name: str
    short: str
    channels: str
    kind: str
    flag: str
    layers: tuple[str, ...]
    divide: str | None = None


def _light(name: str, short: str, flag: str, layer: str, color: str) -> Output:
    return Output(name, short, "RGB", "COLOR", flag, (layer, color), color)


OUTPUTS: dict[str, Output] = {
    o.name: o
    for o in (
        Output("Combined", "Combined", "RGBA", "COLOR", "use_pass_combined", ("combined",)),
        Output("Depth", "Depth", "Z", "VALUE", "use_pass_z", ("depth",)),
        Output("Normal", "Normal", "XYZ", "VECTOR", "use_pass_normal", ("normal",)),
        _light("Diffuse Direct", "DiffDir", "use_pass_diffuse_direct", "diffuse_direct", "diffuse_color"),
        _light("Diffuse Indirect", "DiffInd", "use_pass_diffuse_indirect", "diffuse_indirect", "diffuse_color"),
        Output("Diffuse Color", "DiffCol", "RGB", "COLOR", "use_pass_diffuse_color", ("diffuse_color",)),
        _light("Glossy Direct", "GlossDir", "use_pass_glossy_direct", "glossy_direct", "glossy_color"),
        _light("Glossy Indirect", "GlossInd", "use_pass_glossy_indirect", "glossy_indirect", "glossy_color"),
        Output("Glossy Color", "GlossCol", "RGB", "COLOR", "use_pass_glossy_color", ("glossy_color",)),
        _light("Transmission Direct", "TransDir", "use_pass_transmission_direct", "transmission_direct", "transmission_color"),
        _light("Transmission Indirect", "TransInd", "use_pass_transmission_indirect", "transmission_indirect",
               "transmission_color"),
        Output("Transmission Color", "TransCol", "RGB", "COLOR", "use_pass_transmission_color", ("transmission_color",)),
        Output("Volume Direct", "VolumeDir", "RGB", "COLOR", "cycles.use_pass_volume_direct", ("volume_direct",)),
        Output("Volume Indirect", "VolumeInd", "RGB", "COLOR", "cycles.use_pass_volume_indirect", ("volume_indirect",)),
        Output("Emission", "Emit", "RGB", "COLOR", "use_pass_emit", ("emission",)),
        Output("Environment", "Env", "RGB", "COLOR", "use_pass_environment", ("environment",)),
        Output("Ambient Occlusion", "AO", "RGB", "COLOR", "use_pass_ambient_occlusion", ("ao",)),
        Output("Shadow", "Shadow", "RGB", "COLOR", "use_pass_shadow", ("shadow",)),
    )
}  # fmt: skip

LONG_NAMES = {o.short: o.name for o in OUTPUTS.values()}

# Film layers and the graph resources that feed each. A layer whose resources are all absent stays black: there is no
# such light in the scene. What these resources are (all full size, one texel a pixel):
#   direct.diffuse, indirect.diffuse      radiance that a white Lambert surface would reflect, E/π, W/(m²·sr)
#   direct.glossy, indirect.glossy        radiance that the glossy lobe reflects, with its colour
#   reflected.sources                     what it reflects of the world and of emissive surfaces where rays find them, and they
#                                         are not among the lights of direct.glossy
#   subsurface.direct, .indirect          direct.diffuse and indirect.diffuse after scattering below the surface; alpha: the
#                                         share of the surface's colour that they are for
#   gbuffer.transmission                  tint of the refracting surfaces in front; 1 where there is none
#   transmission.direct                   light from behind through translucent surfaces, tinted; alpha 1 where there are any
#   transmission.indirect                 radiance that arrives through them, tinted, where the technique knows it (alpha 1);
#                                         elsewhere they show what is straight behind
#   gbuffer.tint                          share of what is behind that coloured transparent surfaces leave
#   volume.light                          radiance scattered towards the eye in front of the surface; alpha: the mean share
#                                         of the light behind that still passes
#   volume.indirect                       the same of light that surfaces or the air have scattered before, where the technique
#                                         knows it
#   volume.transmittance                  that share by colour, where the technique knows it
#   direct.shadow                         share of the direct irradiance that is not blocked: what a shadow catcher shows
LAYERS: dict[str, tuple[str, ...]] = {
    "combined": (
        "gbuffer.depth", "gbuffer.diffuse", "gbuffer.emission", "direct.diffuse", "direct.glossy", "reflected.sources",
        "indirect.diffuse", "indirect.glossy", "gbuffer.transmission", "transmission.direct", "transmission.indirect",
        "volume.light", "volume.indirect", "volume.transmittance", "gbuffer.tint", "subsurface.direct", "subsurface.indirect",
        "direct.shadow",
    ),
    "depth": ("gbuffer.depth",),
    "normal": ("gbuffer.depth", "gbuffer.normal"),
    "diffuse_direct": ("gbuffer.depth", "gbuffer.diffuse", "direct.diffuse", "subsurface.direct", "gbuffer.transmission",
                       "transmission.direct", "volume.transmittance", "gbuffer.tint"),
    "diffuse_indirect": ("gbuffer.depth", "gbuffer.diffuse", "indirect.diffuse", "subsurface.indirect", "gbuffer.transmission",
                         "transmission.direct", "transmission.indirect", "volume.transmittance", "gbuffer.tint"),
    "diffuse_color": ("gbuffer.depth", "gbuffer.diffuse", "gbuffer.transmission", "transmission.direct",
                      "volume.transmittance", "gbuffer.tint"),
    "glossy_direct": ("gbuffer.depth", "direct.glossy", "reflected.sources", "volume.transmittance", "gbuffer.tint"),
    "glossy_indirect": ("gbuffer.depth", "indirect.glossy", "volume.transmittance", "gbuffer.tint"),
    "glossy_color": ("gbuffer.depth", "gbuffer.normal", "gbuffer.specular", "gbuffer.lobe", "brdf.albedo",
                     "brdf.average", "brdf.energy", "volume.transmittance", "gbuffer.tint"),
    "transmission_direct": ("gbuffer.depth", "gbuffer.transmission", "gbuffer.diffuse", "gbuffer.emission",
                            "direct.diffuse", "direct.glossy", "reflected.sources", "transmission.direct",
                            "volume.transmittance", "gbuffer.tint"),
    "transmission_indirect": ("gbuffer.depth", "gbuffer.transmission", "gbuffer.diffuse", "gbuffer.emission",
                              "direct.diffuse", "direct.glossy", "reflected.sources", "indirect.diffuse", "indirect.glossy",
                              "transmission.direct", "transmission.indirect", "volume.transmittance", "gbuffer.tint"),
    "transmission_color": ("gbuffer.depth", "gbuffer.transmission", "volume.transmittance", "gbuffer.tint"),
    "volume_direct": ("volume.light",),
    "volume_indirect": ("volume.indirect",),
    "emission": ("gbuffer.depth", "gbuffer.emission", "volume.transmittance", "gbuffer.tint"),
    "environment": ("gbuffer.depth", "volume.transmittance", "gbuffer.tint"),
    "ao": ("gbuffer.depth", "ao"),
    "shadow": ("gbuffer.depth", "direct.shadow"),
}  # fmt: skip


def film_layers(outputs: Iterable[str]) -> tuple[str, ...]:
    """Film layers needed for ``outputs``, in a fixed order."""
    needed = {layer for name in outputs for layer in OUTPUTS[name].layers}
    return tuple(layer for layer in LAYERS if layer in needed)


def develop(film: Mapping[str, np.ndarray], outputs: Iterable[str]) -> dict[str, np.ndarray]:
    """Passes (H, W, channels) f4 from film layers (H, W, 4), already averaged over the sub-frames."""
    result: dict[str, np.ndarray] = {}
    for name in outputs:
        output = OUTPUTS[name]
        value = film[output.layers[0]][..., : len(output.channels)]
        if output.divide:
            color = film[output.divide][..., :3]
            value = np.divide(value, color, out=np.zeros_like(value), where=color > 0.0)
        result[name] = np.ascontiguousarray(value, np.float32)
    return result
