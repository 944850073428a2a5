"""How triangles are divided into blocks, sorted and welded."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from farfield_core.scene import PreparedScene
from farfield_worker.prepare import arrays
from farfield_worker.prepare.batches import decide_opacity
from farfield_worker.prepare.images import shrink
from farfield_worker.prepare.split import BLOCK_TRIANGLES, split
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.unit.prepare.build import Gltf, canonical, facing, prepared, soup


def slow_split(points: np.ndarray, members: list[int], largest: int) -> list[set[int]]:
    """The k-d tree by sorting whole lists."""
    if len(members) <= largest:
        return [set(members)]
    side = points[members].max(axis=0) - points[members].min(axis=0)
    axis = int(np.argmax(side))
    blocks = -(-len(members) // largest)
    cut = len(members) * (blocks // 2) // blocks
    ranked = sorted(members, key=lambda n: points[n, axis])
    return slow_split(points, ranked[:cut], largest) + slow_split(points, ranked[cut:], largest)


@settings(max_examples=50)
@given(st.integers(1, 300), st.integers(1, 40), st.integers(0, 2**32 - 1))
def test_split_like_the_slow_one(count, largest, seed):
    points = np.random.default_rng(seed).random((count, 3)).astype(np.float32)
    moved = points.copy()
    order, starts = split(moved, largest)
    assert (moved == points[order]).all()
    sizes = np.diff(starts)
    assert (sizes > 0).all()
    assert (sizes <= largest).all()
    assert len(sizes) == -(-count // largest)
    ours = [set(order[a:b].tolist()) for a, b in pairwise(starts.tolist())]
    assert ours == slow_split(points, list(range(count)), largest)


def test_split_of_equal_points():
    order, starts = split(np.zeros((1000, 3), np.float32), 64)
    assert sorted(order.tolist()) == list(range(1000))
    assert np.diff(starts).max() <= 64


@pytest.fixture(scope="module")
def terrain(tmp_path_factory) -> PreparedScene:
    """A hilly grid of several blocks and two batches, standing twice, once mirrored."""
    n = 60
    x, z = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0))
    y = 2 * np.sin(x / 5) * np.cos(z / 7)
    positions = np.column_stack([x.ravel(), y.ravel(), z.ravel()]).astype("f4")
    a = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    quads = np.column_stack([a, a + n + 1, a + n + 2, a, a + n + 2, a + 1]).astype("u4")
    gltf = Gltf()
    shared = gltf.accessor(positions)
    normals = gltf.accessor(np.tile(np.array([0, 1, 0], "f4"), (len(positions), 1)))
    gltf.add("materials", {})
    gltf.add("materials", {"doubleSided": True})
    half = len(quads) // 2
    primitives = [
        {
            "attributes": {"POSITION": shared, "NORMAL": normals},
            "indices": gltf.accessor(part.reshape(-1)),
            "material": number,
        }
        for number, part in enumerate((quads[:half], quads[half:]))
    ]
    mesh = gltf.mesh(*primitives)
    gltf.node(mesh=mesh)
    gltf.node(mesh=mesh, scale=[-1, 1, 2], translation=[0, 10, 0])
    return prepared(gltf, tmp_path_factory.mktemp("terrain"))


def test_blocks_cover_everything_once(terrain):
    info = terrain.info
    triangle = vertex = 0
    for block in info.blocks:
        assert block.first_vertex == vertex
        assert 0 < block.triangles <= BLOCK_TRIANGLES
        for part in block.parts:
            assert part.first_triangle == triangle
            assert part.triangles > 0
            triangle += part.triangles
        assert [part.batch for part in block.parts] == sorted({p.batch for p in block.parts})
        vertex += block.vertices
    assert triangle == info.triangles == len(terrain.triangles) == 14400
    assert vertex == info.vertices == len(terrain.positions)


def test_blocks_own_their_vertices_and_know_their_bounds(terrain):
    for block in terrain.info.blocks:
        rows = slice(block.first_triangle, block.first_triangle + block.triangles)
        used = np.unique(terrain.triangles[rows])
        last = block.first_vertex + block.vertices
        assert used.tolist() == list(range(block.first_vertex, last))
        own = slice(block.first_vertex, last)
        assert np.array_equal(terrain.positions[own].min(axis=0), np.float32(block.low))
        assert np.array_equal(terrain.positions[own].max(axis=0), np.float32(block.high))


def test_no_vertex_twice_in_a_block(terrain):
    for block in terrain.info.blocks:
        own = slice(block.first_vertex, block.first_vertex + block.vertices)
        columns = (terrain.positions, terrain.normals, terrain.uvs, terrain.colors)
        rows = np.hstack([np.asarray(column[own], np.float64) for column in columns])
        assert len(np.unique(rows, axis=0)) == block.vertices


def test_every_triangle_is_there(terrain):
    n = 60
    expected = []
    for i in range(n):
        for j in range(n):
            p = [
                (x, 2 * np.sin(x / 5) * np.cos(z / 7), z)
                for x, z in ((j, i), (j, i + 1), (j + 1, i + 1), (j + 1, i))
            ]
            expected += [[p[0], p[1], p[2]], [p[0], p[2], p[3]]]
    plain = np.array(expected)
    mirrored = plain[:, ::-1] * (-1, 1, 2) + (0, 10, 0)
    assert canonical(soup(terrain).positions, 2) == canonical(
        np.concatenate([plain, mirrored]).astype(np.float32).astype(np.float64), 2
    )


def test_winding_agrees_with_normals(terrain):
    s = soup(terrain)
    assert ((facing(s.positions)[:, None] * s.normals).sum(axis=-1).sum(axis=1) > 0).all()


def test_neighbours_in_order_are_neighbours_in_space(terrain):
    centres = soup(terrain).positions.mean(axis=1)
    part = terrain.info.blocks[0].parts[0]
    run = centres[part.first_triangle : part.first_triangle + part.triangles]
    steps = np.linalg.norm(np.diff(run, axis=0), axis=1).mean()
    shuffled = np.random.default_rng(1).permutation(run)
    assert steps < 0.2 * np.linalg.norm(np.diff(shuffled, axis=0), axis=1).mean()


def test_preparing_twice_gives_the_same_bytes(terrain, tmp_path):
    again = prepared(terrain.folder.parent / "model.glb", tmp_path)
    for name in ("positions.npy", "normals.npy", "colors.npy", "triangles.npy", "scene.json"):
        assert (again.folder / name).read_bytes() == (terrain.folder / name).read_bytes()


@given(
    st.sampled_from(["opaque", "mask", "blend"]),
    st.floats(0.01, 1),
    st.floats(0, 1),
    st.floats(0, 1),
)
def test_opacity_rule(mode, cutoff, one, other):
    low, high = min(one, other), max(one, other)
    alpha, limit = decide_opacity(mode, cutoff, low, high)
    if alpha is None:
        assert high < cutoff if mode == "mask" else high == 0
    elif alpha == "opaque":
        assert mode == "opaque" or low >= (cutoff if mode == "mask" else 0.99)
    elif alpha == "mask":
        assert low < limit <= high
        assert limit == (cutoff if mode == "mask" else high / 2)
    else:
        assert mode == "blend"
        assert low >= high / 2


def test_shrink():
    pixels = np.full((10, 400, 4), 77, np.uint8)
    pixels[:, 200:, 3] = 0
    assert shrink(pixels, 400) is pixels
    small = shrink(pixels, 100).astype(int)
    assert small.shape == (2, 100, 4)
    # Pillow weighs by opacity in eight bits
    assert np.abs(small[..., :3] - 77).max() <= 2
    assert (small[:, :50, 3] == 77).all()
    assert (small[:, 50:, 3] == 0).all()
    assert shrink(pixels[..., :3].copy(), 100).shape == (2, 100, 3)


def test_growing_array(tmp_path):
    file = arrays.GrowingArray(tmp_path / "a.npy", np.uint16, 3)
    rows = np.arange(300_003, dtype=np.uint16).reshape(-1, 3)
    for start in range(0, len(rows), 9999):
        file.append(rows[start : start + 9999])
    file.close()
    assert np.array_equal(np.load(tmp_path / "a.npy", mmap_mode="r"), rows)
