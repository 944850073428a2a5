"""Looks of glTF files: factors, vertex colours, textures, opacity, light given off."""

from __future__ import annotations

import base64
import io
import json
import zlib

import numpy as np
import pytest
from farfield_core.errors import SceneRefusedError
from farfield_core.scene import PreparedScene
from PIL import Image

from tests.unit.prepare.build import (
    QUAD_UVS,
    Gltf,
    flat_color,
    one_quad,
    png,
    prepared,
    soup,
)


def textured(pixels: np.ndarray, material: dict | None = None, surface: dict | None = None) -> Gltf:
    """One textured square."""
    gltf = Gltf()
    info = {"index": gltf.texture(pixels)}
    base = {"baseColorTexture": info} | (surface or {})
    gltf.add("materials", {"pbrMetallicRoughness": base} | (material or {}))
    gltf.node(mesh=gltf.mesh(gltf.quad(0, TEXCOORD_0=QUAD_UVS)))
    return gltf


def texture_pixels(scene: PreparedScene, index: int = 0) -> np.ndarray:
    with Image.open(scene.folder / "textures" / scene.info.textures[index].file) as image:
        return np.asarray(image)


def test_factor_times_vertex_colour_times_texture(tmp_path):
    gltf = textured(flat_color(200, 100, 50), surface={"baseColorFactor": [0.5, 0.25, 1, 1]})
    colors = np.tile(np.array([0.5, 1, 0.5, 1], "f4"), (4, 1))
    gltf.root["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = gltf.accessor(colors)
    scene = prepared(gltf, tmp_path)
    assert np.allclose(soup(scene).colors, (0.25, 0.25, 0.5, 1), atol=2e-5)
    assert (texture_pixels(scene) == (200, 100, 50)).all()
    (batch,) = scene.info.batches
    assert (batch.texture, batch.alpha, batch.double_sided, batch.unlit) == (
        0,
        "opaque",
        False,
        False,
    )


@pytest.mark.parametrize(
    ("colors", "normalized", "expected"),
    [
        (np.array([[0.25, 0.5, 1]], "f4"), False, (0.25, 0.5, 1, 1)),
        (np.array([[-1, 7, np.nan, 1]], "f4"), False, (0, 1, 1, 1)),
        (np.array([[51, 102, 255, 255]], "u1"), True, (0.2, 0.4, 1, 1)),
        (np.array([[13107, 0, 65535]], "u2"), True, (0.2, 0, 1, 1)),
    ],
)
def test_vertex_colours_are_linear_and_clamped(tmp_path, colors, normalized, expected):
    gltf = one_quad()
    accessor = gltf.accessor(np.tile(colors, (4, 1)), normalized=normalized)
    gltf.root["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = accessor
    assert np.allclose(soup(prepared(gltf, tmp_path)).colors, expected, atol=2e-5)


def test_materials_that_differ_in_their_factor_share_a_batch(tmp_path):
    gltf = Gltf()
    for n in range(5):
        gltf.add("materials", {"pbrMetallicRoughness": {"baseColorFactor": [n / 4, 0, 0, 1]}})
        gltf.node(mesh=gltf.mesh(gltf.quad(n)), translation=[2 * n, 0, 0])
    scene = prepared(gltf, tmp_path)
    assert len(scene.info.batches) == 1
    s = soup(scene)
    assert np.allclose(
        s.colors[..., 0], np.floor(s.positions.min(axis=1)[:, :1] / 2) / 4, atol=2e-5
    )


def test_mask(tmp_path):
    pixels = flat_color(0, 255, 0)
    pixels[0, 0, 3] = 0
    scene = prepared(textured(pixels, {"alphaMode": "MASK", "alphaCutoff": 0.3}), tmp_path)
    (batch,) = scene.info.batches
    assert (batch.alpha, batch.cutoff) == ("mask", 0.3)
    assert (texture_pixels(scene) == pixels).all()


def test_mask_that_cuts_nothing_is_opaque(tmp_path):
    scene = prepared(textured(flat_color(9, 9, 9, 200), {"alphaMode": "MASK"}), tmp_path)
    assert scene.info.batches[0].alpha == "opaque"
    assert texture_pixels(scene).shape[2] == 3


def test_even_blend_is_dithered(tmp_path):
    scene = prepared(textured(flat_color(9, 9, 9, 102), {"alphaMode": "BLEND"}), tmp_path)
    assert scene.info.batches[0].alpha == "dither"
    assert (texture_pixels(scene)[..., 3] == 102).all()


def test_blend_by_factor_is_dithered(tmp_path):
    glass = {"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.25]}}
    scene = prepared(one_quad(glass), tmp_path)
    assert scene.info.batches[0].alpha == "dither"
    assert np.allclose(soup(scene).colors[..., 3], 0.25, atol=1e-4)


def test_varying_blend_is_masked_at_half_the_greatest(tmp_path):
    pixels = flat_color(9, 9, 9, 0)
    pixels[0, 0, 3] = 204
    gltf = textured(pixels, {"alphaMode": "BLEND"}, {"baseColorFactor": [1, 1, 1, 0.5]})
    (batch,) = prepared(gltf, tmp_path).info.batches
    assert batch.alpha == "mask"
    assert batch.cutoff == pytest.approx(0.2)


def test_full_blend_is_opaque(tmp_path):
    scene = prepared(textured(flat_color(9, 9, 9), {"alphaMode": "BLEND"}), tmp_path)
    assert scene.info.batches[0].alpha == "opaque"


def test_opaque_ignores_opacity(tmp_path):
    gltf = textured(flat_color(9, 9, 9, 50), {}, {"baseColorFactor": [1, 1, 1, 0.1]})
    scene = prepared(gltf, tmp_path)
    assert scene.info.batches[0].alpha == "opaque"
    assert (soup(scene).colors[..., 3] == 1).all()


@pytest.mark.parametrize("mode", ["BLEND", "MASK"])
def test_what_cannot_be_seen_is_left_out(tmp_path, mode):
    gltf = textured(flat_color(9, 9, 9, 0), {"alphaMode": mode})
    gltf.node(mesh=gltf.mesh(gltf.quad()))
    scene = prepared(gltf, tmp_path)
    assert scene.info.triangles == 2
    assert scene.info.textures == ()
    assert scene.info.notes == ("Parts that are wholly transparent were left out.",)


def test_unlit_and_double_sided(tmp_path):
    material = {"doubleSided": True, "extensions": {"KHR_materials_unlit": {}}}
    gltf = one_quad(material | {"emissiveFactor": [1, 1, 1]})
    gltf.root["extensionsRequired"] = ["KHR_materials_unlit"]
    (batch,) = prepared(gltf, tmp_path).info.batches
    assert batch.unlit
    assert batch.double_sided
    assert batch.emissive == (0, 0, 0)


def test_emission(tmp_path):
    gltf = textured(flat_color(1, 2, 3), {"emissiveFactor": [0.5, 0, 1]})
    glow = gltf.texture(flat_color(4, 5, 6))
    gltf.root["materials"][0]["emissiveTexture"] = {"index": glow}
    gltf.root["materials"][0]["extensions"] = {
        "KHR_materials_emissive_strength": {"emissiveStrength": 2}
    }
    scene = prepared(gltf, tmp_path)
    (batch,) = scene.info.batches
    assert batch.emissive == (1, 0, 2)
    assert (texture_pixels(scene, batch.emissive_texture) == (4, 5, 6)).all()


def test_emission_on_other_coordinates_is_noted(tmp_path):
    gltf = textured(flat_color(1, 2, 3), {"emissiveFactor": [1, 1, 1]})
    glow = gltf.texture(flat_color(4, 5, 6))
    gltf.root["materials"][0]["emissiveTexture"] = {"index": glow, "texCoord": 1}
    scene = prepared(gltf, tmp_path)
    assert scene.info.batches[0].emissive == (0, 0, 0)
    assert "does not shine" in scene.info.notes[0]


def test_texture_transform_and_coordinate_set(tmp_path):
    gltf = textured(flat_color(1, 2, 3))
    primitive = gltf.root["meshes"][0]["primitives"][0]
    primitive["attributes"]["TEXCOORD_0"] = gltf.accessor(np.zeros((4, 2), "f4"))
    primitive["attributes"]["TEXCOORD_2"] = gltf.accessor(QUAD_UVS)
    transform = {"offset": [0.5, 0.25], "scale": [2, 3], "rotation": np.pi / 2, "texCoord": 2}
    info = gltf.root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]
    info["extensions"] = {"KHR_texture_transform": transform}
    s = soup(prepared(gltf, tmp_path))
    u, v = s.positions[..., 0] * 2, (1 - s.positions[..., 1]) * 3
    # a quarter turn of (u, v) as the extension's matrix has it: (v, -u)
    assert np.allclose(s.uvs[..., 0], v + 0.5, atol=1e-6)
    assert np.allclose(s.uvs[..., 1], -u + 0.25, atol=1e-6)


def test_samplers(tmp_path):
    gltf = textured(flat_color(1, 2, 3))
    sampler = {"wrapS": 33071, "wrapT": 33648, "magFilter": 9728}
    gltf.root["textures"][0]["sampler"] = gltf.add("samplers", sampler)
    (texture,) = prepared(gltf, tmp_path).info.textures
    assert (texture.wrap_u, texture.wrap_v, texture.filter) == ("clamp", "mirror", "nearest")
    assert (texture.width, texture.height) == (2, 2)


def test_equal_pictures_are_stored_once(tmp_path):
    gltf = Gltf()
    for n in range(3):
        info = {"index": gltf.texture(flat_color(7, 7, 7))}
        gltf.add("materials", {"pbrMetallicRoughness": {"baseColorTexture": info}})
        gltf.node(mesh=gltf.mesh(gltf.quad(n, TEXCOORD_0=QUAD_UVS)))
    scene = prepared(gltf, tmp_path)
    assert len(scene.info.batches) == len(scene.info.textures) == 1
    assert len(list((scene.folder / "textures").iterdir())) == 1


@pytest.mark.parametrize("form", ["WEBP", "JPEG", "BMP"])
def test_picture_formats(tmp_path, form):
    out = io.BytesIO()
    picture = Image.fromarray(flat_color(250, 120, 60, size=8)[..., :3].copy())
    picture.save(out, form, **({"lossless": True} if form == "WEBP" else {}))
    gltf = textured(flat_color(0, 0, 0))
    gltf.root["images"] = [{"bufferView": gltf.view(out.getvalue())}]
    if form == "WEBP":
        gltf.root["textures"] = [{"extensions": {"EXT_texture_webp": {"source": 0}}}]
        gltf.root["extensionsRequired"] = ["EXT_texture_webp"]
    pixels = texture_pixels(prepared(gltf, tmp_path)).astype(int)
    assert np.abs(pixels - (250, 120, 60)).max() <= 3


def test_sixteen_bit_greys_are_scaled(tmp_path):
    out = io.BytesIO()
    Image.fromarray(np.full((2, 2), 0x8080, np.uint16)).save(out, "PNG")
    gltf = textured(flat_color(0, 0, 0))
    gltf.root["images"] = [{"bufferView": gltf.view(out.getvalue())}]
    assert (texture_pixels(prepared(gltf, tmp_path)) == 0x80).all()


@pytest.mark.parametrize("source", ["data", "file"])
def test_pictures_outside_the_buffer(tmp_path, source):
    data = png(flat_color(1, 2, 3))
    (tmp_path / "a b.png").write_bytes(data)
    uri = "a%20b.png"
    if source == "data":
        uri = "data:image/png;base64," + base64.b64encode(data).decode()
    gltf = textured(flat_color(0, 0, 0))
    gltf.root["images"] = [{"uri": uri}]
    assert (texture_pixels(prepared(gltf, tmp_path)) == (1, 2, 3)).all()


def test_missing_and_broken_pictures_are_noted(tmp_path):
    for image, note in [
        ({"uri": "none.png"}, "The texture 'none.png' is missing."),
        ({"uri": "broken.png"}, "The texture 'broken.png' cannot be read."),
    ]:
        (tmp_path / "broken.png").write_bytes(b"\x89PNG\r\n\x1a\nnothing")
        gltf = textured(flat_color(0, 0, 0), surface={"baseColorFactor": [0.5, 0, 0, 1]})
        gltf.root["images"] = [image]
        scene = prepared(gltf, tmp_path)
        assert scene.info.notes == (note,)
        assert scene.info.batches[0].texture is None
        assert np.allclose(soup(scene).colors, (0.5, 0, 0, 1), atol=1e-4)


def test_half_a_picture_is_noted(tmp_path):
    whole = png(np.random.default_rng(1).integers(0, 255, (64, 64, 4)))
    gltf = textured(flat_color(0, 0, 0))
    gltf.root["images"] = [{"bufferView": gltf.view(whole[: len(whole) // 2])}]
    scene = prepared(gltf, tmp_path)
    assert scene.info.notes == ("The texture 'image 0' cannot be read.",)
    assert scene.info.textures == ()


def test_unsupported_textures(tmp_path):
    gltf = textured(flat_color(0, 0, 0))
    gltf.root["textures"] = [{"extensions": {"KHR_texture_basisu": {"source": 0}}}]
    scene = prepared(gltf, tmp_path)
    assert scene.info.notes == ("A texture in a format that is not supported was left out.",)
    gltf.root["extensionsRequired"] = ["KHR_texture_basisu"]
    with pytest.raises(SceneRefusedError, match="KHR_texture_basisu"):
        prepared(gltf, tmp_path)


def test_texture_without_coordinates_is_noted(tmp_path):
    gltf = textured(flat_color(0, 0, 0))
    del gltf.root["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"]
    scene = prepared(gltf, tmp_path)
    assert scene.info.notes == ("A part without texture coordinates lost its texture.",)
    assert scene.info.batches[0].texture is None


def test_specular_glossiness(tmp_path):
    older = {"KHR_materials_pbrSpecularGlossiness": {"diffuseFactor": [0.1, 0.2, 0.3, 1]}}
    s = soup(prepared(one_quad({"extensions": older}), tmp_path))
    assert np.allclose(s.colors, (0.1, 0.2, 0.3, 1), atol=1e-4)


def test_huge_pictures_are_refused_before_they_are_decoded(tmp_path):
    # a PNG header alone: decoding it would fail, so a refusal shows that it was never tried
    header = bytearray(png(flat_color(0, 0, 0)))
    header[16:24] = (60000).to_bytes(4, "big") * 2
    header[29:33] = zlib.crc32(header[12:29]).to_bytes(4, "big")
    gltf = textured(flat_color(0, 0, 0))
    gltf.root["images"] = [{"bufferView": gltf.view(bytes(header))}]
    with pytest.raises(SceneRefusedError, match=r"pixels|too large"):
        prepared(gltf, tmp_path)


def test_scene_file_is_plain_json(tmp_path):
    scene = prepared(textured(flat_color(1, 2, 3)), tmp_path)
    info = json.loads((scene.folder / "scene.json").read_text())
    assert info["version"] == 1
    assert info["textures"][0]["file"].endswith(".png")
    assert sorted(path.name for path in scene.folder.iterdir()) == [
        "colors.npy",
        "normals.npy",
        "positions.npy",
        "scene.json",
        "textures",
        "triangles.npy",
        "uvs.npy",
    ]
