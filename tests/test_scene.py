# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes as data and their snapshots."""

from __future__ import annotations

import io
import zipfile

import numpy as np
import pytest
from conftest import make

from gi_addon.compare import scenes
from gi_addon.scene import Image, Link, Material, Mesh, Node, Scene, ShaderGraph, SnapshotError


def textured_scene() -> Scene:
    rng = np.random.default_rng(5)
    image = Image("noise", rng.integers(0, 255, (8, 8, 4), dtype=np.uint8), "srgb")
    graph = ShaderGraph(
        (Node("TEX_IMAGE", "image", {}, {"image": 0, "interpolation": "Closest"}),
         Node("BSDF_PRINCIPLED", "p", {"Base Color": Link(0, "Color"), "Roughness": 0.4})), Link(1, "BSDF"),
    )  # fmt: skip
    b = scenes.SceneBuilder("textured")
    b.quads(np.array([[[-2, -2, 0], [2, -2, 0], [2, 2, 0], [-2, 2, 0]]]), Material("m", graph))
    b.quads(scenes.box_quads((-0.4, -0.4, 0), (0.4, 0.4, 0.8)), scenes.diffuse(scenes.RED))
    b.light(scenes.point_light((1, -1, 2), 80.0, 0.1))
    b.scene.images = [image]
    return b.build(scenes.perspective((0, -4, 2), (0, 0, 0.3), 0.7), scenes.world((0.1, 0.1, 0.2)))


def test_a_snapshot_renders_identically(gl, tmp_path):
    scene = textured_scene()
    scene.save(tmp_path / "s.npz")
    again = Scene.load(tmp_path / "s.npz")
    a, b = (make(s, "Combined", "Glossy Direct", samples=2).passes for s in (scene, again))
    for name in a:
        assert np.array_equal(a[name], b[name]), name
    assert a["Combined"].max() > 0.1


def test_a_snapshot_keeps_its_content_and_holds_no_pickle(tmp_path):
    scene = textured_scene()
    scene.save(tmp_path / "s.npz")
    again = Scene.load(tmp_path / "s.npz")
    assert again.digest() == scene.digest()
    assert again.materials[0].graph == scene.materials[0].graph
    with np.load(tmp_path / "s.npz", allow_pickle=False) as data:
        assert all(data[k].dtype != object for k in data.files)
    scene.lights[0].radius = 0.2
    assert scene.digest() != again.digest()


@pytest.mark.parametrize("damage", ["empty", "text", "truncated", "flipped", "foreign", "version", "index", "missing"])
def test_a_damaged_snapshot_is_refused_with_a_reason(tmp_path, damage):
    path = tmp_path / "s.npz"
    textured_scene().save(path)
    raw = path.read_bytes()
    if damage == "empty":
        path.write_bytes(b"")
    elif damage == "text":
        path.write_text("not a snapshot")
    elif damage == "truncated":
        path.write_bytes(raw[: len(raw) // 2])
    elif damage == "flipped":
        broken = bytearray(raw)
        for i in range(200, len(raw) - 400, 97):
            broken[i] ^= 0xFF
        path.write_bytes(bytes(broken))
    elif damage == "foreign":
        np.savez(path, something=np.zeros(3))
    elif damage == "missing":
        path.unlink()
    else:
        with np.load(path) as data:
            arrays = {k: data[k] for k in data.files}
        text = bytes(arrays["document"]).decode()
        if damage == "version":
            text = text.replace('"version": 1', '"version": 99')
        else:
            triangles = next(k for k, v in arrays.items() if v.dtype == np.uint32 and v.ndim == 2)
            arrays[triangles] = arrays[triangles] + 10_000
        arrays["document"] = np.frombuffer(text.encode(), np.uint8)
        np.savez(path, **arrays)
    with pytest.raises(SnapshotError) as caught:
        Scene.load(path)
    assert len(str(caught.value)) > 15


def test_a_snapshot_that_smuggles_a_pickle_is_refused(tmp_path):
    stream = io.BytesIO()
    np.save(stream, np.array([{"a": 1}], dtype=object), allow_pickle=True)
    path = tmp_path / "p.npz"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("document.npy", stream.getvalue())
    with pytest.raises(SnapshotError):
        Scene.load(path)


def test_saving_leaves_no_half_file(tmp_path, monkeypatch):
    """A failing write must not replace a good snapshot."""
    path = tmp_path / "s.npz"
    textured_scene().save(path)
    before = path.read_bytes()
    monkeypatch.setattr(np, "savez_compressed", lambda *a, **k: (_ for _ in ()).throw(OSError("disk full")))
    with pytest.raises(OSError, match="disk full"):
        textured_scene().save(path)
    assert path.read_bytes() == before


def test_a_vertex_that_is_not_a_number_takes_its_triangles_only():
    mesh = scenes.mesh_from_quads(scenes.box_quads((0, 0, 0), (1, 1, 1)))
    positions = mesh.positions.copy()
    positions[0] = np.inf
    broken = Mesh("b", positions, mesh.normals, mesh.triangles, mesh.slots)
    assert np.isfinite(broken.positions).all() and np.isfinite(broken.bounds).all()
    assert (broken.bounds[1] - broken.bounds[0] <= 1.0).all()


def test_stamps_change_with_what_they_stand_for_and_nothing_else():
    scene = scenes.cornell()
    before = scene.stamps()
    scene.instances.matrix = scene.instances.matrix + 0.0
    assert scene.stamps() == before
    scene.instances.matrix[0, 0, 3] += 0.1
    after = scene.stamps()
    assert {k for k in before if before[k] != after[k]} == {"transforms"}
    scene.lights[0].emission = scene.lights[0].emission * 2
    assert {k for k in after if after[k] != scene.stamps()[k]} == {"lights"}
