"""A cell exported as glTF, read by an ordinary glTF reader and drawn as an ordinary model."""

import io
import json

import numpy as np
import pytest
import trimesh
from farfield.__main__ import main
from farfield_core.scene import open_scene
from farfield_core.scenes import open_prepared
from farfield_core.tables import walk_grid
from farfield_worker.cell.bake import CellBaker
from farfield_worker.gltf.cell import cell_glb
from farfield_worker.gltf.flatten import ERROR, flatten
from farfield_worker.gltf.polygons import clipped
from farfield_worker.prepare import prepare
from farfield_worker.shoot.scene import SceneShooter
from farfield_worker.shoot.view import View
from farfield_worker.shoot.walk import WalkShooter
from farfield_worker.shoot.walk_files import WalkFiles, read_folder
from farfield_worker.slanted.clip import texel_line
from farfield_worker.verify.metrics import eroded, unmatched

from tests.unit.cells import small_bake
from tests.unit.scenes import SceneWriter

RESOLUTION = 64


def affine(flat, texel):
    """Where an ordinary viewer shows the points that lie at `texel` (n, 2): (n, 3)."""
    found = np.full((len(texel), 3), np.nan)
    for triangle in flat.triangles:
        a, b, c = flat.texels[triangle]
        weights = np.linalg.solve(np.array([b - a, c - a]).T, (texel - a).T).T
        inside = (weights >= -1e-9).all(axis=1) & (weights.sum(axis=1) <= 1 + 1e-9)
        p, q, r = flat.points[triangle]
        found[inside] = p + weights[inside] @ np.array([q - p, r - p])
    return found


@pytest.mark.parametrize(
    "plane",
    [(0.0, 0.0, 0.05), (0.02, 0.05, 0.07), (0.0, 0.09, 0.02), (0.001, 0.0, 0.001), (0, 0, 0)],
    ids=str,
)
def test_pictures_stay_within_a_quarter_of_a_texel(plane):
    rng = np.random.default_rng(1)
    eye = np.array([0.5, -0.2, 0.3])
    polygon = np.array([[3, 20], [50, 20], [61, 33], [60, 60], [10, 62.5]])
    line = texel_line(np.array(plane, np.float64), RESOLUTION)
    least = 1 / (RESOLUTION * 2.0)
    # beyond d = 0 nothing is ever drawn
    polygon[:, 1] = np.maximum(polygon[:, 1], 32 if plane[1] > plane[2] else 0)
    flat = flatten(4, eye, polygon, line, RESOLUTION, least)
    texel = rng.uniform(polygon.min(axis=0), polygon.max(axis=0), (2000, 2))
    points = affine(flat, texel)
    drawn = ~np.isnan(points[:, 0])
    x, y = polygon.T
    area = abs(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) / 2
    box = np.prod(polygon.max(axis=0) - polygon.min(axis=0))
    assert drawn.mean() == pytest.approx(area / box, abs=0.04), "no gaps"
    q = points[drawn] - eye
    # face 4 looks along +z, right is -x, down is -y
    u, v = -q[:, 0] / q[:, 2], -q[:, 1] / q[:, 2]
    seen = np.stack([u + 1, v + 1], axis=1) * RESOLUTION / 2
    assert np.abs(seen - texel[drawn]).max() <= max(ERROR, 1.0 if plane[1] > plane[2] else 0) + 1e-6
    d = texel[drawn] @ line[:2] + line[2]
    near = d > 1.5 * least
    if near.any():
        assert np.abs(q[near, 2] * d[near] - 1).max() < 0.1
    assert (q[:, 2] <= 2 / least * (1 + 1e-6)).all()


def test_parts_of_a_quad_meet_corner_to_corner():
    polygon = np.array([[0, 0], [64, 0], [64, 64], [0, 64.0]])
    line = texel_line(np.array([0.02, 0.03, 0.06]), RESOLUTION)
    flat = flatten(4, np.zeros(3), polygon, line, RESOLUTION, 1e-3)
    keys = [tuple(np.round(t, 5)) for t in flat.texels]
    edges = {}
    for triangle in flat.triangles:
        for i in range(3):
            a, b = keys[triangle[i]], keys[triangle[(i + 1) % 3]]
            edges[(a, b)] = edges.get((a, b), 0) + 1
    assert len(flat.triangles) > 20
    for (a, b), times in edges.items():
        outside = any(a[k] == b[k] and a[k] in (0.0, 64.0) for k in (0, 1))
        assert times == 1
        assert ((b, a) in edges) == (not outside), "an edge has a triangle on both sides"


def test_polygons_are_cut_at_the_near_field():
    rng = np.random.default_rng(3)
    corners = rng.uniform(-9, 9, (60, 3, 3))
    mesh = {
        "position": corners.reshape(-1, 3),
        "normal": np.tile(np.array([0, 127, 0, 0], np.int8), (180, 1)),
        "uv": corners.reshape(-1, 3)[:, :2],
        "color": np.full((180, 4), 65535, np.uint16),
        "triangles": np.arange(180).reshape(-1, 3),
    }
    out = clipped(mesh, 5.0)
    assert np.abs(out["position"]).max() <= 5 + 1e-9
    assert np.allclose(out["uv"], out["position"][:, :2]), "attributes go along"

    def area(p):
        return 0.5 * np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1).sum()

    weights = rng.dirichlet((1, 1, 1), (60, 4000))
    inside = np.abs(np.einsum("twc,tcx->twx", weights, corners)).max(axis=2) <= 5
    sizes = np.array([area(corners[t : t + 1]) for t in range(60)])
    assert area(out["position"][out["triangles"]]) == pytest.approx(
        (inside.mean(axis=1) * sizes).sum(), rel=0.02
    )


@pytest.mark.usefixtures("graphics")
@pytest.mark.parametrize("quads", ["slanted", "layers"])
def test_an_ordinary_reader_shows_what_readers_of_walks_show(tmp_path, quads):
    def fill(writer: SceneWriter) -> None:
        rng = np.random.default_rng(8)
        batch = writer.batch(double_sided=True)
        floor = np.array([[-300, -2, 300], [300, -2, 300], [300, -2, -300], [-300, -2, -300]])
        writer.quad(batch, floor, color=(0.2, 0.4, 0.1, 1))
        for angle in rng.uniform(0, 2 * np.pi, 25):
            distance = np.exp(rng.uniform(np.log(5), np.log(80)))
            x, z = distance * np.cos(angle), distance * np.sin(angle)
            size = rng.uniform(0.1, 0.3, 3) * distance
            high = (x + size[0], -2 + 2 * size[1], z + size[2])
            writer.box(batch, (x, -2, z), high, color=(*rng.uniform(0.1, 1, 3), 1))

    walk, store = small_bake(tmp_path, fill, quads=quads, resolution=128, layers=24)
    baker = CellBaker(open_prepared(store, "test"), walk, store)
    cell = baker.bake((0, 0, 0), walk_grid(store, walk).centre((0, 0, 0)))
    baker.close()
    folder = store.local_path(f"bakes/{walk.id}")
    assert folder is not None
    data = cell_glb(WalkFiles(read_folder(folder)), cell)

    read = trimesh.load(io.BytesIO(data), file_type="glb")
    assert {name.split("_")[0] for name in read.graph.nodes_geometry} >= {"far", "near"}
    path = tmp_path / "cell.glb"
    path.write_bytes(data)
    prepare(path, tmp_path / "plain", "plain", "A cell", pictures=False)
    plain = SceneShooter(open_scene(tmp_path / "plain"))
    walks = WalkShooter(folder)
    rng = np.random.default_rng(2)
    centre = np.array(cell.eyes[0])
    wrong = shown = 0
    for _ in range(6):
        offset = rng.uniform(-0.9, 0.9, 3)
        yaw, pitch = rng.uniform(-3, 3), rng.uniform(-0.6, 0.3)
        ours = walks.shoot(View(tuple(centre + offset), yaw, pitch, 60, 192))
        theirs = plain.shoot(View(tuple(offset), yaw, pitch, 60, 192, 0.02))
        wrong += int(unmatched(ours.rgba[..., :3], theirs.rgba[..., :3]).sum())
        wrong += int((eroded(ours.rgba[..., 3] > 0) & (theirs.rgba[..., 3] == 0)).sum())
        shown += int((ours.rgba[..., 3] > 0).sum())
    walks.close()
    plain.close()
    assert shown > 50_000
    assert wrong <= 2e-3 * shown


@pytest.mark.usefixtures("graphics")
def test_the_command_line_writes_one_cell(tmp_path, capsys):
    walk, store = small_bake(tmp_path, layers=4)
    baker = CellBaker(open_prepared(store, "test"), walk, store)
    baker.bake((0, 0, 0), walk_grid(store, walk).centre((0, 0, 0)))
    baker.close()
    out = tmp_path / "new" / "cell.glb"
    words = ["export", "--store", str(tmp_path / "store"), "--json", "--gltf"]
    assert main([*words, "0,0,0", "--out", str(out)]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told == {"bake": walk.id, "out": str(out), "bytes": out.stat().st_size}
    assert out.read_bytes()[:4] == b"glTF"
    for cell, name, word in (
        ("0,0,0", "cell.glb", "exists"),
        ("1,0,0", "other.glb", "not exist"),
        ("one", "other.glb", "whole numbers"),
        ("0,0,0", "other.gltf", ".glb"),
    ):
        assert main([*words, cell, "--out", str(out.with_name(name))]) != 0
        assert word in capsys.readouterr().err
    assert [path.name for path in out.parent.iterdir()] == ["cell.glb"]
