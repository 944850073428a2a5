"""The pieces that the demo city is made with, each against a slow and obvious twin."""

import io

import numpy as np
import pytest
import trimesh
from farfield_worker.demo import ground
from farfield_worker.demo.foliage import picture_uv
from farfield_worker.demo.glb import GlbWriter, Primitive
from farfield_worker.demo.hashing import Dice, uniform
from farfield_worker.demo.lighting import CELL, HeightMap
from farfield_worker.demo.looks import LIME, Material
from farfield_worker.demo.sketch import CLOSED, EAST, NORTH, SOUTH, Place, Sketch, turned_faces
from farfield_worker.demo.tessellate import PROFILES, divisions, tessellate, triangle_count
from farfield_worker.demo.textures import textures
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from PIL import Image

MASK = (1 << 64) - 1


def slow_uniform(seed, *keys):
    def mix(x):
        x = ((x ^ (x >> 30)) * 0xBF58476D1CE4E5B9) & MASK
        x = ((x ^ (x >> 27)) * 0x94D049BB133111EB) & MASK
        return x ^ (x >> 31)

    state = seed & MASK
    for key in keys:
        state = mix((state + ((key + 1) & MASK) * 0x9E3779B97F4A7C15) & MASK)
    return (mix(state) >> 11) / 2**53


@given(st.integers(0, 2**63), st.lists(st.integers(-(2**31), 2**31), min_size=1, max_size=3))
def test_hash_equals_plain_integers(seed, keys):
    assert uniform(seed, *keys) == slow_uniform(seed, *keys)


def test_hash_is_even():
    values = uniform(5, np.arange(200)[:, None], np.arange(200)[None])
    assert values.shape == (200, 200)
    counts = np.histogram(values, bins=20, range=(0, 1))[0]
    assert counts.sum() == 40_000
    assert abs(counts - 2000).max() < 250
    assert len(np.unique(values)) == 40_000


def test_dice():
    dice = Dice(3, 4)
    throws = [dice.whole(1, 6) for _ in range(6000)]
    assert sorted(set(throws)) == [1, 2, 3, 4, 5, 6]
    assert all(850 < throws.count(k) < 1150 for k in range(1, 7))
    assert Dice(3, 4).between(0, 1) == Dice(3, 4).between(0, 1)
    assert Dice(3, 4).between(0, 1) != Dice(4, 3).between(0, 1)


def box_table(**more):
    sketch = Sketch(1)
    sketch.box((0, 0, 0), (4, 2, 6), LIME._replace(grain=0.5), faces=CLOSED, **more)
    return sketch.surfaces()


@pytest.mark.parametrize("level", [0.1, 1.0, 3.3])
@pytest.mark.parametrize("taper", [0.0, 0.6])
def test_a_box_is_closed_and_looks_outward(level, taper):
    table = box_table(taper=taper)
    nu, nv = divisions(table, level)
    mesh = tessellate(table, nu, nv)
    assert len(mesh.triangles) == triangle_count(table, level)
    solid = trimesh.Trimesh(mesh.positions, mesh.triangles)
    assert solid.is_watertight
    expected = 2 * (4 * 6 + (4 - 2 * taper) * (6 - 2 * taper) + 4 * (4 - taper) * (6 - taper)) / 6
    assert solid.volume == pytest.approx(expected, abs=0.05)


def test_an_uneven_box_stays_closed():
    sketch = Sketch(1)
    sketch.box((0, 0, 0), (9, 5, 7), LIME._replace(grain=0.8, rough=0.05), faces=CLOSED)
    table = sketch.surfaces()
    mesh = tessellate(table, *divisions(table, 2.0))
    assert trimesh.Trimesh(mesh.positions, mesh.triangles).is_watertight
    assert np.ptp(mesh.positions[:, 1]) != 5.0


@given(st.integers(1, 5), st.integers(1, 5))
@settings(max_examples=15, deadline=None)
def test_a_grid_equals_plain_loops(nu, nv):
    corners = np.array([(0, 0, 0), (5, 0, 1), (6, 3, 0), (0, 4, -1)], float)
    sketch = Sketch(1)
    sketch.quad([tuple(c) for c in corners], LIME)
    mesh = tessellate(sketch.surfaces(), np.array([nu]), np.array([nv]))
    expected = []
    for j in range(nv + 1):
        for i in range(nu + 1):
            u, v = i / nu, j / nv
            low = (1 - u) * corners[0] + u * corners[1]
            expected.append((1 - v) * low + v * ((1 - u) * corners[3] + u * corners[2]))
    assert np.abs(mesh.positions - expected).max() <= 0.5 / 1024 + 1e-12
    assert np.array_equal(mesh.positions * 1024, np.rint(mesh.positions * 1024))
    assert len(mesh.triangles) == 2 * nu * nv
    assert sorted(np.unique(mesh.triangles)) == list(range((nu + 1) * (nv + 1)))


@pytest.mark.parametrize("profile", range(len(PROFILES)))
def test_what_is_round_closes_at_its_seam(profile):
    sketch = Sketch(1)
    sketch.lathe((3, 1, 2), 1.5, 2.0, profile, LIME, sides=9, rings=4)
    table = sketch.surfaces()
    nu, nv = divisions(table, 1.0)
    mesh = tessellate(table, nu, nv)
    grid = mesh.positions.reshape(int(nv[0]) + 1, int(nu[0]) + 1, 3)
    assert np.array_equal(grid[:, 0], grid[:, -1])
    distance = np.hypot(grid[..., 0] - 3, grid[..., 2] - 2)
    assert np.ptp(distance, axis=1).max() < 2 / 1024
    assert distance.max() <= 1.5 + 1 / 1024


@pytest.mark.parametrize("quarter", range(4))
def test_quarter_turns_agree(quarter):
    """A box placed by quarter turns has its faces where the turned corner points are."""
    sketch = Sketch(1)
    at = Place(10, 1, 20, quarter)
    sketch.box((-1, 0, 2), (1, 3, 5), LIME, at=at, faces=SOUTH)
    front = sketch.surfaces().shape[0]
    expected = np.array([at.point(x, y, 5) for x, y in ((-1, 0), (1, 0), (1, 3), (-1, 3))])
    assert np.allclose(front, expected)
    assert turned_faces(SOUTH, 1) == EAST
    assert turned_faces(EAST, 1) == NORTH
    assert turned_faces(CLOSED, quarter) == CLOSED


def test_levels_choose_what_exists():
    table = box_table(levels=(0.5, 1.5))
    assert triangle_count(table, 0.49) == 0
    assert triangle_count(table, 0.5) > 0
    assert triangle_count(table, 1.5) == 0


@given(
    hnp.arrays(np.uint8, st.integers(4, 40).map(lambda n: (n, n)), elements=st.integers(0, 2)),
    st.integers(3, 50),
)
@settings(max_examples=40, deadline=None)
def test_rectangles_cover_the_map_once(classes, tile):
    seen = np.full(classes.shape, -1)
    for x0, z0, x1, z1, kind in ground.rectangles(classes, tile):
        assert (seen[z0:z1, x0:x1] == -1).all()
        seen[z0:z1, x0:x1] = kind
    assert np.array_equal(seen, classes)


def test_blurred_heights_are_means_and_walls_cast_shadows():
    size = int(1350 / CELL)
    light = HeightMap(np.zeros((size, size), np.float32), np.array([[0.0, -20, 10, 20, 12]]))
    metres = light.heights[::2, ::2].astype(np.float64)
    for j, i in ((675, 675), (660, 676), (690, 690)):
        assert light.near[j, i] == pytest.approx(metres[j - 2 : j + 3, i - 2 : i + 3].mean())
        assert light.wide[j, i] == pytest.approx(metres[j - 6 : j + 7, i - 6 : i + 7].mean())
    up = np.tile([0.0, 1.0, 0.0], (3, 1))
    # west of the wall (the sun stands in the south-east), far away, on its roof
    behind, open_ground, roof = light.factors(
        np.array([[-3.0, 0, 0], [-300, 0, 200], [5, 12, 0]]), up
    )
    assert behind.max() < 0.6
    assert open_ground.min() > 0.99
    assert roof.min() > 0.9


def test_textures():
    images = textures()
    assert set(images) == set(Material) - {Material.DARK}
    for material, image in images.items():
        assert image.shape == (512, 512, 4)
        assert image.dtype == np.uint8
        opaque = (image[..., 3] == 255).all()
        assert opaque == (material != Material.FOLIAGE)
        assert image[..., :3].std() > 2
    for picture in range(8):
        left, right, bottom, top = picture_uv(picture)
        rows, columns = (
            slice(int(top * 512), int(bottom * 512)),
            slice(int(left * 512), int(right * 512)),
        )
        cover = (images[Material.FOLIAGE][rows, columns, 3] > 127).mean()
        assert 0.12 < cover < 0.8
    # tiles repeat without a seam: the step across the border is like any other
    for material in (Material.PLASTER, Material.WATER, Material.GRASS, Material.STUCCO):
        image = images[material][..., :3].astype(float)
        steps = np.abs(np.diff(image, axis=1)).mean()
        assert np.abs(image[:, 0] - image[:, -1]).mean() < 1.5 * steps + 1


def test_glb_comes_back_as_written(tmp_path):
    buffer = io.BytesIO()
    Image.new("RGB", (4, 4), (200, 100, 50)).save(buffer, "PNG")
    writer = GlbWriter("test")
    writer.material("painted", buffer.getvalue(), mask=True, double_sided=True)
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0], [5, 5, 5]], np.float32)
    writer.mesh(
        "a mesh",
        [
            Primitive(
                0,
                positions,
                np.tile(np.float32([0, 0, 1]), (4, 1)),
                np.float32([[0, 0], [1, 0], [0, 1], [2, 2]]),
                np.array(
                    [[255, 0, 0, 255], [0, 128, 0, 255], [1, 2, 3, 255], [4, 5, 6, 255]], "u1"
                ),
                np.array([[0, 1, 2], [1, 3, 2]], np.uint32),
            )
        ],
    )
    writer.write(tmp_path / "x.glb")
    scene = trimesh.load_scene(tmp_path / "x.glb")
    (mesh,) = scene.geometry.values()
    assert np.array_equal(mesh.vertices, positions)
    assert np.array_equal(mesh.faces, [[0, 1, 2], [1, 3, 2]])
    assert mesh.visual.material.alphaMode == "MASK"
    assert mesh.visual.material.baseColorTexture.getpixel((1, 1)) == (200, 100, 50)
    assert np.allclose(mesh.visual.uv, [[0, 1], [1, 1], [0, 0], [2, -1]])
    with pytest.raises(FileNotFoundError):
        writer.write(tmp_path / "missing" / "x.glb")
    assert [p.name for p in tmp_path.iterdir()] == ["x.glb"]


def test_neighbouring_patches_of_land_share_their_edges():
    table = ground.land()
    for level in (0.4, 1.7):
        nu, nv = divisions(table, level)
        mesh = tessellate(table, nu, nv)
        for axis, other in ((0, 2), (2, 0)):
            border = -675.0 + 45.0 * 3
            on = np.abs(mesh.positions[:, axis] - border) < 1e-9
            sides = []
            for sign in (-1, 1):
                middle = table.shape[:, :, axis].mean(axis=1)[mesh.row]
                chosen = mesh.positions[on & (sign * (middle - border) > 0)]
                sides.append({tuple(p) for p in chosen[:, [other, 1]].tolist()})
            assert sides[0]
            common = sides[0] & sides[1]
            assert len(common) > 0.6 * max(map(len, sides))  # at the shore one side may end
