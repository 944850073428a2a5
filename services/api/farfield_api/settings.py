"""What the API is told by its surroundings: environment variables, read once."""

from __future__ import annotations

import ipaddress
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from farfield_core.dispatch.prepare import CPU_SECONDS, WALL_SECONDS, PrepareLimits, most_memory_mb
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
    "host": "FARFIELD_HOST",
    "base_url": "FARFIELD_BASE_URL",
    "cors": "FARFIELD_CORS",
    "uploads": "FARFIELD_UPLOADS",
    "resumable_limit": "FARFIELD_RESUMABLE_LIMIT",
    "upload_hours": "FARFIELD_UPLOAD_HOURS",
    "prepare_memory_mb": "FARFIELD_PREPARE_MEMORY_MB",
    "prepare_cpu_seconds": "FARFIELD_PREPARE_CPU_SECONDS",
    "prepare_seconds": "FARFIELD_PREPARE_SECONDS",
    "auth": "FARFIELD_AUTH",
    "api_keys": "FARFIELD_API_KEYS",
    "rate": "FARFIELD_RATE",
    "quota_bytes": "FARFIELD_QUOTA_BYTES",
    "quota_cells": "FARFIELD_QUOTA_CELLS",
    "traces": "FARFIELD_TRACES",
    "logs": "FARFIELD_LOGS",
}

#: where the pages are built in a working copy
BUILT_WEB = Path(__file__).parents[3] / "web" / "app" / "dist"


def is_loopback(host: str) -> bool:
    """Whether only programs of this machine can reach a server that listens there."""
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return host == "localhost"


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
    #: address that the server listens on
    host: str = "127.0.0.1"
    #: where clients find the server, such as https://farfield.example/; empty: links are relative
    base_url: str = Field(default="", pattern=r"^(https?://[^\s?#]+)?$")
    #: origins whose pages may call the API, separated by commas; * for all
    cors: str = ""
    #: folder of uploads under way; empty: in the store, or the system's temporary folder
    uploads: str = ""
    #: greatest size of a resumable upload, bytes
    resumable_limit: int = Field(default=20 * 1024**3, gt=0)
    #: hours after which an upload that does not go on is forgotten
    upload_hours: float = Field(default=24.0, gt=0)
    #: memory of a process that prepares a scene, 2**20 bytes; 0: no limit, None: 3/4 of all
    prepare_memory_mb: int | None = Field(default=None, ge=0)
    #: its processor time and its time by the clock, seconds; 0: no limit
    prepare_cpu_seconds: int = Field(default=CPU_SECONDS, ge=0)
    prepare_seconds: int = Field(default=WALL_SECONDS, ge=0)
    #: whether keys are asked for; auto: unless the server listens on loopback
    auth: Literal["auto", "on", "off"] = "auto"
    #: keys besides those in the store: name:scope:sha256 of the key, separated by commas
    api_keys: str = ""
    #: requests a minute that change something, for each key; 0: no limit
    rate: int = Field(default=600, ge=0)
    #: bytes that the uploads of one key may come to; 0: no limit
    quota_bytes: int = Field(default=0, ge=0)
    #: cells of one bake; 0: no limit
    quota_cells: int = Field(default=0, ge=0)
    #: where OpenTelemetry traces go (OTLP over HTTP); empty: nowhere
    traces: str = ""
    #: lines of the log
    logs: Literal["text", "json"] = "text"

    @property
    def needs_keys(self) -> bool:
        """Whether clients have to show a key."""
        return self.auth == "on" or (self.auth == "auto" and not is_loopback(self.host))

    @property
    def origins(self) -> list[str]:
        """Origins whose pages may call the API."""
        return [origin.strip() for origin in self.cors.split(",") if origin.strip()]

    @property
    def prepare_limits(self) -> PrepareLimits:
        """What preparing a scene may cost."""
        memory = self.prepare_memory_mb
        if memory is None:
            memory = most_memory_mb()
        return PrepareLimits(memory, self.prepare_cpu_seconds, self.prepare_seconds)

    def link(self, path: str) -> str:
        """Address of a path below the server's root, as clients find it."""
        return f"{self.base_url.rstrip('/')}{path}"

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
