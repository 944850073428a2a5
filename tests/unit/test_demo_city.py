"""The demo city as a whole: its content, its numbers of triangles, its file."""

import json
import os
from importlib.resources import files

import numpy as np
import pytest
import trimesh
from farfield_core.errors import BadInputError
from farfield_worker.demo import city, parts
from farfield_worker.demo.layout import HALF, Ground, plan
from farfield_worker.demo.looks import Material
from farfield_worker.demo.surfaces import Kind

#: 10 million where time is no matter; the numbers alone are checked up to 10 million always
LARGEST = 10_000_000 if os.environ.get("FARFIELD_SOAK") == "1" else 1_500_000


@pytest.fixture(scope="module")
def whole():
    return parts.build()


# The content is part of what published figures mean: it must not change unnoticed.
@pytest.mark.parametrize(
    ("triangles", "digest"),
    [
        (50_000, "4a58600550b04b6b4df1569bff850f72"),
        (850_000, "2a1b0b3545c60a615c3ccd90bc28b2e9"),
    ],
)
def test_the_content_is_frozen(tmp_path, triangles, digest):
    facts = city.write_city(tmp_path / "city.glb", triangles)
    assert facts.digest == digest


@pytest.mark.parametrize(
    "triangles", [50_000, 80_000, 150_000, 333_333, 850_000, 2_500_000, 10_000_000]
)
def test_the_wanted_number_of_triangles_with_equal_shares(whole, triangles):
    _, nu, nv, counts = parts.select(whole, triangles)
    assert int(2 * (nu * nv).sum()) == sum(counts.values())
    assert sum(counts.values()) == pytest.approx(triangles, rel=0.02)
    for name, share in parts.SHARES.items():
        assert counts[name] / triangles == pytest.approx(share, abs=0.02), name


@pytest.mark.parametrize("triangles", [50_000, LARGEST])
def test_triangles_are_sound(triangles):
    total = 0
    for p in city.city_primitives(triangles):
        total += len(p.triangles)
        assert int(p.triangles.max()) == len(p.positions) - 1
        for array in (p.positions, p.normals, p.uvs):
            assert array.dtype == np.float32
            assert np.isfinite(array).all()
        assert np.allclose((p.normals.astype(np.float64) ** 2).sum(axis=1), 1, atol=1e-5)
        corners = p.positions.astype(np.float64)[p.triangles]
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert np.linalg.norm(across, axis=1).min() > 1e-7
        mean = p.normals[p.triangles].astype(np.float64).sum(axis=1)
        assert (across * mean).sum(axis=1).min() > 0
    assert total == pytest.approx(triangles, rel=0.02)


def test_the_file_is_read_by_others(tmp_path):
    path = tmp_path / "city.glb"
    facts = city.write_city(path, 200_000)
    assert [p.name for p in tmp_path.iterdir()] == ["city.glb"]
    scene = trimesh.load_scene(path)
    meshes = list(scene.geometry.values())
    assert sum(len(m.faces) for m in meshes) == facts.triangles
    assert sum(len(m.vertices) for m in meshes) == facts.vertices
    assert np.array_equal(scene.bounds, facts.bounds)
    materials = {m.visual.material.name: m.visual.material for m in meshes}
    assert set(materials) == {m.name.lower() for m in Material}
    assert materials["foliage"].alphaMode == "MASK"
    assert materials["foliage"].doubleSided
    assert not materials["plaster"].doubleSided
    assert materials["dark"].baseColorTexture is None
    sizes = {m.baseColorTexture.size for m in materials.values() if m.baseColorTexture}
    assert sizes == {(512, 512)}
    assert all(m.visual.uv.shape == (len(m.vertices), 2) for m in meshes)
    assert sum(facts.parts.values()) == facts.triangles


def test_extents_and_scale(whole):
    corners = [p.positions for p in city.city_primitives(50_000)]
    low = np.min([c.min(axis=0) for c in corners], axis=0)
    high = np.max([c.max(axis=0) for c in corners], axis=0)
    assert np.allclose(low[[0, 2]], -675)
    assert np.allclose(high[[0, 2]], 675)
    assert -2 < low[1] < 0
    assert 120 < high[1] < 250
    temples = whole.tables["temples"].shape[:, :, 1][whole.tables["temples"].kind == Kind.FLAT]
    assert 44 < temples.max() < 50  # the great temple


@pytest.mark.parametrize("triangles", [49_999, 10_000_001])
def test_numbers_out_of_range_are_refused(tmp_path, triangles):
    with pytest.raises(BadInputError, match="between 50,000 and 10,000,000"):
        city.write_city(tmp_path / "city.glb", triangles)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("triangles", [50_000, 850_000])
def test_no_two_faces_fight_for_the_same_pixels(whole, triangles):
    """No two axis-aligned faces that look the same way overlap within 5 mm of one plane."""
    table, *_ = parts.select(whole, triangles)
    worst = 0.0
    for axis in range(3):
        rest = [k for k in range(3) if k != axis]
        depth = table.shape[:, :, axis]
        rows = np.flatnonzero((table.kind == Kind.FLAT) & (np.ptp(depth, axis=1) < 1e-9))
        shape = table.shape[rows]
        across = np.cross(shape[:, 1] - shape[:, 0], shape[:, 3] - shape[:, 0])[:, axis]
        plane = np.rint(shape[:, 0, axis] * 200).astype(np.int64) * 2 + (across > 0)
        low = shape[:, :, rest].min(axis=1) + 0.03
        high = shape[:, :, rest].max(axis=1) - 0.03
        keep = (high > low).all(axis=1)
        order = np.flatnonzero(keep)[np.lexsort((low[keep, 0], plane[keep]))]
        plane, low, high = plane[order], low[order], high[order]
        for k in range(len(plane) - 1):
            end = np.searchsorted(plane, plane[k], side="right")
            others = slice(k + 1, k + 1 + int(np.searchsorted(low[k + 1 : end, 0], high[k, 0])))
            size = np.minimum(high[k], high[others]) - np.maximum(low[k], low[others])
            if len(size):
                worst = max(worst, float((size.clip(0).prod(axis=1)).max()))
    assert worst < 0.15


def test_corridors_lie_on_streets():
    classes = plan().classes
    avenue = json.loads(files("farfield_worker.demo").joinpath("corridors/avenue.json").read_text())
    (x0, y0, z0), (x1, y1, z1) = avenue["path"]["points"]
    assert (z0 - z1) / 14 == 11
    assert x0 == x1
    assert y0 == y1
    half = avenue["path"]["width"] / 2
    area = classes[int(z1) + HALF : int(z0) + HALF, int(x0 - half) + HALF : int(x0 + half) + HALF]
    assert np.isin(area, (Ground.AVENUE, Ground.LANE, Ground.CANAL)).all()
    assert (area != Ground.CANAL).mean() > 0.85
    street = json.loads(files("farfield_worker.demo").joinpath("corridors/street.json").read_text())
    low, high = np.array(street["box"]["min"]), np.array(street["box"]["max"])
    assert np.allclose((high - low) / 14, [1, 1, 6])
    middle = int((low[0] + high[0]) / 2) + HALF
    line = classes[int(low[2]) + HALF : int(high[2]) + HALF, middle]
    assert np.isin(line, (Ground.STREET, Ground.CANAL, Ground.MARKET)).all()
    assert (line == Ground.STREET).mean() > 0.85
