"""The settings of a bake: one model for the command line, REST and walk.json."""

from __future__ import annotations

import hashlib
import json
from functools import lru_cache
from typing import Annotated, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from farfield_core import placement
from farfield_core.validation import WHOLE, Alike, Number

# Bounds far beyond any use, within which no sum of a placement over- or underflows.
Edge = Annotated[Number, Field(ge=1e-3, le=1e6)]
MAX_LAYERS = 4096


def _one_number_is_a_cube(value: object) -> object:
    return (value, value, value) if isinstance(value, int | float) else value


_Edges = Annotated[tuple[Edge, Edge, Edge], Alike()]
Size = Annotated[
    _Edges, BeforeValidator(_one_number_is_a_cube, json_schema_input_type=Edge | _Edges)
]


class Budget(BaseModel):
    """What a cell may come to at most; what is left out has no limit."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        json_schema_extra={
            "anyOf": [
                {"required": [name], "properties": {name: {"type": "number"}}}
                for name in ("triangles", "megabytes")
            ]
        },
    )

    triangles: Annotated[int, Field(ge=1), WHOLE] | None = Field(
        default=None, description="near triangles of a cell"
    )
    megabytes: Annotated[Number, Field(ge=1e-3, le=1e9)] | None = Field(
        default=None, description="atlas pages and file of a cell, 10^6 bytes"
    )

    @model_validator(mode="after")
    def _has_a_limit(self) -> Budget:
        if self.triangles is None and self.megabytes is None:
            raise ValueError("a budget needs triangles, megabytes or both")
        return self


class BakeSettings(BaseModel):
    """What a bake may be asked for; REST names are the options with underscores."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    quads: Literal["slanted", "layers"] = Field(
        default="slanted",
        description="kind of impostor quads: planes of any slant, or the paper's layers",
    )
    cell_size: Size = Field(
        default=(10.0, 10.0, 10.0),
        description="edge lengths of a view cell, metres; one number means a cube",
    )
    layers: Annotated[int, Field(ge=1, le=MAX_LAYERS), WHOLE] = Field(
        default=64,
        description="number of layers; slanted quads get the near field that so many layers have",
    )
    near: Annotated[Number, Field(gt=0, le=1e9)] | None = Field(
        default=None,
        description="half width of the near field, metres; with layers it chooses their number, "
        "without it the near field is the one that `layers` layers have, or, for slanted quads "
        "without layers, the one estimated to cost least",
    )
    budget: Budget | None = Field(
        default=None,
        description="what a cell may come to at most, triangles=N,megabytes=M or one of them; cell "
        "size and near border are then chosen so that every cell keeps it",
    )
    alpha: Annotated[Number, Field(ge=1e-6, lt=0.7853)] | None = Field(
        default=None,
        description="parallax bound, radians; by default the central pixel of a 60 degree image "
        "of as many pixels as a face has texels",
    )
    gap_texels: Annotated[Number, Field(ge=1e-3, le=1e6)] | None = Field(
        default=1.0,
        description="how many texels two neighbouring layers may shift by; none means no bound",
    )
    gap_fill: Literal["paper", "steep"] = Field(
        default="steep",
        description="gaps to fill: those between neighbouring layers only, as the paper does, or "
        "those where a steep surface skips layers too",
    )
    tolerance: Annotated[Number, Field(gt=0, le=1)] = Field(
        default=0.68, description="share of the parallax bound that slanted quads use"
    )
    resolution: Annotated[int, Field(ge=16, le=4096), WHOLE] = Field(
        default=512, description="texels across a face"
    )
    faces: Literal["auto", "sides", "all"] = Field(
        default="auto",
        description="which faces are baked; auto: those through which far geometry shows",
    )
    grower: Literal["greedy", "best"] = Field(
        default="best", description="how texels are gathered into quads"
    )
    visibility: Literal["on", "off", "fast", "careful"] = Field(
        default="on",
        description="leave out what no eye in the cell can see; fast and careful sample fewer and "
        "more eyes",
    )
    encoder: Literal["png", "webp"] = Field(default="png", description="format of atlas pages")
    supersample: Annotated[int, Field(ge=1, le=4), WHOLE] = Field(
        default=1, description="samples per texel and axis while rendering"
    )
    renderer: Literal["moderngl", "pyrender"] = Field(
        default="moderngl", description="what draws the layers"
    )

    @model_validator(mode="after")
    def _near_outside_cell(self) -> BakeSettings:
        if self.near is not None and self.near <= max(self.cell_size) / 2:
            raise ValueError(
                f"near {self.near:g} lies inside the cell; "
                f"use more than {max(self.cell_size) / 2:g}"
            )
        return self

    @model_validator(mode="after")
    def _only_for_layers(self) -> BakeSettings:
        if self.quads == "slanted":
            for name, value, default in (
                ("grower", self.grower, "best"),
                ("supersample", self.supersample, 1),
                ("renderer", self.renderer, "moderngl"),
            ):
                if value != default:
                    raise ValueError(
                        f"{name} {value} is for layers; choose layers for quads, or leave it out"
                    )
        return self

    @property
    def half_extents(self) -> tuple[float, float, float]:
        """Half the cell's edge lengths, metres."""
        x, y, z = self.cell_size
        return (x / 2, y / 2, z / 2)

    @property
    def parallax(self) -> float:
        """The parallax bound in force, radians."""
        return placement.default_alpha(self.resolution) if self.alpha is None else self.alpha

    def place(self) -> placement.Placement:
        """Layers and borders of every cell under these settings."""
        return _place(
            self.half_extents, self.resolution, self.layers, self.near, self.alpha, self.gap_texels
        )

    @property
    def near_field(self) -> float:
        """Half width of the near field, metres."""
        if self.quads == "slanted" and self.near is not None:
            return self.near
        return self.place().near_field

    @property
    def layers_alike(self) -> float:
        """Number of layers, or for slanted quads as many as would have their near field."""
        if self.near is None:
            return self.layers
        if self.quads == "layers":
            return len(self.place().layers)
        return placement.layers_across(
            self.near, self.half_extents, self.resolution, self.alpha, self.gap_texels
        )

    def key(self) -> str:
        """Hash of the settings that change what a bake contains."""
        text = json.dumps(self.model_dump(mode="json"), sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]


@lru_cache(maxsize=256)
def _place(
    half: tuple[float, float, float],
    resolution: int,
    layers: int,
    near: float | None,
    alpha: float | None,
    gap_texels: float | None,
) -> placement.Placement:
    if near is not None:
        layers = placement.layers_for_near(near, half, resolution, alpha, gap_texels)
    return placement.place(half, resolution, layers, alpha, gap_texels)
