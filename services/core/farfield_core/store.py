"""Where everything is kept: a folder, memory or S3, behind one small class.

Objects are immutable and made create-only, the one primitive that folders, memory and S3 share
(compare-and-swap and attributes do not exist on folders, so nothing here needs them).
A write shows up whole or not at all.
"""

from __future__ import annotations

import re
import secrets
import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from datetime import timedelta
from pathlib import Path, PurePosixPath
from typing import Any

import obstore
from obstore import exceptions
from obstore.store import LocalStore, MemoryStore, ObjectStore, S3Store

from farfield_core.errors import BadInputError, FarfieldError, NotFoundError
from farfield_core.s3 import repeated, s3_clients

_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*://")
# obstore keeps names ending in '#<number>' for its own unfinished files
_BAD_SEGMENT = re.compile(r"^\.{0,2}$|[\x00-\x1f\x7f\\]|#\d+$")


class StoreError(FarfieldError):
    """The store did not do what was asked: no permission, no space, no connection."""

    exit_code = 7


def check_key(key: str) -> str:
    """Return `key` if it is a plain relative path; raises BadInputError."""
    if any(_BAD_SEGMENT.search(segment) for segment in key.split("/")):
        raise BadInputError(f"{key!r} is not a valid name in a store.")
    return key


@contextmanager
def _mapped(what: str) -> Iterator[None]:
    """Turn obstore's errors about `what` into ours."""
    try:
        yield
    except FileNotFoundError:  # also raised by obstore itself, as a built-in
        raise NotFoundError(f"There is no {what} in the store.") from None
    except exceptions.NotFoundError:
        raise NotFoundError(f"There is no {what} in the store.") from None
    except (exceptions.BaseError, OSError) as error:
        reason = str(error).split("\n", 1)[0].rstrip(".: ")
        raise StoreError(f"The store failed on {what}: {reason}.") from error


class Store:
    """Keys are relative paths with forward slashes (`farfield_core.layout` builds them).

    Attributes:
        url: what `Store.open` needs to open the same store again, in this or another process
            (a memory store cannot be opened twice).
    """

    def __init__(
        self,
        objects: ObjectStore,
        url: str,
        root: Path | None = None,
        bulk: ObjectStore | None = None,
        patience: float = 0.0,
    ) -> None:
        self._objects = objects
        self._bulk = bulk or objects  # for files and lists, which take their time
        self._root = root
        self._patience = patience
        self.url = url

    @classmethod
    def open(
        cls,
        place: str | Path,
        *,
        create: bool = True,
        options: Mapping[str, Any] | None = None,
        patience: float = 10.0,
    ) -> Store:
        """Open the store at a folder, `file://...`, `memory://` or `s3://bucket/prefix`.

        A folder that does not exist is created, or raises NotFoundError without `create`.
        Credentials and the endpoint of S3 are taken from the usual AWS_* variables; `options`
        overrides them. A server that fails or is gone is asked again for `patience` seconds. Raises
        BadInputError for any other address.
        """
        text = str(place)
        if text.startswith("memory://"):
            return cls(MemoryStore(), "memory://")
        if text.startswith("s3://"):
            with _mapped(text):
                objects, bulk = s3_clients(text, patience, options)
                return cls(objects, text, None, bulk, patience)
        if text.startswith("file://"):
            text = text.removeprefix("file://")
        elif _SCHEME.match(text):
            raise BadInputError(f"{text} is not a store; give a folder or s3://bucket/prefix.")
        if not text:
            raise BadInputError("A store needs an address; give a folder or s3://bucket/prefix.")
        root = Path(text).expanduser().absolute()
        if root.exists() and not root.is_dir():
            raise BadInputError(f"{root} is a file; a store needs a folder.")
        if not root.exists() and not create:
            raise NotFoundError(f"There is no store at {root}.")
        with _mapped(str(root)):
            return cls(LocalStore(root, mkdir=True), str(root), root)

    def put_new(self, key: str, data: bytes | Path) -> bool:
        """Create an object; False, and nothing changed, if there is one already.

        `data` may be a file, which is streamed.
        """
        check_key(key)
        target = self.local_path(key)
        with _mapped(key):
            if target is not None and isinstance(data, Path):
                return _copy_new(data, target)
            try:
                # parts cannot be put create-only: S3 takes up to 5 GB in one piece
                self._write(
                    lambda: obstore.put(
                        self._client(data), key, data, mode="create", use_multipart=False
                    )
                )
            except exceptions.AlreadyExistsError:
                return False
        return True

    def put(self, key: str, data: bytes | Path) -> None:
        """Create or replace an object; `data` may be a file, which is streamed."""
        check_key(key)
        target = self.local_path(key)
        with _mapped(key):
            if target is not None and isinstance(data, Path):
                with _copied_beside(data, target) as part:
                    part.replace(target)
            else:
                self._write(lambda: obstore.put(self._client(data), key, data))

    def get(self, key: str) -> bytes:
        """All bytes of an object; raises NotFoundError."""
        check_key(key)
        with _mapped(key):
            return bytes(obstore.get(self._objects, key).bytes())

    def fetch(self, key: str, target: Path) -> None:
        """Write an object to a file, piece by piece; raises NotFoundError."""
        check_key(key)
        with _mapped(key), target.open("wb") as file:
            for piece in obstore.get(self._bulk, key).stream(min_chunk_size=8 << 20):
                file.write(piece)

    def signed(self, key: str, seconds: float) -> str | None:
        """Address under which anyone can read an object for so long, None where there is none."""
        check_key(key)
        if not isinstance(self._objects, S3Store):
            return None
        with _mapped(key):
            return obstore.sign(self._objects, "GET", key, timedelta(seconds=seconds))

    def get_range(self, key: str, start: int, end: int) -> bytes:
        """Bytes [start, end) of an object, cut off at its end.

        Raises NotFoundError, and BadInputError where the range begins past the end.
        """
        size = self.size(key)
        if not 0 <= start < end or start >= size:
            raise BadInputError(f"{key} has {size} bytes; [{start}, {end}) lies outside.")
        with _mapped(key):
            return bytes(obstore.get_range(self._objects, key, start=start, end=min(end, size)))

    def size(self, key: str) -> int:
        """Bytes of an object; raises NotFoundError."""
        check_key(key)
        with _mapped(key):
            return int(obstore.head(self._objects, key)["size"])

    def exists(self, key: str) -> bool:
        """Whether there is such an object."""
        try:
            self.size(key)
        except NotFoundError:
            return False
        return True

    def list(self, prefix: str) -> Iterator[str]:
        """Keys under a folder (`prefix` ends in a slash, or is empty for all), in no order."""
        if prefix and not prefix.endswith("/"):
            raise BadInputError(f"{prefix!r} is not a folder; it has to end in a slash.")
        if prefix:
            check_key(prefix[:-1])
        with _mapped(prefix or "store"):
            for chunk in obstore.list(self._bulk, prefix or None, chunk_size=1000):
                for meta in chunk:
                    yield str(meta["path"])

    def folders(self, prefix: str) -> tuple[str, ...]:
        """Names of the folders right under a folder, sorted; cheap however much they hold."""
        if not prefix.endswith("/"):
            raise BadInputError(f"{prefix!r} is not a folder; it has to end in a slash.")
        check_key(prefix[:-1])
        with _mapped(prefix):
            found = obstore.list_with_delimiter(self._objects, prefix)["common_prefixes"]
        return tuple(sorted(str(path).rstrip("/").rsplit("/", 1)[-1] for path in found))

    def local_path(self, key: str) -> Path | None:
        """Where an object or folder lies on this machine, None where the store is no folder."""
        if self._root is None:
            return None
        return self._root.joinpath(*PurePosixPath(check_key(key.rstrip("/"))).parts)

    def delete(self, key: str) -> None:
        """Remove an object; nothing happens if there is none."""
        check_key(key)
        try:
            with _mapped(key):
                self._write(lambda: obstore.delete(self._objects, key))
        except NotFoundError:
            return

    def delete_prefix(self, prefix: str) -> int:
        """Remove everything under a folder; returns how many objects there were."""
        keys = list(self.list(prefix))
        for key in keys:
            self.delete(key)
        folder = self.local_path(prefix)
        if folder is not None and folder.is_dir():
            _remove_empty_folders(folder)
        return len(keys)

    def _client(self, data: bytes | Path) -> ObjectStore:
        return self._bulk if isinstance(data, Path) or len(data) > 1 << 20 else self._objects

    def _write(self, call: Callable[[], object]) -> None:
        repeated(call, self._patience)

    def remove_if_empty(self) -> None:
        """Remove the store's folder if nothing was ever put into it."""
        if self._root is not None and self._root.is_dir():
            _remove_empty_folders(self._root)


@contextmanager
def _copied_beside(source: Path, target: Path) -> Iterator[Path]:
    """A copy of `source` beside `target`, under a name that `list` leaves out; removed after.

    obstore would read the whole file into memory first.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    part = target.with_name(f"{target.name}#{secrets.randbits(48)}")
    try:
        shutil.copyfile(source, part)
        yield part
    finally:
        part.unlink(missing_ok=True)


def _copy_new(source: Path, target: Path) -> bool:
    """Copy a file to where none is yet; False if there is one already."""
    if target.exists():
        return False
    with _copied_beside(source, target) as part:
        try:
            target.hardlink_to(part)
        except FileExistsError:
            return False
    return True


def _remove_empty_folders(folder: Path) -> None:
    """Remove `folder` and what is below it as far as there are only folders."""
    for child in folder.iterdir():
        if child.is_dir():
            _remove_empty_folders(child)
    if not any(folder.iterdir()):
        folder.rmdir()
