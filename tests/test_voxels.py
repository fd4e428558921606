# SPDX-License-Identifier: GPL-3.0-or-later
"""The voxel grid against exact geometry."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import PICTURE
from voxel_store import places, surfaces

from gi_addon.compare import scenes
from gi_addon.engines import TECHNIQUES
from gi_addon.gl import GL, shared
from gi_addon.graph import Pass, Texture
from gi_addon.passes import voxel_sheets
from gi_addon.passes.brdf_tables import BRDFTables
from gi_addon.passes.gbuffer import GBuffer
from gi_addon.passes.resolve import Resolve
from gi_addon.passes.voxels import Voxelisation, sheet_counts
from gi_addon.renderer import Renderer
from gi_addon.settings import Settings


class _Reader(Pass):
    title = "Voxel Reader"
    reads = ("voxels.sheets", "voxels.kinds")
    writes = (Texture("indirect.diffuse", "indirect_diffuse", "nothing, for the test", "rgba32f", lambda f: f.resolution),)

    def run(self, frame, planned):
        pass


class _EmissionReader(_Reader):
    reads = (*_Reader.reads, "voxels.emission")


@pytest.fixture
def voxels(gl, monkeypatch):
    """Voxelise a scene: (grid, {name: (z, y, x, channels)})."""

    def voxelise(scene, resolution=32, emission=False, change=None, **settings):
        reader = _EmissionReader if emission else _Reader
        tasks = [BRDFTables(), GBuffer(), Voxelisation(), reader()]
        monkeypatch.setitem(TECHNIQUES, "VCT", lambda s, layers: [*tasks, Resolve(layers)])
        chosen = Settings()
        chosen.set("vct.resolution", resolution)
        chosen.samples = 1
        chosen.vct.emissive_voxels = emission
        chosen.technique = "VCT"
        for name, value in settings.items():
            chosen.set(name.replace("__", "."), value)

        def job(g: GL):
            renderer = Renderer(g)
            ran = list(renderer.render(scene, chosen, ("Combined",), resolution=PICTURE, timed=True).milliseconds)
            if change is not None:
                change(scene)
                ran = list(renderer.render(scene, chosen, ("Combined",), resolution=PICTURE, timed=True).milliseconds)
            grid, out = surfaces(renderer)
            renderer.close()
            return grid, out, ran

        return shared().call(job)

    return voxelise


def _scene(*meshes, **placed):
    b = scenes.SceneBuilder()
    for mesh, material in meshes:
        b.add(mesh, material, **placed)
    return b.build(scenes.perspective((0, -6, 0), (0, 0, 0), 0.8))


def triangles(corners: np.ndarray) -> scenes.Mesh:
    """Loose triangles (T, 3, 3)."""
    corners = np.asarray(corners, "f4")
    n = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    n /= np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-20)
    index = np.arange(3 * len(corners), dtype="u4").reshape(-1, 3)
    return scenes.Mesh("Triangles", corners.reshape(-1, 3), np.repeat(n, 3, axis=0).astype("f4"), index,
                       np.array([[0, 0, len(corners)]]))  # fmt: skip


def crosshair_cells(corner: np.ndarray) -> set[tuple[int, int, int]]:
    """Cells whose three centre lines meet the triangle (3, 3), in cells: the 6-separating voxelization (S. Laine, "A
    Topological Approach to Voxelization", EGSR 2013). No 6-connected path crosses the triangle between them."""
    found = set()
    normal = np.cross(corner[1] - corner[0], corner[2] - corner[0])
    for axis in range(3):
        if abs(normal[axis]) < 1e-9 * np.linalg.norm(normal):
            continue
        u, v = [k for k in range(3) if k != axis]
        low, high = np.floor(corner.min(axis=0)).astype(int), np.floor(corner.max(axis=0)).astype(int)
        gu, gv = np.meshgrid(np.arange(low[u], high[u] + 1), np.arange(low[v], high[v] + 1), indexing="ij")
        p = np.stack([gu.ravel() + 0.5, gv.ravel() + 0.5], -1)
        flat = corner[:, [u, v]]
        edges = []
        for i in range(3):
            d, e = flat[(i + 1) % 3] - flat[i], p - flat[i]
            edges.append(d[0] * e[:, 1] - d[1] * e[:, 0])
        inside = np.all(np.array(edges) >= 0, axis=0) | np.all(np.array(edges) <= 0, axis=0)
        for a, b in p[inside]:
            w = corner[0, axis] - (normal[u] * (a - corner[0, u]) + normal[v] * (b - corner[0, v])) / normal[axis]
            cell = np.zeros(3, int)
            cell[u], cell[v], cell[axis] = int(a), int(b), int(np.floor(w))
            if abs(w - round(w)) > 1e-3:  # on a border either cell will do
                found.add(tuple(cell))
    return found


def _thin(count: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    a = rng.uniform(-1, 1, (count, 3))
    along, across = rng.normal(size=(2, count, 3))
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    across -= along * (across * along).sum(1, keepdims=True)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    length = rng.uniform(0.05, 1.2, (count, 1))
    width = length * 10.0 ** rng.uniform(-3, 0, (count, 1))
    return np.clip(np.stack([a, a + along * length, a + along * length * 0.5 + across * width], 1), -1, 1)


def test_no_thin_or_turned_triangle_leaves_a_hole(voxels):
    """Every cell of the 6-separating voxelization of 1000 random thin triangles is taken."""
    corners = _thin(1000, 1).astype("f4")
    grid, out, _ = voxels(_scene((triangles(corners), scenes.diffuse((0.5,) * 3))), 48)
    taken = out["opacity"] > 0
    local = (corners.astype("f8") - grid.low) / grid.cell
    needed = {cell for t in local for cell in crosshair_cells(t)}
    assert len(needed) > 5000
    missing = [c for c in needed if not taken[c[2], c[1], c[0]]]
    assert not missing
    # And none far from a triangle: every cell taken touches one's box.
    near = np.zeros_like(taken)
    for t in local:
        low, high = np.floor(t.min(0) - 1e-3).astype(int), np.floor(t.max(0) + 1e-3).astype(int)
        near[low[2] : high[2] + 1, low[1] : high[1] + 1, low[0] : high[0] + 1] = True
    assert not (taken & ~near).any()


def _plane(degrees: float, tilt: float = 0.0) -> tuple[scenes.Mesh, np.ndarray]:
    """A large square through the origin and its normal: along y, tilted about x and turned about z."""
    mesh = scenes.mesh_from_quads(np.array([[[-3, 0, -3], [3, 0, -3], [3, 0, 3], [-3, 0, 3]]]))
    a, b = np.radians([degrees, tilt])
    turn = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    turn = turn @ np.array([[1, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]])
    mesh.positions = (mesh.positions @ turn.T).astype("f4")
    mesh.__post_init__()
    return mesh, turn @ np.array([0.0, 1.0, 0.0])


@pytest.mark.parametrize(("degrees", "tilt"), [(0, 0), (15, 10), (40, 0), (-30, -20)])
def test_a_sheet_lies_on_its_surface(voxels, degrees, tilt):
    """Every sheet of a plane is that plane, to a thousandth of a cell, in every cell it passes through."""
    mesh, n = _plane(degrees, tilt)
    grid, out, _ = voxels(_scene((mesh, scenes.diffuse((0.5,) * 3))), 32)
    z, y, x = np.nonzero(out["opacity"] > 0)
    middle = (np.stack([x, y, z], -1) + 0.5) * grid.cell + grid.low
    sheets = out["sheets"][1][:, z, y, x] / 65535.0
    sheet = np.where(sheets[0, :, 3:] > 0, sheets[0], sheets[1])
    assert (sheet[:, 3] > 0).all()  # all along y
    np.testing.assert_allclose(sheet[:, 0] * 2 - 1, n[2] / n[1], atol=2e-3)
    np.testing.assert_allclose(sheet[:, 1] * 2 - 1, n[0] / n[1], atol=2e-3)
    np.testing.assert_allclose(sheet[:, 2] * 3 - 1.5, -(middle @ n) / n[1] / grid.cell, atol=2e-3)


@pytest.mark.parametrize("degrees", [0, 15, 40])
def test_a_wall_covers_every_column_wholly(voxels, degrees):
    """Looked at along the axis that it faces most, a large wall covers all 16 squares of each column of cells."""
    mesh, _ = _plane(degrees)
    _, out, _ = voxels(_scene((mesh, scenes.diffuse((0.5,) * 3))), 32)
    squares = out["sheets"][1, ..., 3].astype("u4")
    columns = np.bitwise_or.reduce(squares, axis=(0, 2))  # over sides and y
    middle = columns.shape[1] // 2
    assert (columns[4:-4, middle - 6 : middle + 6] == 0xFFFF).all()


def test_squares_are_those_that_a_triangle_covers(voxels):
    """A triangle across a few cells covers the quarter-cell squares that it meets and no others."""
    frame = np.array([[[-1, -1, -1], [-1, -1, -0.999], [-1, -0.999, -1]], [[1, 1, 1], [1, 1, 0.999], [1, 0.999, 1]]])
    corner = np.array([[-0.31, 0.12, 0.03], [0.27, -0.08, 0.03], [0.05, 0.33, 0.03]])
    grid, out, _ = voxels(_scene((triangles(np.concatenate([frame, corner[None]])), scenes.diffuse((0.5,) * 3))), 16)
    layer = int((0.03 - grid.low[2]) / grid.cell)
    squares = out["sheets"][2, :, layer, ..., 3].astype("u4")
    squares = squares[0] | squares[1]
    n = 8  # points a square's side
    at = (np.arange(4 * n * grid.size[0]) + 0.5) / (4 * n)
    gx, gy = np.meshgrid(at * grid.cell + grid.low[0], at * grid.cell + grid.low[1])
    inside = np.ones(gx.shape, bool)
    for i in range(3):
        d, e = corner[(i + 1) % 3] - corner[i], corner[i]
        inside &= d[0] * (gy - e[1]) - d[1] * (gx - e[0]) > 0
    met = inside.reshape(grid.size[0] * 4, n, grid.size[0] * 4, n).any(axis=(1, 3))
    k = np.arange(16)
    taken = (squares[..., None] >> k & 1).reshape(*squares.shape, 4, 4).transpose(0, 2, 1, 3).reshape(met.shape) > 0
    assert met.sum() > 100
    assert not (met & ~taken).any()
    # What is taken beyond that is only grazed: between the points.
    near = np.zeros_like(met)
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            near |= np.roll(met, (dy, dx), (0, 1))
    assert not (taken & ~near).any() and (taken & ~met).sum() <= 0.1 * met.sum()


def test_averages_survive_thousands_of_writes_in_any_order(voxels):
    """3000 small triangles of two colours in one cell give the area-weighted mean, and the same bits in any order."""
    rng = np.random.default_rng(3)
    corners = rng.uniform(0.01, 0.05, (3000, 3, 3))
    frame = np.array([[[-1, -1, -1], [-1, -1, -0.999], [-1, -0.999, -1]], [[1, 1, 1], [1, 1, 0.999], [1, 0.999, 1]]])
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    first, second = scenes.diffuse((0.9, 0.1, 0.3), "a"), scenes.diffuse((0.1, 0.5, 0.3), "b")

    def run(order):
        parts = corners[order]
        scene = _scene((triangles(np.concatenate([parts[:2000], frame])), first), (triangles(parts[2000:]), second))
        return voxels(scene, 16)[:2]

    grid, out = run(np.arange(3000))
    cell = tuple(int((0.03 - grid.low[k]) / grid.cell) for k in (2, 1, 0))
    share = area[:2000].sum() / area.sum()
    np.testing.assert_allclose(
        out["albedo"][cell][:3], share * np.array([0.9, 0.1, 0.3]) + (1 - share) * np.array([0.1, 0.5, 0.3]), atol=1 / 255
    )
    other = np.concatenate([rng.permutation(2000), 2000 + rng.permutation(1000)])
    _, again = run(other)
    for name in out:
        np.testing.assert_array_equal(out[name], again[name])


def test_emission_and_opacity_are_those_of_the_material(voxels):
    """Radiance is kept to 1e-3 of the brightest emitter's, however bright that is; a surface of alpha ¼ blocks a quarter."""
    glow = scenes.emissive((1.0, 0.5, 0.0), 3e5)
    b = scenes.SceneBuilder()
    b.quads(np.array([[[-1, 0, -1], [0, 0, -1], [0, 0, 1], [-1, 0, 1]]]), glow)
    b.quads(np.array([[[0, 0, -1], [1, 0, -1], [1, 0, 1], [0, 0, 1]]]), scenes.principled(Alpha=0.25, Base_Color=(0.5,) * 3))
    grid, out, _ = voxels(b.build(scenes.perspective((0, -6, 0), (0, 0, 0), 0.8)), 16, emission=True)
    taken = out["opacity"] > 0
    left = np.broadcast_to(np.arange(grid.size[0]) < 7, taken.shape) & taken
    right = np.broadcast_to(np.arange(grid.size[0]) > 8, taken.shape) & taken
    np.testing.assert_allclose(out["emission"][left][:, :3], np.tile([1.0, 0.5, 0.0], (left.sum(), 1)), rtol=1e-3)
    np.testing.assert_allclose(out["opacity"][right], 0.25, atol=1 / 255)


def test_only_a_change_of_the_scene_voxelises_again(voxels):
    """A moved camera or light does not; a moved mesh does; and continuous voxelization always does."""
    def cornell():
        return scenes.cornell()

    def camera(scene):
        scene.camera = scenes.perspective((0.1, -4.2, 1.0), (0, 0, 1.0), 0.85)

    def light(scene):
        scene.lights[0].matrix = scenes.look_at((0.2, 0, 1.98), (0.2, 0, 0))

    def mesh(scene):
        scene.instances.matrix[-1, 0, 3] += 0.1

    assert "Voxelization" not in voxels(cornell(), 16, change=camera)[2]
    assert "Voxelization" not in voxels(cornell(), 16, change=light)[2]
    assert "Voxelization" in voxels(cornell(), 16, change=mesh)[2]
    assert "Voxelization" in voxels(cornell(), 16, change=camera, vct__continuous_voxelization=True)[2]


def test_a_moved_object_leaves_nothing_behind(voxels):
    """Voxels after a move are those of the moved scene alone."""
    def move(scene):
        scene.instances.matrix[-1, 0, 3] -= 0.2

    moved = scenes.cornell()
    move(moved)
    _, after, _ = voxels(scenes.cornell(), 24, change=move)
    _, fresh, _ = voxels(moved, 24)
    for name in fresh:
        np.testing.assert_array_equal(after[name], fresh[name])


def test_sheets_made_in_parts_are_the_same(voxels, monkeypatch):
    """Sheets are made some at a time where their sums would be large; the result does not show it."""
    import gi_addon.passes.voxels as module

    _, whole, _ = voxels(scenes.cornell(), 24)
    monkeypatch.setattr(module, "_SUMS_BYTES", 701 * 4 * 16)
    _, parts, _ = voxels(scenes.cornell(), 24)
    for name in whole:
        np.testing.assert_array_equal(whole[name], parts[name])


@pytest.mark.parametrize("resolution", [16, 61, 128])
@pytest.mark.parametrize(
    "limits", [{}, {"_BATCH": 50, "_MANY": 0, "_LOOSE": 0}, {"_MANY": 0, "_LOOSE": 1 << 30}], ids=["whole", "batches", "boxes"]
)
def test_memory_is_planned_for_as_many_sheets_as_there_are(gl, resolution, limits, monkeypatch):
    """The bound from triangles is never less than the sheets found, at any level, nor much more: small and thin ones, walls along
    and across the grid, on the borders of its cells, scaled and mirrored. In batches it is the same, of very many it goes by
    boxes."""
    for name, value in limits.items():
        monkeypatch.setattr(voxel_sheets, name, value)
    b = scenes.SceneBuilder()
    white = scenes.diffuse((0.5,) * 3)
    b.add(triangles(_thin(300, 5)), white)
    for degrees, tilt in ((0, 0), (0, 30), (45, 0), (33, 20)):
        b.add(_plane(degrees, tilt)[0], white, np.diag([-0.2, 0.3, 0.25, 1.0]))
    b.quads(scenes.box_quads((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5)), white)
    s = Settings()
    s.technique, s.samples = "VCT", 1
    s.set("vct.resolution", resolution)
    b.light(scenes.point_light((0, 0, 2), 10.0))
    scene = b.build(scenes.perspective((0, -6, 0), (0, 0, 0), 0.8))

    def job(g: GL):
        renderer = Renderer(g)
        renderer.render(scene, s, ("Diffuse Indirect",), resolution=(8, 8))
        grid = places(renderer)[0]
        found = [len(places(renderer, level)[1]) for level in range(grid.levels + 1)]
        planned = sheet_counts(renderer.frame.facts)
        renderer.close()
        return found, planned

    found, planned = shared().call(job)
    assert all(n <= most for n, most in zip(found, planned, strict=True))
    assert limits.get("_LOOSE") or sum(planned) <= 3 * sum(found)


def test_a_grid_that_does_not_fit_says_so_before_it_is_made(gl):
    """The plan states the bytes; allocation beyond the budget is refused with what to do."""
    from gi_addon.gl.errors import GLOutOfMemory

    def job(g: GL):
        budget, g.budget = g.budget, g.bytes() + (1 << 20)
        renderer = Renderer(g)
        try:
            s = Settings()
            s.samples = 1
            s.technique = "VCT"
            s.set("vct.resolution", 256)
            renderer.render(scenes.cornell(), s, ("Combined",), resolution=PICTURE)
        finally:
            g.budget = budget
            renderer.close()

    with pytest.raises(GLOutOfMemory, match="MiB"):
        shared().call(job)
