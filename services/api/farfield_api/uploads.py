"""Uploads that may be broken off and go on: files that grow, and what is to become of them.

    <folder>/<id>.json   what was said of an upload when it began; how it ended
    <folder>/<id>.part   its bytes so far: its size is the offset

Whoever reads the folder after a crash knows as much as before. A complete upload is taken into the
store by one thread in the background, because hashing gigabytes takes longer than a request should.
"""

from __future__ import annotations

import contextlib
import logging
import os
import queue
import secrets
import shutil
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO, Literal

from farfield_core.errors import FarfieldError, NotFoundError
from farfield_core.validation import parse
from pydantic import BaseModel, ConfigDict

from farfield_api.exceptions import NoSpaceError, UploadGoneError
from farfield_api.scenes import Scenes, check_name

log = logging.getLogger(__name__)

#: bytes of a disk that uploads leave free
_SPARE = 1 << 30


class Upload(BaseModel):
    """What is known of an upload besides its bytes."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    id: str
    name: str
    length: int
    #: tus metadata as it was sent
    metadata: str = ""
    #: name of the key that sends it
    owner: str = ""
    scene: str | None = None
    reason: str | None = None


State = Literal["receiving", "importing", "done", "refused"]


class Uploads:
    """All uploads of one server.

    Args:
        folder: where they grow; best on the disk of the store, which then only links them.
        scenes: takes what is complete.
        lifetime: seconds after which an upload that does not go on is forgotten.
        quota: bytes that the uploads of one owner may come to, 0 for any.
    """

    def __init__(self, folder: Path, scenes: Scenes, lifetime: float, quota: int = 0) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        self._scenes = scenes
        self._lifetime = lifetime
        self._quota = quota
        self._lock = threading.Lock()
        self._busy: set[str] = set()
        self._complete: queue.Queue[str | None] = queue.Queue()
        self._importer = threading.Thread(target=self._import, name="farfield-import", daemon=True)
        self._importer.start()

    def create(self, name: str, length: int, metadata: str, owner: str) -> Upload:
        """Begin an upload; raises SceneRefusedError for a name of no model, NoSpaceError."""
        check_name(name)
        self.sweep()
        with self._lock:
            self._check_space(length, owner)
            upload = Upload(
                id=secrets.token_hex(16), name=name, length=length, metadata=metadata, owner=owner
            )
            self._part(upload.id).touch()
            self._write(upload)
        if length == 0:
            self._complete.put(upload.id)
        return upload

    def get(self, identity: str) -> Upload:
        """An upload; raises NotFoundError, and UploadGoneError after its lifetime."""
        try:
            data = (self.folder / f"{identity}.json").read_bytes()
        except FileNotFoundError:
            raise NotFoundError(
                f"There is no upload {identity}; POST /api/v1/uploads begins one."
            ) from None
        upload = parse(Upload, data, f"The upload {identity}")
        if self.expires(upload) < time.time():
            raise UploadGoneError(f"Upload {identity} took too long and is gone; begin anew.")
        return upload

    def offset(self, upload: Upload) -> int:
        """Bytes that have arrived."""
        try:
            return self._part(upload.id).stat().st_size
        except FileNotFoundError:
            return upload.length

    def expires(self, upload: Upload) -> float:
        """When it is forgotten unless it goes on, seconds since 1970."""
        path = self._part(upload.id)
        with contextlib.suppress(FileNotFoundError):
            return path.stat().st_mtime + self._lifetime
        with contextlib.suppress(FileNotFoundError):
            return (self.folder / f"{upload.id}.json").stat().st_mtime + self._lifetime
        return 0.0

    def state(self, upload: Upload) -> State:
        """How far it has come."""
        if upload.reason is not None:
            return "refused"
        if upload.scene is not None:
            return "done"
        return "receiving" if self.offset(upload) < upload.length else "importing"

    def hold(self, upload: Upload) -> Callable[[], None] | None:
        """Become the only one to write to an upload; returns how to let go, None if it is held."""
        with self._lock:
            if upload.id in self._busy:
                return None
            self._busy.add(upload.id)

        def release() -> None:
            with self._lock:
                self._busy.discard(upload.id)

        return release

    def open(self, upload: Upload) -> BinaryIO:
        """Its bytes, to be added to by whoever holds it; raises NotFoundError if complete."""
        try:
            return self._part(upload.id).open("r+b", buffering=0)
        except FileNotFoundError:
            raise NotFoundError(f"Upload {upload.id} is complete; nothing can be added.") from None

    def completed(self, upload: Upload) -> None:
        """All its bytes are there: have it taken into the store."""
        self._complete.put(upload.id)

    def delete(self, upload: Upload) -> None:
        """Forget an upload; a scene that was made of it stays."""
        self._part(upload.id).unlink(missing_ok=True)
        (self.folder / f"{upload.id}.json").unlink(missing_ok=True)

    def sweep(self) -> None:
        """Forget all that did not go on for too long."""
        for path in self.folder.glob("*.json"):
            try:
                self.get(path.stem)
            except UploadGoneError:
                path.with_suffix(".part").unlink(missing_ok=True)
                path.unlink(missing_ok=True)
            except FarfieldError:
                continue

    def take_up(self) -> None:
        """Go on with what was complete when the server before this one stopped."""
        for folder in self.folder.glob("*.taking"):
            for file in folder.iterdir():
                if file.is_file():
                    file.replace(folder.with_suffix(".part"))
            shutil.rmtree(folder, ignore_errors=True)
        self.sweep()
        for path in self.folder.glob("*.json"):
            with contextlib.suppress(FarfieldError):
                upload = self.get(path.stem)
                if self.state(upload) == "importing":
                    self._complete.put(upload.id)

    def close(self) -> None:
        """Take nothing more into the store."""
        self._complete.put(None)
        self._importer.join()

    def _part(self, identity: str) -> Path:
        return self.folder / f"{identity}.part"

    def _write(self, upload: Upload) -> None:
        path = self.folder / f"{upload.id}.json"
        part = path.with_suffix(".json.new")
        part.write_text(upload.model_dump_json(), encoding="utf-8")
        part.replace(path)

    def _check_space(self, length: int, owner: str) -> None:
        promised = 0
        owned = 0
        for path in self.folder.glob("*.json"):
            with contextlib.suppress(FarfieldError):
                other = self.get(path.stem)
                promised += max(0, other.length - self.offset(other))
                owned += other.length if other.owner == owner else 0
        if self._quota and owned + length > self._quota:
            raise NoSpaceError(
                f"This key's uploads would come to {owned + length} bytes, more than its "
                f"{self._quota}; wait until earlier ones are forgotten."
            )
        free = shutil.disk_usage(self.folder).free
        if length + promised + _SPARE > free:
            raise NoSpaceError(
                f"The server's disk has no room for {length} bytes more; ask whoever runs it."
            )

    def _import(self) -> None:
        while (identity := self._complete.get()) is not None:
            try:
                upload = self.get(identity)
                if self.state(upload) == "importing":
                    self._take(upload)
            except Exception:
                log.exception("upload %s could not be taken", identity)

    def _take(self, upload: Upload) -> None:
        folder = self.folder / f"{upload.id}.taking"
        folder.mkdir(exist_ok=True)
        file = folder / check_name(upload.name)
        part = self._part(upload.id)
        try:
            part.replace(file)
            scene = self._scenes.take(file)
            upload = upload.model_copy(update={"scene": scene})
        except FarfieldError as error:
            upload = upload.model_copy(update={"reason": str(error)})
        except OSError as error:
            why = f"The upload could not be kept: {error.strerror or error}; send it again."
            upload = upload.model_copy(update={"reason": why})
        self._write(upload)
        shutil.rmtree(folder, ignore_errors=True)


def sync(file: BinaryIO) -> None:
    """Have the disk keep what was written."""
    os.fdatasync(file.fileno())
