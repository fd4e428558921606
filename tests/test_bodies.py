# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that walks through a body below its surface and lights others, against walks in a slab and Cycles."""

from __future__ import annotations

import numpy as np
import pytest
import voxel_store
from conftest import make
from test_lpv import flux_of, volumes
from test_subsurface import lit_slab, slab, wax

from gi_addon.compare import scenes
from gi_addon.engines.vct import radiance_unit
from gi_addon.gl import GL, shared
from gi_addon.renderer import Renderer, inspect
from gi_addon.settings import Settings


def settings(technique: str, **changed) -> Settings:
    chosen = Settings()
    chosen.technique, chosen.samples = technique, 1
    for name, value in changed.items():
        chosen.set(name.replace("__", "."), value)
    return chosen


def voxels(scene, **changed) -> np.ndarray:
    """Radiance × share covered that leaves the sheets, W/(m²·sr), by part of the cells: (axis, side, z, y, x, 4)."""

    def job(g: GL):
        renderer = Renderer(g)
        renderer.render(scene, settings("VCT", **{"vct__resolution": 32, **changed}), ("Diffuse Indirect",), resolution=(32, 18))
        _, out = voxel_store.light(renderer)
        out[..., :3] *= radiance_unit(renderer.frame.facts)
        renderer.close()
        return out

    return shared().call(job)


def radiance(light: np.ndarray) -> float:
    """Mean radiance of sheets (…, 4) that are there."""
    return float(light[..., 0].sum() / light[..., 3].sum())


def sun_on_ball(material):
    b = scenes.SceneBuilder()
    b.add(scenes.sphere(0.5, 48, 24), material)
    b.light(scenes.sun_light((0.0, 1.0, 0.0), 3.0))
    return b.build(scenes.orthographic((0, -1, 0), (0, 0, 0), 2.0, aspect=16 / 9))


# --- voxel cone tracing ---------------------------------------------------------------------------------------------------


def test_a_slabs_sheets_send_out_what_walks_let_through_and_return(gl):
    """π L/E of the far and of the near side of a slab two free paths thick and less than a cell, lit evenly from one side."""
    light = voxels(lit_slab(0.1, wax(0.05), 1.0))
    through, back = slab(2.0, 0.8, evenly=True)
    middle = (slice(12, 20), slice(None), slice(12, 20))
    # The sun goes along +y: it shines on what faces −y, part (1, 1).
    assert np.pi / 3.0 * radiance(light[1, 1][middle]) == pytest.approx(back, abs=0.02)
    assert np.pi / 3.0 * radiance(light[1, 0][middle]) == pytest.approx(through, abs=0.02)


def test_what_a_ball_that_absorbs_nothing_takes_in_it_gives_out(gl):
    """At .97 its turns keep all. Where the free path is small light leaves where it enters, but for half floats' rounding."""
    def leaving(path, **changed):
        return voxels(sun_on_ball(wax(path, albedo=0.97)), vct__resolution=16, **changed)

    before, after = leaving(0.1, use_translucency=False), leaving(0.1)
    assert after[..., 0].sum() * 0.97 / before[..., 0].sum() == pytest.approx(1.0, abs=0.02)
    np.testing.assert_array_equal(leaving(0.1), after)
    np.testing.assert_allclose(leaving(1e-4), before, rtol=2e-3)


def test_what_scatters_nowhere_costs_nothing(gl):
    bodies = ("voxels.bodies", "vct.walked")
    for scene, changed in ((scenes.cornell(), {}), (sun_on_ball(wax(0.1)), {"use_translucency": False})):
        for technique in ("VCT", "LPV"):
            plan = inspect(scene, settings(technique, **changed), resolution=(32, 18))
            assert not set(bodies) & set(plan.resources)
            assert technique == "VCT" or not [name for name in plan.resources if name.startswith("voxels.")]
    plan = inspect(sun_on_ball(wax(0.1)), settings("VCT"), resolution=(32, 18))
    assert set(bodies) <= set(plan.resources)


# --- light propagation volumes ------------------------------------------------------------------------------------------


def test_a_slabs_flux_goes_into_the_volume_on_the_side_that_it_leaves(gl):
    """Of 48 W that the sun sends into a slab of 4 × 4 m: by the sources' sum, and by their first moment, 2/3 of the far side's
    flux less the near one's."""
    grid, source, _, _ = volumes(lit_slab(0.1, wax(0.05), 1.0), lpv__cascades="1")
    through, back = slab(2.0, 0.8, evenly=True)
    assert flux_of(source, grid.cell).mean() / 48.0 == pytest.approx(through + back, abs=0.02)
    first = np.sqrt(4.0 * np.pi / 3.0) * source[1, ..., 0].sum() * grid.cell**2  # c₁: along y
    assert 1.5 * first / 48.0 == pytest.approx(through - back, abs=0.02)
    grid, source, _, _ = volumes(lit_slab(0.1, wax(1e-4), 1.0), lpv__cascades="1")
    assert flux_of(source, grid.cell).mean() / 48.0 == pytest.approx(0.8, abs=0.005)


# --- both, against Cycles -------------------------------------------------------------------------------------------------


@pytest.mark.blender
def test_a_window_of_wax_lights_a_dark_room_as_in_cycles(blender, gl):
    """R1, Diffuse Indirect of floor, walls and ceiling, as a whole. Both send it out by Lambert's law, Cycles does not quite."""
    from gi_addon.host.build import build
    from gi_addon.host.cycles import Reference, render_passes, set_up

    scene, size = scenes.window(wax(0.1, Specular_IOR_Level=0.5)), (32, 18)
    there = build(scene)
    there.render.resolution_x, there.render.resolution_y, there.render.resolution_percentage = *size, 100
    set_up(there, Reference(1, 128))
    expected = render_passes(there, ("Diffuse Indirect",))["Diffuse Indirect"][..., :3]
    room = expected.max(axis=-1) > 0.05 * expected.max()
    for technique in ("VCT", "LPV"):
        options = {"technique": technique, "samples": 1, "resolution": size, "vct__resolution": 24}
        found = make(scene, "Diffuse Indirect", **options).passes["Diffuse Indirect"][..., :3]
        assert found[room].sum() / expected[room].sum() == pytest.approx(1.0, abs=0.15), technique
