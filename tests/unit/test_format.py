"""The JSON Schemas, the pydantic models and the documented examples say the same."""

import copy
import json
from pathlib import Path
from typing import Any

import pytest
from farfield_core import format as walk_format
from farfield_core.errors import BadInputError
from farfield_core.object_file import ObjectFile, object_faults
from farfield_core.walk import CellFile, CellTable, Walk
from farfield_shading import default_light
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel, ValidationError

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"
MODELS: dict[walk_format.Kind, type[BaseModel]] = {
    "walk": Walk,
    "cell": CellFile,
    "page": CellTable,
    "object": ObjectFile,
}
FILES: dict[walk_format.Kind, str] = {
    "walk": "walk.json",
    "cell": "cells/0_0_0.json",
    "page": "pages/0.json",
    "object": "object.json",
}


def example(kind: walk_format.Kind) -> Any:
    return json.loads((EXAMPLES / FILES[kind]).read_text(encoding="utf-8"))


def schema_accepts(kind: walk_format.Kind, document: Any) -> bool:
    try:
        walk_format.validate(kind, document)
    except BadInputError:
        return False
    return True


def model_accepts(kind: walk_format.Kind, document: Any) -> bool:
    try:
        MODELS[kind].model_validate_json(json.dumps(document), strict=True)
    except ValidationError:
        return False
    return True


def paths(document: Any, at: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """All places in a document, its root left out."""
    children: list[Any] = []
    if isinstance(document, dict):
        children = list(document)
    elif isinstance(document, list):
        children = list(range(len(document)))
    found = []
    for child in children:
        found += [(*at, child), *paths(document[child], (*at, child))]
    return found


# 1.0 is an integer to JSON Schema and none to pydantic; no writer of ours makes one
NUMBERS = st.integers(-10, 5000) | st.floats(-1e6, 1e6).filter(lambda x: not x.is_integer())
VALUES = st.recursive(
    st.none() | st.booleans() | NUMBERS | st.text(max_size=3) | st.sampled_from(["a/", "png"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner),
    max_leaves=4,
)


@pytest.mark.parametrize("kind", MODELS)
def test_examples_are_accepted(kind: walk_format.Kind) -> None:
    assert schema_accepts(kind, example(kind))
    assert model_accepts(kind, example(kind))


def test_examples_have_no_faults() -> None:
    walk, cell = Walk.model_validate(example("walk")), CellFile.model_validate(example("cell"))
    assert list(walk_format.walk_faults(walk)) == []
    assert list(walk_format.cell_faults(cell, walk)) == []
    assert set(walk.light) == set(default_light())


@pytest.mark.parametrize("kind", MODELS)
def test_true_is_no_version(kind: walk_format.Kind) -> None:
    document = example(kind)
    if "version" in document:
        document = {**document, "version": True}
        assert not schema_accepts(kind, document)
        assert not model_accepts(kind, document)


@pytest.mark.parametrize("kind", MODELS)
@given(data=st.data())
def test_schema_and_model_agree_on_damaged_documents(
    kind: walk_format.Kind, data: st.DataObject
) -> None:
    document = copy.deepcopy(example(kind))
    for _ in range(data.draw(st.integers(1, 2), label="damages")):
        path = data.draw(st.sampled_from(paths(document) or [("x",)]), label="path")
        parent = document
        for step in path[:-1]:
            parent = parent[step]
        how = data.draw(st.sampled_from(["replace", "remove", "add"]), label="how")
        if how == "remove" and path[-1] in parent if isinstance(parent, dict) else how == "remove":
            del parent[path[-1]]
        elif how == "add" and isinstance(parent, dict):
            parent["surplus"] = data.draw(VALUES, label="surplus")
        elif how == "add":
            parent.append(data.draw(VALUES, label="appended"))
        else:
            parent[path[-1]] = data.draw(VALUES, label="value")
    assert schema_accepts(kind, document) == model_accepts(kind, document)


@pytest.mark.parametrize("kind", MODELS)
def test_every_member_is_required(kind: walk_format.Kind) -> None:
    for path in paths(example(kind)):
        document = example(kind)
        parent = document
        for step in path[:-1]:
            parent = parent[step]
        if isinstance(parent, dict) and path[0] not in ("settings", "light", "figures"):
            del parent[path[-1]]
            assert not schema_accepts(kind, document), path
            assert not model_accepts(kind, document), path


def test_a_paged_grid() -> None:
    document = example("walk")
    page = {"href": "pages/0.json", "cells": 2, "bounds": document["scene"]["bounds"]}
    for cells, pages, good in [
        (None, [page], True),
        (None, [], False),
        (document["grid"]["cells"], [page], False),
        (document["grid"]["cells"], [], True),
    ]:
        document["grid"] |= {"cells": cells, "pages": pages}
        assert schema_accepts("walk", document) == good
        assert model_accepts("walk", document) == good


@pytest.mark.parametrize("text", ['{"a": NaN}', '{"a": Infinity}', "{", "", "[" * 100_000])
def test_only_strict_json_is_read(text: str) -> None:
    with pytest.raises(BadInputError):
        walk_format.load(text)


def change(model: Any, path: str, value: Any) -> Any:
    document = model.model_dump(mode="json")
    parent = document
    *steps, last = path.split(".")
    for step in steps:
        parent = parent[int(step) if step.isdigit() else step]
    parent[int(last) if last.isdigit() else last] = value
    return type(model).model_validate_json(json.dumps(document))


@pytest.mark.parametrize(
    ("path", "value", "fault"),
    [
        ("quads.layers", [0], "Columns of the wrong length: layers."),
        ("quads.eyes.0", 7, "A quad refers to an eye that is not there."),
        ("quads.layers.0", 99, "A quad refers to a layer that is not there."),
        ("quads.pages.1", 9, "A quad refers to an atlas page that is not there."),
        ("quads.planes.2", -1, "A corner has a negative disparity."),
        ("quads.corners.0", -4000, "A corner lies far outside its face."),
        ("quads.offsets.0", 5000, "A corner lies outside its atlas page."),
        ("near.0.ranges", [1, 2], "are no triples."),
    ],
)
def test_faults_of_cells_are_found(path: str, value: Any, fault: str) -> None:
    walk = Walk.model_validate(example("walk"))
    cell = change(CellFile.model_validate(example("cell")), path, value)
    assert any(found.endswith(fault) for found in walk_format.cell_faults(cell, walk))


@pytest.mark.parametrize(
    ("path", "value", "fault"),
    [
        ("layers", [100.0], "There are not as many borders as layers."),
        ("layers.0", 0.5, "Layers and borders do not alternate from far to near."),
        ("near_field", 1.0, "The near field is not the last border."),
        ("grid.total", 7, "The columns of the cell table have not"),
    ],
)
def test_faults_of_walks_are_found(path: str, value: Any, fault: str) -> None:
    walk = change(Walk.model_validate(example("walk")), path, value)
    assert any(found.startswith(fault) for found in walk_format.walk_faults(walk))


@pytest.mark.parametrize(
    ("path", "value", "fault"),
    [
        ("axes", [0, 0, 2], "The axes of an object are not x, y and z in some order."),
        ("high.1", -50.0, "The box of an object is empty."),
    ],
)
def test_faults_of_objects_are_found(path: str, value: Any, fault: str) -> None:
    file = ObjectFile.model_validate(example("object"))
    assert list(object_faults(file)) == []
    assert list(object_faults(change(file, path, value))) == [fault]
