"""What the API is told by its surroundings: environment variables, read once."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from farfield_core.errors import BadInputError
from pydantic import BaseModel, ConfigDict, Field, ValidationError

#: setting -> environment variable
VARIABLES = {
    "store": "FARFIELD_STORE",
    "broker": "FARFIELD_BROKER",
    "device": "FARFIELD_DEVICE",
    "web": "FARFIELD_WEB",
    "upload_limit": "FARFIELD_UPLOAD_LIMIT",
    "jobs": "FARFIELD_JOBS",
}

#: where the pages are built in a working copy
BUILT_WEB = Path(__file__).parents[3] / "web" / "app" / "dist"


class ApiSettings(BaseModel):
    """Settings of one API server."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    #: a folder or s3://bucket/prefix
    store: str = "farfield-store"
    #: redis://..., or empty: cells are baked by processes of this server
    broker: str = ""
    #: which workers of the farm bake: those that draw with a GPU, or all others
    device: Literal["cpu", "gpu"] = "cpu"
    #: folder of the built pages
    web: Path = BUILT_WEB
    #: greatest size of a file sent in one request, bytes
    upload_limit: int = Field(default=2 * 1024**3, gt=0)
    #: cells baked at the same time by this server; None: one a core
    jobs: int | None = Field(default=None, gt=0)

    @classmethod
    def from_environment(cls, environ: Mapping[str, str], **options: Any) -> ApiSettings:
        """Settings from `environ`, over which `options` that are not None win.

        Raises BadInputError naming the variable that cannot be used.
        """
        values: dict[str, Any] = {
            name: environ[variable] for name, variable in VARIABLES.items() if environ.get(variable)
        }
        values.update({name: value for name, value in options.items() if value is not None})
        try:
            return cls(**values)
        except ValidationError as error:
            first = error.errors()[0]
            name = str(first["loc"][0])
            raise BadInputError(
                f"{VARIABLES.get(name, name)} cannot be {first['input']!r}: {first['msg']}."
            ) from None
