"""Scenes in a store: sources with what belongs to them, preparation in another process."""

import json
import sys
import threading
import time
from pathlib import Path

import pytest
from farfield_core import scenes, sources
from farfield_core.dispatch.prepare import (
    PrepareLimits,
    ScenePreparer,
    forget_scene,
    prepare_scene,
)
from farfield_core.errors import FarfieldError, NotFoundError, SceneRefusedError
from farfield_core.store import Store

FAKE = (sys.executable, str(Path(__file__).with_name("fake_prepare.py")))


@pytest.fixture(params=["folder", "memory"])
def store(request: pytest.FixtureRequest, tmp_path: Path) -> Store:
    return Store.open("memory://" if request.param == "memory" else tmp_path / "store")


def model(folder: Path, text: str = "fine", name: str = "house.stl") -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


def test_gltf_brings_its_files(tmp_path: Path) -> None:
    (tmp_path / "tex").mkdir()
    for name in ("town.bin", "tex/wall 1.png", "other.png"):
        (tmp_path / name).write_bytes(b"x")
    (tmp_path.parent / "outside.bin").write_bytes(b"x")
    document = {
        "buffers": [
            {"uri": "town.bin"},
            {"uri": "data:application/octet-stream;base64,AAAA"},
            {"uri": "../outside.bin"},
            {"uri": "/etc/hostname"},
            {"byteLength": 3},
        ],
        "images": [{"uri": "tex/wall%201.png"}, {"uri": "missing.png"}, {"bufferView": 0}, 7],
    }
    gltf = model(tmp_path, json.dumps(document), "town.gltf")
    assert list(sources.source_files(gltf)) == ["town.gltf", "town.bin", "tex/wall 1.png"]


def test_obj_brings_its_materials_and_their_textures(tmp_path: Path) -> None:
    for name in ("wood.png", "a b.png", "bump.png", "other.png"):
        (tmp_path / name).write_bytes(b"x")
    (tmp_path / "m.mtl").write_text(
        "newmtl a\nmap_Kd wood.png\nmap_Kd gone.png\nbump -bm 0.5 bump.png\nmap_d a b.png\n"
        "map_Ks ..\\..\\secret.png\nmap_Ka C:\\textures\\x.png\n"
    )
    obj = model(tmp_path, "# x\n mtllib m.mtl\nmtllib gone.mtl\nv 0 0 0\n", "h.obj")
    assert set(sources.source_files(obj)) == {"h.obj", "m.mtl", "wood.png", "a b.png", "bump.png"}


def test_links_do_not_lead_out_of_the_folder(tmp_path: Path) -> None:
    (tmp_path / "secret").write_bytes(b"x")
    obj = model(tmp_path / "scene", "mtllib m.mtl\n", "h.obj")
    (tmp_path / "scene" / "m.mtl").symlink_to(tmp_path / "secret")
    assert list(sources.source_files(obj)) == ["h.obj"]


@pytest.mark.parametrize("name", ["x.png", "x", "x.glb.txt"])
def test_only_models_are_models(tmp_path: Path, name: str) -> None:
    with pytest.raises(SceneRefusedError, match=r"give one of \.glb"):
        sources.source_files(model(tmp_path, name=name))


def test_a_missing_or_broken_model(tmp_path: Path) -> None:
    with pytest.raises(SceneRefusedError, match="no model file"):
        sources.source_files(tmp_path / "x.glb")
    for text in ("{", "[1]", '{"buffers": 3}', "[" * 100_000):
        with pytest.raises(SceneRefusedError, match=r"x\.gltf is not a glTF file"):
            sources.source_files(model(tmp_path, text, "x.gltf"))


def test_the_id_is_that_of_the_content(tmp_path: Path) -> None:
    def identity(folder: str, text: str, mtl: str, name: str = "h.obj") -> str:
        path = model(tmp_path / folder, text, name)
        model(tmp_path / folder, mtl, "m.mtl")
        return sources.scene_id(sources.source_files(path))

    first = identity("a", "mtllib m.mtl\n", "newmtl a")
    assert identity("b", "mtllib m.mtl\n", "newmtl a", "renamed.obj") == first
    assert identity("c", "mtllib m.mtl\n", "newmtl b") != first
    assert identity("d", "mtllib m.mtl\n#", "newmtl a") != first
    stl, ply = model(tmp_path, "x", "a.stl"), model(tmp_path, "x", "a.ply")
    assert sources.scene_id({"a": stl}) == sources.scene_id({"a": ply})
    assert sources.scene_id({stl.name: stl}) != sources.scene_id({ply.name: ply})


def test_from_import_to_ready(store: Store, tmp_path: Path) -> None:
    obj = model(tmp_path, "fine\nmtllib m.mtl\n", "h.obj")
    model(tmp_path, "newmtl a", "m.mtl")
    scene = scenes.import_source(store, obj)
    assert scenes.import_source(store, obj) == scene
    assert scenes.scene_ids(store) == [scene]
    assert scenes.scene_state(store, scene) == scenes.SceneState(scene, "h", "uploaded")
    info = prepare_scene(store, scene, FAKE)
    assert (info.id, info.name, info.triangles) == (scene, "h", 2)  # both files were there
    assert scenes.scene_state(store, scene).state == "ready"
    assert prepare_scene(store, scene, ["/nonexistent"]) == info
    folder = scenes.prepared_folder(store, scene, tmp_path / "cache")
    assert (folder / "positions.npy").read_bytes() == b"numbers"
    assert scenes.prepared_folder(store, scene, tmp_path / "cache") == folder
    forget_scene(store, scene)
    assert list(store.list("")) == []
    with pytest.raises(NotFoundError):
        scenes.scene_state(store, scene)


def test_the_same_content_under_another_name_is_one_scene(store: Store, tmp_path: Path) -> None:
    one = scenes.import_source(store, model(tmp_path, name="one.stl"))
    assert scenes.import_source(store, model(tmp_path, name="two.stl")) == one
    assert scenes.scene_state(store, one).name == "one"


def test_refusal_is_remembered_and_leaves_nothing_half_done(store: Store, tmp_path: Path) -> None:
    scene = scenes.import_source(store, model(tmp_path, "refuse"))
    with pytest.raises(SceneRefusedError, match=r"^house\.stl is no model\.$"):
        prepare_scene(store, scene, FAKE)
    assert scenes.scene_state(store, scene) == scenes.SceneState(
        scene, "house", "refused", "house.stl is no model."
    )
    assert sorted(store.list("")) == [
        f"scenes/{scene}/refused.json",
        f"scenes/{scene}/source/house.stl",
    ]


def test_a_crash_is_a_refusal_with_the_last_words(store: Store, tmp_path: Path) -> None:
    scene = scenes.import_source(store, model(tmp_path, "crash"))
    with pytest.raises(SceneRefusedError, match="ended with code 9: out of memory"):
        prepare_scene(store, scene, FAKE)


def test_a_command_that_is_not_there_refuses_nothing(store: Store, tmp_path: Path) -> None:
    scene = scenes.import_source(store, model(tmp_path))
    with pytest.raises(FarfieldError, match="could not begin") as error:
        prepare_scene(store, scene, ["/nonexistent"])
    assert not isinstance(error.value, SceneRefusedError)
    assert scenes.scene_state(store, scene).state == "uploaded"


def test_preparation_can_be_stopped(store: Store, tmp_path: Path) -> None:
    scene = scenes.import_source(store, model(tmp_path, "hang"))
    stop = threading.Event()
    threading.Timer(0.5, stop.set).start()
    began = time.monotonic()
    with pytest.raises(FarfieldError, match="stopped"):
        prepare_scene(store, scene, FAKE, stop.is_set)
    assert time.monotonic() - began < 10
    assert scenes.scene_state(store, scene).state == "uploaded"
    assert list(store.list("")) == [f"scenes/{scene}/source/house.stl"]


def test_scenes_are_prepared_in_the_background(store: Store, tmp_path: Path) -> None:
    good = scenes.import_source(store, model(tmp_path, "fine"))
    bad = scenes.import_source(store, model(tmp_path, "refuse"))
    preparer = ScenePreparer(store, FAKE)
    try:
        preparer.submit(good)
        preparer.submit(bad)
        assert preparer.preparing(good)
        assert preparer.preparing(bad)
        assert preparer.wait(bad, timeout=30)
        assert preparer.wait(good, timeout=30)
    finally:
        preparer.close()
    assert scenes.scene_state(store, good).state == "ready"
    assert scenes.scene_state(store, bad).state == "refused"
    assert preparer.error(bad) is None


def test_a_failure_of_the_machine_is_no_refusal(store: Store, tmp_path: Path) -> None:
    scene = scenes.import_source(store, model(tmp_path))
    preparer = ScenePreparer(store, ["/nonexistent"])
    try:
        preparer.submit(scene)
        assert preparer.wait(scene, timeout=30)
        assert "could not begin" in str(preparer.error(scene))
    finally:
        preparer.close()


def test_closing_stops_what_is_being_prepared(store: Store, tmp_path: Path) -> None:
    scene = scenes.import_source(store, model(tmp_path, "hang"))
    preparer = ScenePreparer(store, FAKE)
    preparer.submit(scene)
    time.sleep(0.5)
    began = time.monotonic()
    preparer.close()
    assert time.monotonic() - began < 10
    assert scenes.scene_state(store, scene).state == "uploaded"


@pytest.mark.parametrize(
    ("act", "limits", "word"),
    [
        ("hang", PrepareLimits(wall_seconds=1), "more than 1 s, which"),
        ("spin", PrepareLimits(cpu_seconds=1), "1 s of processor time"),
    ],
)
def test_a_preparation_that_takes_too_long_refuses_the_scene(
    tmp_path: Path, act: str, limits: PrepareLimits, word: str
) -> None:
    store = Store.open(tmp_path / "store")
    scene = scenes.import_source(store, model(tmp_path, act))
    with pytest.raises(SceneRefusedError, match=word):
        prepare_scene(store, scene, FAKE, limits=limits)
    state = scenes.scene_state(store, scene)
    assert state.state == "refused"
    assert word in (state.reason or "")


def test_the_same_model_turned_is_another_scene(tmp_path: Path) -> None:
    store = Store.open(tmp_path / "store")
    scene = scenes.import_source(store, model(tmp_path, "fine"))
    tipped = scenes.Orientation(up="z", scale=0.01)
    turned = scenes.reorient(store, scene, tipped)
    assert turned != scene
    assert scenes.reorient(store, scene, tipped) == turned
    assert scenes.orientation(store, turned) == tipped
    assert scenes.orientation(store, scene) == scenes.Orientation()
    # from the turned one, relative to the model itself
    assert scenes.reorient(store, turned, scenes.Orientation()) == scene
    assert scenes.reorient(store, turned, tipped) == turned
    assert scenes.scene_state(store, turned).state == "uploaded"
    with pytest.raises(NotFoundError):
        scenes.reorient(store, "none", tipped)


def test_what_is_ours_is_linked_and_what_is_not_is_copied(tmp_path: Path) -> None:
    store = Store.open(tmp_path / "store")
    theirs, ours = model(tmp_path, "theirs"), model(tmp_path, "ours", name="ours.stl")
    for path, owned, links in ((theirs, False, 1), (ours, True, 2)):
        scene = scenes.import_source(store, path, owned=owned)
        kept = store.local_path(f"scenes/{scene}/source/{path.name}")
        assert kept is not None
        assert kept.stat().st_nlink == links
