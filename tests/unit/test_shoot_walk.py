"""Pictures of hand-made walks against rays cast at their quads and polygons on the CPU."""

import farfield_shading as shading
import numpy as np
import pytest
from farfield_core.errors import BadInputError, NotFoundError
from farfield_core.faces import FACES
from farfield_core.walk import CellTable, WalkGrid
from farfield_worker.shoot.command import shoot_to_file
from farfield_worker.shoot.view import View
from farfield_worker.shoot.walk import WalkShooter, find_walk
from farfield_worker.shoot.walk_files import WalkFiles, read_folder
from PIL import Image

from tests.unit.raycast import JITTER
from tests.unit.scenes import checkerboard
from tests.unit.test_shoot_scene import rays, sky
from tests.unit.walk_writer import WalkWriter, cast_quads, near_glb

pytestmark = pytest.mark.usefixtures("graphics")

RESOLUTION = 64


def noise_page(seed: int, holes: float = 0.2) -> np.ndarray:
    rng = np.random.default_rng(seed)
    page = rng.integers(0, 256, (256, 256, 4), np.uint8)
    page[..., 3] = np.where(rng.random((256, 256)) < holes, 0, 255)
    return page


def shoot(writer: WalkWriter, folder, view: View):
    shooter = WalkShooter(writer.write(folder))
    picture = shooter.shoot(view)
    shooter.close()
    return picture


def check(writer: WalkWriter, view: View, picture, least: float) -> None:
    """Compare with rays where slightly different rays say the same; at least a share `least`."""
    eye = np.asarray(view.eye)
    answers = [cast_quads(writer, eye, rays(view, dx / 4, dy / 4)[0]) for dx, dy in JITTER]
    distance, color = answers[0]
    hit = ~np.isnan(distance)
    sure = np.ones(len(hit), np.bool_)
    for other_distance, other_color in answers[1:]:
        sure &= (hit == ~np.isnan(other_distance)) & (color == other_color).all(axis=1)
    assert sure.mean() > 0.6
    assert hit[sure].mean() > least
    rgba = picture.rgba.reshape(-1, 4)
    np.testing.assert_array_equal(rgba[sure, 3], np.where(hit, 255, 0)[sure])
    np.testing.assert_array_equal(picture.far.ravel()[sure], hit[sure])
    np.testing.assert_array_equal(rgba[sure & hit, :3], color[sure & hit])
    missed = sure & ~hit
    background = sky(rays(view)[0])
    assert np.abs(rgba[missed, :3] - background[missed]).max(initial=0) <= 1.01


def plane_through(point, normal, face: int, eye) -> tuple[float, float, float]:
    """Disparity plane of a plane in space, seen from `eye`."""
    _, right, down, forward = FACES[face]
    normal = np.asarray(normal, np.float64)
    normal = normal / (normal @ (np.asarray(point) - eye))
    return float(normal @ right), float(normal @ down), float(normal @ forward)


@pytest.mark.parametrize("seed", range(4))
def test_quads_of_all_kinds(tmp_path, seed):
    rng = np.random.default_rng(seed)
    writer = WalkWriter(RESOLUTION)
    writer.pages = [noise_page(1), noise_page(2, 0.0)]
    writer.eyes.append((0.3, 3.7, 0.2))
    octagon = 32 + 30 * np.stack(
        [np.cos(np.arange(8) * np.pi / 4), np.sin(np.arange(8) * np.pi / 4)], axis=1
    )
    square = np.array([[0, 0], [64, 0], [64, 64], [0, 64]])
    for face in range(6):
        low = rng.integers(0, 30, 2)
        rectangle = low + np.array([[0, 0], [30, 0], [30, 25], [0, 25]])
        distance = rng.uniform(11, 30)
        writer.quad(face, rectangle, (0, 0, 1 / distance), offset=-low + 1.0)
        # slanted, and infinitely far at one end
        writer.quad(face, square, (0.03, 0.0, 0.03), page=1, scale=0.5, turned=True, offset=(7, 9))
        writer.quad(face, octagon, (-0.01, 0.02, 0.04), page=0, eye=1, scale=2.0)
        writer.quad(face, square, (0.0, 0.0, 0.0), page=1, offset=(100.0, 60.0))
    eye = np.array(writer.centre()) + rng.uniform(-1.9, 1.9, 3)
    view = View(tuple(eye), rng.uniform(-3, 3), rng.uniform(-1.5, 1.5), rng.uniform(40, 100), 48)
    check(writer, view, shoot(writer, tmp_path / "walk", view), least=0.3)


def test_a_slanted_quad_is_a_wall_seen_from_everywhere_in_the_cell(tmp_path):
    """A wall drawn as one quad: the picture shows the wall where the wall is."""
    writer = WalkWriter(RESOLUTION)
    centre = np.array(writer.centre())
    point, normal = centre + np.array([4.0, 0.0, -20.0]), np.array([0.8, 0.0, 0.6])
    page = np.zeros((256, 256, 4), np.uint8)
    page[:] = (200, 30, 90, 255)
    writer.pages = [page]
    plane = plane_through(point, normal, 5, centre)
    # the wall's part with face coordinates from texel 28 to 40 across, 20 to 44 down
    writer.quad(5, [[28, 20], [40, 20], [40, 44], [28, 44]], plane)
    corners = []
    for x, y in ((28, 20), (40, 20), (40, 44), (28, 44)):
        u, v = 2 * x / RESOLUTION - 1, 2 * y / RESOLUTION - 1
        direction = FACES[5].forward + u * FACES[5].right + v * FACES[5].down
        corners.append(centre + direction / (plane[0] * u + plane[1] * v + plane[2]))
    shooter = WalkShooter(writer.write(tmp_path / "walk"))
    for offset in ((0, 0, 0), (1.9, -1.9, 1.9), (-1.9, 1.9, -1.9)):
        eye = centre + offset
        view = View(tuple(eye), 0.0, 0.0, 90.0, 64)
        picture = shooter.shoot(view)
        right, up, forward = view.axes()
        seen = np.array(corners) - eye
        x = (seen @ right / (seen @ forward) + 1) * 32
        y = (1 - seen @ up / (seen @ forward)) * 32
        row, column = np.mgrid[:64, :64] + 0.5
        inside = np.ones((64, 64), np.bool_)
        for i in range(4):
            j = (i + 1) % 4
            turn = (x[j] - x[i]) * (row - y[i]) - (y[j] - y[i]) * (column - x[i])
            inside &= turn >= 0
        drawn = picture.rgba[..., 3] == 255
        assert inside.sum() > 50
        assert (drawn != inside).sum() <= 2
        assert (picture.rgba[drawn] == (200, 30, 90, 255)).all()
    shooter.close()


def test_near_polygons_are_clipped_and_stand_before_quads(tmp_path):
    writer = WalkWriter(RESOLUTION, near_field=10.0)
    page = np.zeros((256, 256, 4), np.uint8)
    page[:] = (0, 0, 255, 255)
    writer.pages = [page]
    writer.quad(5, [[0, 0], [64, 0], [64, 64], [0, 64]], (0, 0, 1 / 12))
    centre = np.array(writer.centre())
    floor = np.array([[-3.07, -1, -2], [3.07, -1, -2], [3.07, -1, -200], [-3.07, -1, -200]])
    floor += centre
    triangles = floor[[[0, 1, 2], [0, 2, 3]]]
    red = near_glb(triangles, (1, 0, 0, 1), {"extensions": {"KHR_materials_unlit": {}}})
    writer.near = [(red, (0, 0, 2))]
    view = View(tuple(centre), 0.0, 0.0, 90.0, 64)
    picture = shoot(writer, tmp_path / "walk", view)
    reds = (picture.rgba == (255, 0, 0, 255)).all(axis=-1)
    blues = (picture.rgba == (0, 0, 255, 255)).all(axis=-1)
    assert (reds | blues).all()
    np.testing.assert_array_equal(picture.far, blues)
    # the floor one metre below ends 10 m away: at row 32 + 32 / 10
    directions = rays(view)[0].reshape(64, 64, 3)
    with np.errstate(divide="ignore"):
        t = -1.0 / directions[..., 1]
    point = directions * t[..., None]
    expected = (t > 2) & (np.abs(point).max(axis=-1) <= 10) & (np.abs(point[..., 0]) <= 3.07)
    assert 100 < expected.sum() < 1000
    np.testing.assert_array_equal(reds, expected)


def test_only_listed_triangles_are_drawn(tmp_path):
    writer = WalkWriter()
    centre = np.array(writer.centre())
    wall = np.array([[-3, -3, -6], [3, -3, -6], [3, 3, -6], [-3, 3, -6]]) + centre
    block = near_glb(wall[[[0, 1, 2], [0, 2, 3]]])
    view = View(tuple(centre), 0.0, 0.0, 60.0, 32)
    shown = {}
    for name, ranges in (("both", (0, 0, 2)), ("one", (0, 1, 1)), ("split", (0, 0, 1, 0, 1, 1))):
        writer.near = [(block, ranges)]
        shown[name] = shoot(writer, tmp_path / name, view).rgba
    assert (shown["both"] == shown["split"]).all()
    ratio = (shown["one"][..., 3] == 255).sum() / (shown["both"][..., 3] == 255).sum()
    assert 0.4 < ratio < 0.6


def test_near_materials_light_textures_and_sides(tmp_path):
    writer = WalkWriter()
    centre = np.array(writer.centre())
    wall = np.array([[-8, -8, -6], [8, -8, -6], [8, 8, -6], [-8, 8, -6]]) + centre
    front, back = wall[[[0, 1, 2], [0, 2, 3]]], wall[[[0, 2, 1], [0, 3, 2]]]
    view = View(tuple(centre), 0.0, 0.0, 60.0, 32)

    def picture(name: str, triangles, material, **options) -> np.ndarray:
        writer.near = [(near_glb(triangles, (0.5, 0.25, 1.0, 0.4), material, **options), (0, 0, 2))]
        return shoot(writer, tmp_path / name, view).rgba

    light = shading.default_light()

    def lit(normal, emissive=(0, 0, 0), base=(0.5, 0.25, 1.0)) -> np.ndarray:
        color = shading.shade(light, np.array(base), np.array(normal), np.array(emissive))
        return shading.to_srgb(color) * 255

    opaque = picture("front", front, {"emissiveFactor": [0.1, 0.0, 0.2]})
    assert np.abs(opaque[..., :3] - lit((0, 0, 1), (0.1, 0, 0.2))).max() <= 1.01
    assert (picture("back", back, {})[..., 3] == 0).all()
    double = picture("double", back, {"doubleSided": True})
    assert np.abs(double[..., :3] - lit((0, 0, 1))).max() <= 1.01
    masked = {"alphaMode": "MASK", "alphaCutoff": 0.41}
    assert (picture("mask", front, masked)[..., 3] == 0).all()
    assert (picture("kept", front, masked | {"alphaCutoff": 0.39})[..., 3] == 255).all()
    dithered = picture("dither", front, {"alphaMode": "BLEND", "extras": {"alpha": "dither"}})
    row, column = np.mgrid[:32, :32]
    expected = shading.dither(np.full((32, 32), 0.4), column, row)
    np.testing.assert_array_equal(dithered[..., 3] == 255, expected)

    uvs = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)[[[0, 1, 2], [0, 2, 3]]]
    writer.images = {"picture.png": checkerboard(16)}
    material = {
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
        "extensions": {"KHR_materials_unlit": {}},
    }
    textured = picture("texture", front, material, uvs=uvs, image="picture.png")
    directions = rays(view)[0].reshape(32, 32, 3)
    x, y = directions[..., 0] * 6 / 16 + 0.5, 0.5 - directions[..., 1] * 6 / 16
    texel = checkerboard(16)[(y * 16).astype(int), (x * 16).astype(int), :3]
    color = shading.to_srgb(shading.to_linear(texel / 255) * (0.5, 0.25, 1.0)) * 255
    # magnified and sampled nearest: every pixel shows exactly one texel
    assert np.abs(textured[..., :3] - color).max() <= 1.01


def test_the_cell_that_holds_the_eye_is_drawn_or_else_the_nearest_that_exists(tmp_path):
    writer = WalkWriter(cells=3)
    writer.pages = [np.full((256, 256, 4), 255, np.uint8)]
    for face in range(6):
        writer.quad(face, [[0, 0], [64, 0], [64, 64], [0, 64]], (0, 0, 0.05))
    walk = writer.write(tmp_path / "walk")
    first = walk.parent / "cells" / "0_0_0.json"
    text = first.read_text(encoding="utf-8").replace('"cell":[0,0,0]', '"cell":[2,0,0]')
    empty = writer.quads
    writer.quads = {name: [] for name in empty}
    other = writer.write(tmp_path / "other").parent / "cells" / "0_0_0.json"
    (walk.parent / "cells" / "2_0_0.json").write_text(
        text.replace(str(writer.centre(0)[0]), str(writer.centre(2)[0])), encoding="utf-8"
    )
    first.write_text(other.read_text(encoding="utf-8"), encoding="utf-8")
    shooter = WalkShooter(walk)

    def covered(x: float, cell=None) -> bool:
        view = View((x, 2.0, 2.0), 0.0, 0.0, size=4)
        return bool(shooter.shoot(view, cell).far.all())

    assert not covered(1.0)
    assert covered(9.0)
    assert covered(8.0)  # a cell owns its lower sides
    assert not covered(7.9, (0, 0, 0))
    assert covered(7.9)  # cell 1 is not baked; cell 2 is nearer than cell 0
    assert not covered(4.1)
    assert covered(1.0, (2, 0, 0))
    with pytest.raises(NotFoundError):
        covered(1.0, (1, 0, 0))
    shooter.close()


def test_paged_manifests_rank_cells_like_inline_ones(tmp_path):
    writer = WalkWriter(cells=5)
    manifest = writer.manifest()
    tables = [
        CellTable(i=(0, 1), j=(0, 0), k=(0, 0), y=(0.0, 0.0)),
        CellTable(i=(2, 3, 4), j=(0,) * 3, k=(0,) * 3, y=(0.0,) * 3),
    ]
    bounds = [
        {"min": (0.0, 0.0, 0.0), "max": (8.0, 4.0, 4.0)},
        {"min": (8.0, 0.0, 0.0), "max": (20.0, 4.0, 4.0)},
    ]
    pages = [{"href": f"pages/{n}.json", "cells": 2, "bounds": b} for n, b in enumerate(bounds)]
    grid = WalkGrid(origin=manifest.grid.origin, size=manifest.grid.size, total=5, pages=pages)
    files = {
        "walk.json": manifest.model_copy(update={"grid": grid}).model_dump_json().encode(),
        "pages/0.json": tables[0].model_dump_json().encode(),
        "pages/1.json": tables[1].model_dump_json().encode(),
    }
    inline = {"walk.json": manifest.model_dump_json().encode()}
    read: list[str] = []

    def reader(key: str) -> bytes:
        read.append(key)
        return files[key]

    paged = WalkFiles(reader)
    for x in (-3.0, 0.5, 7.9, 8.0, 9.0, 17.0, 33.0):
        eye = np.array([x, 1.0, 1.0])
        expected = list(WalkFiles(inline.__getitem__).nearest(eye))
        assert list(paged.nearest(eye)) == expected
        assert len(expected) == 5
    read.clear()
    assert next(paged.nearest(np.array([-3.0, 1.0, 1.0]))) == (0, 0, 0)
    assert read == ["pages/0.json"]


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (lambda q: q.update(faces=[6]), "faces"),
        (lambda q: q.update(eyes=[1]), "eyes"),
        (lambda q: q.update(pages=[-1]), "pages"),
        (lambda q: q.update(corner_counts=[2]), "corner"),
        (lambda q: q.update(planes=[0.0]), "planes"),
        (lambda q: q.update(scales=[]), "scales"),
    ],
)
def test_odd_quads_are_refused(tmp_path, change, word):
    writer = WalkWriter()
    writer.pages = [noise_page(0)]
    writer.quad(0, [[0, 0], [9, 0], [9, 9]], (0, 0, 0.1))
    change(writer.quads)
    with pytest.raises(BadInputError, match=word):
        shoot(writer, tmp_path / "walk", View(writer.centre(), 0.0, 0.0, size=4))


@pytest.mark.parametrize(
    "damage",
    [
        lambda data: data[:30],
        lambda data: b"none" + data[4:],
        lambda data: data.replace(b'"meshes"', b'"meshed"'),
        lambda data: data.replace(b'"count": 6', b'"count": 9'),
        lambda data: data.replace(b'"bufferView": 0', b'"bufferView": 9'),
        lambda data: data[:20] + b"!" + data[21:],
    ],
)
def test_damaged_near_blocks_are_refused(tmp_path, damage):
    writer = WalkWriter()
    wall = np.array([[-3, -3, -6], [3, -3, -6], [3, 3, -6], [-3, 3, -6]], np.float64)
    writer.near = [(damage(near_glb(wall[[[0, 1, 2], [0, 2, 3]]])), (0, 0, 2))]
    with pytest.raises(BadInputError):
        shoot(writer, tmp_path / "walk", View(writer.centre(), 0.0, 0.0, size=4))


def test_ranges_beyond_a_near_block_are_refused(tmp_path):
    writer = WalkWriter()
    triangle = np.array([[[-3, -3, -6], [3, -3, -6], [3, 3, -6]]], np.float64)
    for n, ranges in enumerate([(0, 0, 2), (0, -1, 1), (1, 0, 1)]):
        writer.near = [(near_glb(triangle), ranges)]
        with pytest.raises(BadInputError, match=r"lists triangles|ranges"):
            shoot(writer, tmp_path / str(n), View(writer.centre(), 0.0, 0.0, size=4))


def test_walks_are_found_in_stores_and_shot_to_files(tmp_path):
    writer = WalkWriter()
    writer.pages = [noise_page(0, 0.5)]
    writer.quad(5, [[0, 0], [64, 0], [64, 64], [0, 64]], (0, 0, 0.1))
    with pytest.raises(NotFoundError, match="bake one"):
        find_walk(tmp_path)
    walk = writer.write(tmp_path / "bakes" / "a")
    for target in (tmp_path, walk.parent, walk):
        assert find_walk(target) == walk
    view = View(writer.centre(), 0.1, 0.2, 70.0, 24)
    out = tmp_path / "pictures" / "one.png"
    shoot_to_file(tmp_path, view, out)
    shooter = WalkShooter(read_folder(walk.parent))
    expected = shooter.shoot(view).rgba
    shooter.close()
    with Image.open(out) as image:
        np.testing.assert_array_equal(np.asarray(image), expected)
    assert [path.name for path in out.parent.iterdir()] == ["one.png"]
    writer.write(tmp_path / "bakes" / "b")
    with pytest.raises(NotFoundError, match="several"):
        shoot_to_file(tmp_path, view, out)
    with pytest.raises(BadInputError, match="png"):
        shoot_to_file(walk, view, tmp_path / "one.jpg")
    with pytest.raises(NotFoundError):
        shoot_to_file(tmp_path / "nothing", view, out)


def test_a_walk_of_another_version_is_refused(tmp_path):
    walk = WalkWriter().write(tmp_path / "walk")
    walk.write_text(walk.read_text(encoding="utf-8").replace('"version":1', '"version":2'))
    with pytest.raises(BadInputError, match="version"):
        WalkShooter(walk)
