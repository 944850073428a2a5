"""object.json: one object as height fields (docs/format.md, "Object files")."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from farfield_core.scene import Triple
from farfield_core.validation import WHOLE
from farfield_core.walk import Count, StrictModel, Text

VERSION: Literal[1] = 1

Axis = Annotated[int, Field(ge=0, le=2)]
Share = Annotated[float, Field(ge=0)]


class ObjectFile(StrictModel):
    """An object file.

    Attributes:
        low, high: its box in the object's own space, metres.
        axes: which axis of the box texture x, texture y and height run along.
        resolution: texels across a height field.
        textures: height textures, of two slabs each.
        image: name of the picture beside the file.
        silhouette: share of the outline's pixels that are more than a pixel off.
        error: 95 % of the outline is nearer to the mesh's than this, metres.
        holes: share of the pixels inside of the outline that are not covered.
        closed: by how much gaps were filled, as a share of all that is solid.
    """

    format: Literal["farfield-object"] = "farfield-object"
    version: Annotated[Literal[1], WHOLE] = VERSION
    name: str
    low: Triple
    high: Triple
    axes: tuple[Axis, Axis, Axis]
    resolution: Annotated[int, Field(ge=2, le=4096)]
    textures: Annotated[int, Field(ge=1, le=8)]
    image: Annotated[Text, Field(pattern=r"^[0-9A-Za-z._-]+$")]
    triangles: Count
    silhouette: Share
    error: Share
    holes: Share
    closed: Share


def object_faults(file: ObjectFile) -> Iterator[str]:
    """What is wrong with an object file beyond its shape, a sentence each."""
    if sorted(file.axes) != [0, 1, 2]:
        yield "The axes of an object are not x, y and z in some order."
    if any(low >= high for low, high in zip(file.low, file.high, strict=True)):
        yield "The box of an object is empty."
