"""OBJ and its material files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from farfield_core.errors import SceneRefusedError
from farfield_shading import to_linear
from farfield_worker.prepare.mtl import split_options
from PIL import Image

from tests.unit.prepare.build import canonical, facing, flat_color, png, prepared, soup

SQUARE = """
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
vn 0 0 1
"""
TWO = np.array([[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]]], float)


def write(folder: Path, obj: str, mtl: str | None = None) -> Path:
    path = folder / "model.obj"
    path.write_text(obj)
    if mtl is not None:
        (folder / "model.mtl").write_text(mtl)
    return path


@pytest.mark.parametrize(
    "faces",
    [
        "f 1 2 3\nf 1 3 4",
        "f 1 2 3 4",
        "f 1/1 2/2 3/3 4/4",
        "f 1//1 2//1 3//1\nf 1//1 3//1 4//1",
        "f 1/1/1 2/2/1 3/3/1\nf 1/1/1 3/3/1 4/4/1",
        "f -4 -3 -2\nf -4 -2 -1",
        "f -4/-4/-1 -3/-3/-1 -2/-2/-1 -1/-1/-1",
        "g a\nf 1 2 3\no b\nf 1 3 4",
        "f 1 2 3\r\nf 1 3 4\r",
        "f 1 2 \\\n3 4",
    ],
)
def test_faces(tmp_path, faces):
    scene = prepared(write(tmp_path, SQUARE + faces + "\n"), tmp_path)
    s = soup(scene)
    assert canonical(s.positions) == canonical(TWO)
    assert np.allclose(s.normals, (0, 0, 1))
    assert scene.info.batches[0].double_sided


def test_relative_indices_count_from_where_they_stand(tmp_path):
    obj = SQUARE + "f -4 -3 -2 -1\nv 9 9 9\nv 9 9 8\nv 9 8 9\nf -3 -2 -1\n"
    scene = prepared(write(tmp_path, obj), tmp_path)
    assert scene.info.triangles == 3
    assert scene.info.bounds.max == (9, 9, 9)


def test_polygons_become_fans(tmp_path):
    ring = [(np.cos(a), np.sin(a)) for a in np.arange(6) * np.pi / 3]
    obj = "".join(f"v {x} {y} 0\n" for x, y in ring) + "f 1 2 3 4 5 6\nf 1 2 3\n"
    s = soup(prepared(write(tmp_path, obj), tmp_path))
    assert len(s.positions) == 5
    assert np.allclose(facing(s.positions), (0, 0, 1))


def test_colour_factor_is_srgb(tmp_path):
    mtl = "newmtl red\nKd 0.5 0 0\n"
    path = write(tmp_path, "mtllib model.mtl\n" + SQUARE + "usemtl red\nf 1 2 3 4\n", mtl)
    s = soup(prepared(path, tmp_path))
    assert np.allclose(s.colors[..., 0], to_linear(np.array(0.5)), atol=1e-4)
    assert (s.colors[..., 1:3] == 0).all()


def test_vertex_colours(tmp_path):
    rows = ["v 0 0 0 1 0 0", "v 1 0 0 1 0 0", "v 0 1 0 1 0.5 0"]
    s = soup(prepared(write(tmp_path, "\n".join(rows) + "\nf 1 2 3\n"), tmp_path))
    greens = np.sort(s.colors[..., 1].ravel())
    assert np.allclose(greens, [0, 0, float(to_linear(np.array(0.5)))], atol=1e-4)


def test_texture_runs_down(tmp_path):
    pixels = flat_color(10, 20, 30)
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "a b.png").write_bytes(png(pixels))
    mtl = "newmtl m\nmap_Kd sub\\a b.png\n"
    obj = "mtllib model.mtl\n" + SQUARE + "usemtl m\nf 1/1 2/2 3/3 4/4\n"
    scene = prepared(write(tmp_path, obj, mtl), tmp_path)
    s = soup(scene)
    assert np.allclose(s.uvs[..., 0], s.positions[..., 0])
    assert np.allclose(s.uvs[..., 1], 1 - s.positions[..., 1])
    assert scene.info.batches[0].texture == 0
    assert scene.info.notes == ()


def test_texture_options(tmp_path):
    (tmp_path / "t.png").write_bytes(png(flat_color(1, 1, 1)))
    mtl = "newmtl m\nmap_Kd -s 2 3 1 -o 0.5 0.25 0 -clamp on t.png\n"
    obj = "mtllib model.mtl\n" + SQUARE + "usemtl m\nf 1/1 2/2 3/3 4/4\n"
    scene = prepared(write(tmp_path, obj, mtl), tmp_path)
    s = soup(scene)
    assert np.allclose(s.uvs[..., 0], 2 * s.positions[..., 0] + 0.5)
    assert np.allclose(1 - s.uvs[..., 1], 3 * s.positions[..., 1] + 0.25)
    assert scene.info.textures[0].wrap_u == "clamp"


def test_split_options():
    assert split_options(["-s", "1", "1", "a", "b.png"]) == ("a b.png", {"-s": ["1", "1"]})
    assert split_options(["-bm", "2", "-mm", "0", "1", "x.png"])[0] == "x.png"
    assert split_options(["x.png"]) == ("x.png", {})


def test_opacity(tmp_path):
    leaf = flat_color(0, 255, 0)
    leaf[0, 0, 3] = 0
    (tmp_path / "leaf.png").write_bytes(png(leaf))
    (tmp_path / "fern.png").write_bytes(png(flat_color(0, 200, 0)[..., :3]))
    (tmp_path / "mask.png").write_bytes(png(np.array([[0, 255], [255, 255]])))
    mtl = (
        "newmtl glass\nd 0.5\nnewmtl old\nTr 0.75\nnewmtl leaf\nmap_Kd leaf.png\n"
        "newmtl fern\nmap_Kd fern.png\nmap_d mask.png\nnewmtl wall\nd 1.0\n"
    )
    faces = "".join(
        f"usemtl {name}\nf 1/1 2/2 3/3\n" for name in ("glass", "old", "leaf", "fern", "wall")
    )
    scene = prepared(write(tmp_path, "mtllib model.mtl\n" + SQUARE + faces, mtl), tmp_path)
    kinds = sorted((b.alpha, b.texture is not None) for b in scene.info.batches)
    assert kinds == [("dither", False), ("mask", True), ("mask", True), ("opaque", False)]
    alphas = sorted(round(float(a), 2) for a in np.unique(soup(scene).colors[..., 3]))
    assert alphas == [0.25, 0.5, 1.0]
    stored = []
    for texture in scene.info.textures:
        with Image.open(scene.folder / "textures" / texture.file) as image:
            stored.append(np.asarray(image)[..., 3].min())
    assert stored == [0, 0]


def test_missing_files_are_noted(tmp_path):
    obj = "mtllib none.mtl\n" + SQUARE + "usemtl x\nf 1 2 3\n"
    scene = prepared(write(tmp_path, obj), tmp_path)
    assert "The material file 'none.mtl' is missing." in scene.info.notes
    mtl = "newmtl a\nmap_Kd one.png\nnewmtl b\nmap_Kd two.png\nKd 1 0 0\n"
    obj = "mtllib model.mtl\n" + SQUARE + "usemtl a\nf 1/1 2/2 3/3\nusemtl b\nf 1/1 3/3 4/4\n"
    scene = prepared(write(tmp_path, obj, mtl), tmp_path)
    assert scene.info.notes == ("Textures are missing: 'one.png', 'two.png'.",)
    assert len(scene.info.batches) == 1


def test_several_material_files(tmp_path):
    (tmp_path / "a.mtl").write_text("newmtl a\nKd 1 0 0\n")
    (tmp_path / "b.mtl").write_text("newmtl b\nKd 0 1 0\n")
    obj = "mtllib a.mtl\nmtllib b.mtl\n" + SQUARE + "usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\n"
    s = soup(prepared(write(tmp_path, obj), tmp_path))
    assert sorted(map(tuple, s.colors[:, 0, :3].tolist())) == [(0, 1, 0), (1, 0, 0)]


@pytest.mark.parametrize("name", ["/etc/passwd", "../secret.mtl", "C:\\x.mtl", "http://x/y.mtl"])
def test_files_outside_are_refused(tmp_path, name):
    folder = tmp_path / "upload"
    folder.mkdir()
    (tmp_path / "secret.mtl").write_text("newmtl a\n")
    with pytest.raises(SceneRefusedError, match="not a file in its own folder"):
        prepared(write(folder, f"mtllib {name}\n" + SQUARE + "f 1 2 3\n"), folder)
