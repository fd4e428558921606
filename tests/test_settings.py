# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings: one declaration, no dead knobs."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from conftest import make

from gi_addon.compare import scenes
from gi_addon.settings import SettingError, Settings, markdown, walk

# A value unlike the default for every setting, so that a new one without an entry fails here.
OTHER = {
    "technique": None, "use_indirect_diffuse": False, "use_glossy": False, "share_reflections": False,
    "use_shadows": False, "use_ao": False,
    "use_translucency": False, "use_volumetric": False, "use_area_lights": False, "samples": 3,
    "viewport_samples": None, "bounces": 0, "pixel_filter": "BLACKMAN_HARRIS", "filter_width": 3.0,
    "shadows.resolution": 64, "shadows.softness": 6.0, "ao.samples": 1, "ao.steps": 1, "ao.distance": 0.3,
    "ao.contact": 0.005, "world.samples": 1, "world.aimed": False, "world.rays": 4, "world.resolution": 64,
    "rsm.resolution": 32, "rsm.samples": 7, "rsm.own_samples": True,
    "volume.samples": 2, "volume.density": 0.2, "volume.anisotropy": 0.5, "rsm.visibility": "NONE",
    "rsm.visibility_resolution": 32, "rsm.visibility_rays": 32,
    "gather_scale": 1, "motion_steps": None,
    "lpv.resolution": 16, "lpv.cascades": "2", "lpv.iterations": 2, "lpv.directions": "48", "lpv.occlusion": False,
}  # fmt: skip
# Not read by the picture itself: the viewport's own number of sub-frames; and effects whose techniques have yet to land.
ELSEWHERE = {"viewport_samples", "motion_steps", "technique"}


@functools.cache
def scene():
    """Something of everything: sun, area light, world, occluders, gloss, glass."""
    s = scenes.cornell(light="area")
    s.lights.append(scenes.sun_light((0.25, 0.8, -0.9), 3.0, 0.02))
    s.materials[0] = scenes.principled(Base_Color=scenes.WHITE, Roughness=0.3)
    s.materials.append(scenes.principled(Transmission_Weight=0.8, Roughness=0.1))
    s.instances.materials[-1] = (len(s.materials) - 1,)
    s.world = scenes.world((0.3, 0.4, 0.5))
    return s


# Settings that only tell in haze, which the scene has none of by itself.
IN_HAZE = {"use_volumetric", "volume.samples", "volume.anisotropy"}


@functools.cache
def picture(path="", **settings):
    """The scene with the setting ``path`` at its other value."""
    chosen = {"samples": 2, **settings}
    if path:
        chosen[path.replace(".", "__")] = OTHER[path]
    return make(scene(), "Combined", "Ambient Occlusion", **chosen)


# Those of a technique that is not the default are tested with it.
@pytest.mark.parametrize("path", [p for p, _, _ in walk() if not p.startswith(("ssdo.", "vct."))])
def test_every_setting_changes_the_picture_or_the_plan(gl, path):
    if path in ELSEWHERE:
        assert OTHER[path] is None
        return
    where = {"volume__density": 0.1} if path in IN_HAZE else {"technique": "LPV"} if path.startswith("lpv.") else {}
    if path == "world.aimed":
        where["samples"] = 4  # fewer are not aimed
    result, base = picture(path, **where), picture(**where)
    changed = any(not np.array_equal(result.passes[n], base.passes[n]) for n in base.passes)
    assert changed or result.plan.text() != base.plan.text()


def test_values_are_checked_and_say_what_is_wrong():
    s = Settings()
    s.set("rsm.samples", "300")
    s.set("use_ao", "off")
    s.set("pixel_filter", "blackman_harris")
    assert s.rsm.samples == 300 and s.use_ao is False and s.pixel_filter == "BLACKMAN_HARRIS"
    for path, value, message in (
        ("rsm.samples", "many", "whole number"), ("rsm.samples", 0, "outside"), ("rsm.sample", 3, "rsm.samples"),
        ("technique", "RTX", "none of"), ("use_ao", "perhaps", "on/off"), ("rsm", 3, "no setting"),
        ("filter_width", "nan", "number"), ("rsm.samples", 2.5, "whole number"),
    ):  # fmt: skip
        with pytest.raises(SettingError, match=message):
            s.set(path, value)


def test_the_ends_of_a_range_survive_blenders_32_bits():
    """0.99 comes from Blender as 0.9900000095 and must not stop a render."""
    s = Settings()
    for path, end in (("volume.anisotropy", 0.99), ("filter_width", 0.01), ("ssdo.thickness", 0.01)):
        s.set(path, float(np.float32(end)))
        assert s.get(path) == end
    with pytest.raises(SettingError, match="outside"):
        s.set("volume.anisotropy", 0.991)


def test_a_copy_is_independent():
    a = Settings()
    b = a.copy()
    b.rsm.samples = 7
    assert a.rsm.samples != 7 and a.as_dict() != b.as_dict()


def test_the_docs_list_every_setting():
    text = markdown()
    assert all(f"`{path}`" in text for path, _, _ in walk())


def test_the_committed_settings_page_is_current():
    from conftest import ROOT

    assert (ROOT / "docs" / "settings.md").read_text().endswith(markdown()), "run scripts/make_docs.py"
