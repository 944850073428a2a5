"""The JSON Schemas of the walk format, and documents checked against them (docs/format.md).

`validate` says whether a document has the right shape; `cell_faults` and `walk_faults` find what a
schema cannot say: columns of unequal length, indices that point nowhere, quads behind their eye.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import cache
from importlib.resources import files
from itertools import pairwise
from typing import Any, Literal, NoReturn

import numpy as np
from jsonschema import Draft202012Validator

from farfield_core.errors import BadInputError
from farfield_core.walk import CellFile, Walk

Kind = Literal["walk", "cell", "page", "object"]


@cache
def schema(kind: Kind) -> dict[str, Any]:
    """The JSON Schema of walk.json, a cell's file, a page of a large cell table, or an object."""
    if kind == "page":
        walk = schema("walk")
        return {"$schema": walk["$schema"], "$ref": "#/$defs/cells", "$defs": walk["$defs"]}
    text = files(__name__).joinpath(f"{kind}.schema.json").read_text(encoding="utf-8")
    return dict(json.loads(text))


@cache
def _validator(kind: Kind) -> Draft202012Validator:
    return Draft202012Validator(schema(kind))


def _no_such_number(name: str) -> NoReturn:
    raise ValueError(f"{name} is no number of JSON")


def load(data: bytes | str) -> Any:
    """Parse strict JSON: no NaN, no Infinity; raises BadInputError."""
    try:
        return json.loads(data, parse_constant=_no_such_number)
    except (ValueError, RecursionError) as error:
        raise BadInputError(f"This is not JSON: {error}.") from None


def validate(kind: Kind, document: Any) -> None:
    """Raise BadInputError with the first fault if `document` does not match its schema."""
    error = next(_validator(kind).iter_errors(document), None)
    if error is not None:
        place = ".".join(str(part) for part in error.absolute_path) or "document"
        raise BadInputError(
            f"The {kind} file does not keep its format at {place}: {error.message}."
        )


def walk_faults(walk: Walk) -> Iterator[str]:
    """What is wrong with a manifest beyond its shape, a sentence each."""
    if len(walk.layers) != len(walk.borders):
        yield "There are not as many borders as layers."
    far_to_near = [
        distance for pair in zip(walk.layers, walk.borders, strict=False) for distance in pair
    ]
    if any(far <= near for far, near in pairwise(far_to_near)):
        yield "Layers and borders do not alternate from far to near."
    if walk.borders and walk.near_field != walk.borders[-1]:
        yield "The near field is not the last border."
    table = walk.grid.cells
    if table is not None:
        if {len(table.i), len(table.j), len(table.k), len(table.y)} != {walk.grid.total}:
            yield "The columns of the cell table have not as many entries as there are cells."
    elif sum(page.cells for page in walk.grid.pages) != walk.grid.total:
        yield "The pages have not as many cells as there are in total."


def cell_faults(cell: CellFile, walk: Walk) -> Iterator[str]:
    """What is wrong with a cell's file beyond its shape, a sentence each."""
    quads = cell.quads
    count = len(quads.faces)
    corners = sum(quads.corner_counts)
    wanted = {
        "eyes": count,
        "layers": count,
        "corner_counts": count,
        "corners": 2 * corners,
        "planes": 3 * count,
        "pages": count,
        "scales": count,
        "offsets": 2 * count,
        "turned": count,
    }
    wrong = [name for name, length in wanted.items() if len(getattr(quads, name)) != length]
    if wrong:
        yield f"Columns of the wrong length: {', '.join(wrong)}."
        return
    if max(quads.eyes, default=0) >= len(cell.eyes):
        yield "A quad refers to an eye that is not there."
    if max(quads.layers, default=-1) >= len(walk.layers):
        yield "A quad refers to a layer that is not there."
    if max(quads.pages, default=-1) >= len(cell.atlases):
        yield "A quad refers to an atlas page that is not there."
    for block in cell.near:
        if len(block.ranges) % 3:
            yield f"The ranges of near block {block.blob} are no triples."
    yield from _corner_faults(cell, walk)


def _corner_faults(cell: CellFile, walk: Walk) -> Iterator[str]:
    """Corners outside their face, behind their eye or outside their page."""
    quads = cell.quads
    quad = np.repeat(np.arange(len(quads.faces)), quads.corner_counts)
    xy = np.array(quads.corners, np.float64).reshape(-1, 2)
    slack = 1e-6 * walk.resolution
    # filling and growing may reach a little over the edge of a face
    if (np.abs(2 * xy / walk.resolution - 1) > 1.5).any():
        yield "A corner lies far outside its face."
    uv = 2 * xy / walk.resolution - 1
    planes = np.array(quads.planes, np.float64).reshape(-1, 3)[quad]
    disparity = planes[:, 0] * uv[:, 0] + planes[:, 1] * uv[:, 1] + planes[:, 2]
    if (disparity < -1e-9).any():
        yield "A corner has a negative disparity."
    turned = np.array(quads.turned, bool)[quad]
    texel = np.where(turned[:, None], xy[:, ::-1], xy)
    texel = texel * np.array(quads.scales)[quad, None]
    texel = texel + np.array(quads.offsets, np.float64).reshape(-1, 2)[quad]
    if (texel < -slack).any() or (
        texel > np.array([walk.atlas.width, walk.atlas.height]) + slack
    ).any():
        yield "A corner lies outside its atlas page."
