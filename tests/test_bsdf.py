# SPDX-License-Identifier: GPL-3.0-or-later
"""The GGX lobe on the GPU against quadrature in numpy."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import make
from gpu import evaluate

from gi_addon.compare import scenes
from gi_addon.gl import shared
from gi_addon.renderer import Renderer
from gi_addon.settings import Settings

BSDF = "lib/bsdf_lib.glsl"


def hemisphere(n=256):
    """Directions (N, 3) and solid angles (N,) of a midpoint grid over the upper hemisphere, z = 1 − s² so that it is fine
    around the pole, where smooth lobes are."""
    s = (np.arange(n) + 0.5) / n
    phi = 2 * np.pi * (np.arange(2 * n) + 0.5) / (2 * n)
    s, phi = (a.ravel() for a in np.meshgrid(s, phi))
    z = 1 - s * s
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], 1), 2 * s / n * np.pi / n


@pytest.mark.parametrize("roughness", [0.3, 0.6, 1.0])
def test_the_normal_distribution_projects_to_one(gl, roughness):
    """∫ D(h) cosθ dω = 1 for any roughness."""
    h, dw = hemisphere(400)
    code = "vec4 evaluate(vec4 v) { return vec4(ggx_d(v.z, v.w)); }"
    d = gl(evaluate, code, np.column_stack([h, np.full(len(h), roughness**2)]), BSDF)[:, 0]
    assert np.sum(d * h[:, 2] * dw) == pytest.approx(1.0, abs=2e-3)


@pytest.mark.parametrize("cos_v", [0.2, 0.5, 0.95])
@pytest.mark.parametrize("roughness", [0.4, 0.8])
def test_the_lobe_never_gains_energy_and_the_table_knows_its_loss(gl, roughness, cos_v):
    """White furnace without Fresnel: ∫ f cosθ dω = E ≤ 1, and E equals the energy table's quadrature."""
    light, dw = hemisphere(400)
    v = f"vec3({np.sqrt(1 - cos_v**2)}, 0.0, {cos_v})"
    code = f"""vec4 evaluate(vec4 l) {{
        Lobe lobe = Lobe(vec3(1.0), 1.0, {roughness}, ETA_CONSTANT, 0.0);
        return vec4(ggx_eval(lobe, {roughness**2}, vec3(0.0, 0.0, 1.0), {v}, l.xyz), 0.0);
    }}"""
    total = np.sum(gl(evaluate, code, np.column_stack([light, light[:, 0]]), BSDF)[:, 0] * dw)
    assert total <= 1.0 + 1e-3
    table = _energy_table()
    x, y = roughness * 31, cos_v * 31
    i, j = int(x), int(y)
    fx, fy = x - i, y - j
    e = sum(
        w * table[jj, ii, 0]
        for ii, jj, w in ((i, j, (1 - fx) * (1 - fy)), (i + 1, j, fx * (1 - fy)), (i, j + 1, (1 - fx) * fy),
                          (i + 1, j + 1, fx * fy))
    )  # fmt: skip
    assert e == pytest.approx(total, abs=0.01)


_tables: dict = {}


def _energy_table() -> np.ndarray:
    if "energy" not in _tables:
        scene = scenes.plane_scene(scenes.point_light((0, 0, 2), 10), material=scenes.principled())

        def job(gl):
            renderer = Renderer(gl)
            settings = Settings()
            settings.samples = 1
            renderer.render(scene, settings, ("Glossy Direct",), resolution=(16, 9))
            data = renderer.frame.resources["brdf.energy"].read()
            renderer.close()
            return np.frombuffer(data, "f4").reshape(32, 32, 2).copy()

        _tables["energy"] = shared().call(job)
    return _tables["energy"]


def test_the_brdf_is_reciprocal(gl):
    """f(v, l) = f(l, v); the function holds f cosθ_l."""
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(2, 500, 3))
    a[:, 2], b[:, 2] = np.abs(a[:, 2]) + 0.05, np.abs(b[:, 2]) + 0.05
    a, b = (x / np.linalg.norm(x, axis=1, keepdims=True) for x in (a, b))
    code = """
    vec3 f(vec3 v, vec3 l) {
        Lobe lobe = Lobe(vec3(0.3, 0.1, 0.04), 1.0, 0.5, 1.5, 0.0);
        return ggx_eval(lobe, 0.25, vec3(0.0, 0.0, 1.0), v, l) / l.z;
    }
    vec3 up(vec2 xy) { return vec3(xy, sqrt(max(0.0, 1.0 - dot(xy, xy)))); }
    vec4 evaluate(vec4 ab) { return vec4((f(up(ab.xy), up(ab.zw)) - f(up(ab.zw), up(ab.xy))) / f(up(ab.xy), up(ab.zw)), 0.0); }
    """
    out = gl(evaluate, code, np.column_stack([a[:, :2], b[:, :2]]), BSDF)
    assert np.abs(out[:, :3]).max() < 1e-3


def test_dielectric_fresnel_has_its_known_values(gl):
    """Normal incidence ((n−1)/(n+1))², grazing 1, Brewster's angle half of the s-polarised reflectance, and total
    reflection from inside beyond asin(1/n)."""
    code = """vec4 evaluate(vec4 v) {
        return vec4(fresnel_dielectric(v.x, v.y), f0_from_ior(v.y), ior_from_f0(f0_from_ior(v.y)), 0.0);
    }"""
    n = 1.5
    brewster = np.cos(np.arctan(n))
    out = gl(evaluate, code, np.array([[1, n, 0, 0], [0, n, 0, 0], [brewster, n, 0, 0], [0.5, 1 / n, 0, 0]]), BSDF)
    assert out[0, 0] == pytest.approx(0.04, abs=1e-5) and out[0, 1] == pytest.approx(0.04, abs=1e-6)
    assert out[0, 2] == pytest.approx(n, abs=1e-4)
    assert out[1, 0] == pytest.approx(1.0, abs=1e-5)
    cos_t = np.sqrt(1 - (1 - brewster**2) / n**2)
    rs = ((brewster - n * cos_t) / (brewster + n * cos_t)) ** 2
    assert out[2, 0] == pytest.approx(rs / 2, abs=1e-4)
    assert out[3, 0] == 1.0


def test_octahedral_normals_survive_sixteen_bits(gl):
    rng = np.random.default_rng(2)
    n = rng.normal(size=(2000, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    n = np.vstack([n, np.eye(3), -np.eye(3)])
    code = """vec4 evaluate(vec4 v) {
        vec2 e = round(octahedral_encode(v.xyz) * 65535.0) / 65535.0;
        return vec4(octahedral_decode(e), 0.0);
    }"""
    out = gl(evaluate, code, np.column_stack([n, n[:, 0]]), "lib/math_lib.glsl")[:, :3]
    assert np.degrees(np.arccos(np.clip((out * n).sum(1), -1, 1))).max() < 0.05


@pytest.mark.parametrize("metallic", [0.0, 1.0])
def test_a_material_in_a_white_world_gives_back_no_more_than_white(gl, metallic):
    """A plane under a uniform sky of radiance 1: Combined ≤ 1 however rough, and close to 1 for a white one."""
    for roughness in (0.3, 0.9):
        material = scenes.principled(Base_Color=(1.0, 1.0, 1.0), Metallic=metallic, Roughness=roughness)
        b = scenes.SceneBuilder()
        b.quads(np.array([[[-4, -4, 0], [4, -4, 0], [4, 4, 0], [-4, 4, 0]]]), material)
        scene = b.build(scenes.perspective((0, -3, 3), (0, 0, 0), 0.5), scenes.world((1, 1, 1)))
        image = make(scene, samples=32, resolution=(32, 18), world__samples=8).passes["Combined"][..., 0]
        assert 0.9 < image.mean() < 1.03
