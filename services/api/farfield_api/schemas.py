"""Bodies of requests and answers, with examples for OpenAPI."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Literal

from farfield_core.corridor import Corridor
from farfield_core.scene import Bounds, MapView, Suspicion
from farfield_core.scenes import Orientation
from farfield_core.settings import BakeSettings
from farfield_core.validation import WHOLE, Alike, Number
from pydantic import BaseModel, ConfigDict, Field

from farfield_api.keys import KeyScope
from farfield_api.names import IS_ID

SCENE = "3f1c9a52d07be846"
CORRIDOR = "9b0f6c1de2a34875"
BAKE = "c4d07e9a1b5f3286"
UPLOAD = "0d8f5e1b6c7a4932b1f0e9d8c7b6a594"

BOX: dict[str, Any] = {"box": {"min": [-20.0, 0.0, -5.0], "max": [20.0, 4.0, 5.0]}}
PATH: dict[str, Any] = {
    "path": {"points": [[0.0, 0.0, 0.0], [40.0, 0.0, 0.0]], "width": 4.0, "height": 3.0}
}
ASKED: dict[str, Any] = {
    "scene": SCENE,
    "corridor": PATH,
    "settings": {"cell_size": 10, "layers": 64, "resolution": 512},
}


class SceneBody(BaseModel):
    """A scene, and how far it has come."""

    id: str = Field(examples=[SCENE])
    name: str = Field(examples=["town"])
    state: Literal["preparing", "ready", "refused"]
    #: why it was refused
    reason: str | None = None
    bounds: Bounds | None = None
    triangles: int | None = Field(default=None, examples=[2_015_444])
    textures: int | None = Field(default=None, examples=[12])
    #: what was left out or guessed while reading
    notes: tuple[str, ...] = ()
    #: how the model is turned and scaled, as somebody has said
    orientation: Orientation = Orientation()
    #: how it seems to be meant, where that is different
    suspected: Suspicion | None = None
    #: the top view at `map.png`; absent where the machine that prepared the scene cannot draw
    map: MapView | None = None


class SceneList(BaseModel):
    """A page of scenes."""

    scenes: list[SceneBody]
    #: the `cursor` to ask for next; null on the last page
    next: str | None = None


class SuggestionBody(BaseModel):
    """A corridor to begin with."""

    corridor: Corridor
    #: edge length of its cells, metres
    cell_size: float = Field(examples=[10.0])
    #: height of a walker's eye, metres
    eye_height: float = Field(examples=[1.7])


class UploadBody(BaseModel):
    """An upload, and what has become of it."""

    id: str = Field(examples=[UPLOAD])
    name: str = Field(examples=["town.glb"])
    length: int = Field(examples=[153_000_000])
    #: bytes that have arrived
    offset: int = Field(examples=[153_000_000])
    state: Literal["receiving", "importing", "done", "refused"]
    #: the scene that was made of it
    scene: str | None = Field(default=None, examples=[SCENE])
    #: why none was
    reason: str | None = None


class KeyRequest(BaseModel):
    """A key to make."""

    model_config = ConfigDict(extra="forbid")

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$", examples=["render-box"])
    scope: KeyScope = Field(examples=["write"])


class Rotation(BaseModel):
    """How long a key works beside its successor."""

    model_config = ConfigDict(extra="forbid")

    overlap_hours: Number = Field(default=24.0, ge=0, le=24 * 90, examples=[24.0])


class KeyBody(BaseModel):
    """A key, but for itself."""

    id: str = Field(examples=["5b2f9c3a7d10e864"])
    name: str = Field(examples=["render-box"])
    scope: KeyScope
    created: datetime
    #: when it ceases to work; null: never
    expires: datetime | None = None


class NewKey(KeyBody):
    """A key that was just made."""

    #: the key itself; it is told once and kept nowhere
    key: str = Field(examples=["farfield_vJ8Q..."])


class KeyList(BaseModel):
    """All keys."""

    keys: list[KeyBody]


class Session(BaseModel):
    """A key for the pages of this server."""

    model_config = ConfigDict(extra="forbid")

    key: str = Field(pattern=r"^[!-~]{1,200}$", examples=["farfield_vJ8Q..."])


class NewScene(BaseModel):
    """A scene that has arrived."""

    id: str = Field(examples=[SCENE])
    state: Literal["preparing", "ready", "refused"]


class NewCorridor(BaseModel):
    """A corridor that was kept."""

    id: str = Field(examples=[CORRIDOR])
    #: view cells of the default size along it
    cells: int = Field(examples=[42])


class BakeRequest(BaseModel):
    """What to bake, or to plan."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"examples": [ASKED]})

    scene: str = Field(pattern=IS_ID.pattern)
    #: a corridor file's content, or the id of one sent before
    corridor: Corridor | Annotated[str, Field(pattern=r"^[0-9a-f]{16}$")]
    settings: BakeSettings = BakeSettings()
    #: a bake of the scene before it was edited: cells are reused where the edit cannot be seen
    follows: Annotated[str, Field(pattern=r"^[0-9a-f]{16}$")] | None = None


class NewBake(BaseModel):
    """A bake that was asked for."""

    id: str = Field(examples=[BAKE])


class CellCounts(BaseModel):
    """How many cells there are, exist, and cannot be baked."""

    total: int = Field(examples=[42])
    done: int = Field(examples=[17])
    failed: int = Field(examples=[0])


class FailedCell(BaseModel):
    """A cell that cannot be baked, and why."""

    cell: str = Field(examples=["0_0_3"])
    reason: str


State = Literal["queued", "running", "paused", "cancelled", "done", "failed"]


class BakeBody(BaseModel):
    """A bake, and how far it has come."""

    id: str = Field(examples=[BAKE])
    name: str = Field(examples=["town"])
    scene: str = Field(examples=[SCENE])
    state: State
    #: why the bake as a whole cannot go on
    reason: str | None = None
    cells: CellCounts
    #: cells baked a second, over the last minute; null where none was
    rate: float | None = Field(default=None, examples=[1.7])
    #: seconds until all cells exist at that rate
    seconds_left: float | None = Field(default=None, examples=[14.7])
    failures: list[FailedCell] = []


class BakeList(BaseModel):
    """A page of bakes."""

    bakes: list[BakeBody]
    #: the `cursor` to ask for next; null on the last page
    next: str | None = None


#: no cell's name has more digits
CellStep = Annotated[int, Field(ge=-999_999_999, le=999_999_999), WHOLE]


class Focus(BaseModel):
    """Where a walker stands."""

    model_config = ConfigDict(extra="forbid")

    cell: Annotated[tuple[CellStep, CellStep, CellStep], Alike()] = Field(examples=[[0, 0, 3]])


class CellNames(BaseModel):
    """A page of the cells that exist."""

    cells: list[str] = Field(examples=[["0_0_0", "0_0_1"]])
    #: the `page` to ask for next; null on the last page
    next: str | None = Field(examples=["1000"])
