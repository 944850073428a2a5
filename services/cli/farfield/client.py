"""A small typed client of the REST API: what `farfield upload`, `bakes` and `watch` use.

with Client("http://localhost:8000") as client:
    scene = client.wait_scene(client.upload(Path("town.glb")))
    bake = client.bake(scene.id, {"box": {"min": [0, 0, 0], "max": [40, 10, 10]}}, cell_size=10)
    for now in client.watch(bake):
        print(now.cells.done, "of", now.cells.total)
"""

from __future__ import annotations

import base64
import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import TracebackType
from typing import Any, Self
from urllib.parse import urljoin

import httpx2
from farfield_api.schemas import BakeBody, BakeList, SceneBody, UploadBody
from farfield_core.errors import BadInputError, FarfieldError, NotFoundError, SceneRefusedError
from farfield_core.plan import Plan

#: bytes sent in one request of an upload
CHUNK = 32 << 20
_BLOCK = 1 << 20
#: seconds to wait before going on after a broken connection
_RETRIES = (0.0, 0.5, 1.0, 2.0, 4.0, 8.0)

Progress = Callable[[int, int], None]


class ServerError(FarfieldError):
    """The server cannot be reached, or failed."""

    exit_code = 8


class Client:
    """Speaks to one server; close it, or use it in a `with`.

    Args:
        server: root of the server, such as http://localhost:8000.
        key: API key, where the server asks for one.
    """

    def __init__(self, server: str, key: str = "") -> None:
        if not server.startswith(("http://", "https://")):
            raise BadInputError(f"{server} is no server; give one such as http://localhost:8000.")
        headers = {"Authorization": f"Bearer {key}"} if key else {}
        self.root = server.rstrip("/") + "/"
        self._http = httpx2.Client(
            base_url=f"{self.root}api/v1/", headers=headers, timeout=60, follow_redirects=True
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close all connections."""
        self._http.close()

    def upload(self, model: Path, progress: Progress = lambda sent, total: None) -> str:
        """Send a model file or a zip, going on after broken connections; returns the scene's id.

        `progress` is told bytes sent and bytes in all. Raises SceneRefusedError.
        """
        try:
            size = model.stat().st_size
        except OSError as error:
            raise BadInputError(f"{model} cannot be read: {error.strerror}.") from None
        name = base64.b64encode(model.name.encode()).decode()
        headers = {"Upload-Length": str(size), "Upload-Metadata": f"filename {name}"}
        answer = self._ask("POST", "uploads", headers=headers | _TUS)
        place = urljoin(self.root, answer.headers["location"])
        sent = tried = 0
        while sent < size:
            try:
                sent = self._send_part(model, place, sent, size, progress)
                tried = 0
            except (httpx2.TransportError, ServerError) as error:
                if tried == len(_RETRIES):
                    raise ServerError(f"The upload broke off again and again: {error}.") from None
                time.sleep(_RETRIES[tried])
                tried += 1
                sent = self._offset(place, sent)
        while True:
            found = UploadBody.model_validate(self._ask("GET", place).json())
            if found.scene is not None:
                return found.scene
            if found.reason is not None:
                raise SceneRefusedError(found.reason)
            time.sleep(0.2)

    def scene(self, scene: str) -> SceneBody:
        """A scene, and how far it has come; raises NotFoundError."""
        return SceneBody.model_validate(self._ask("GET", f"scenes/{scene}").json())

    def wait_scene(self, scene: str) -> SceneBody:
        """Wait until a scene is ready; raises SceneRefusedError."""
        while True:
            found = self.scene(scene)
            if found.state == "refused":
                raise SceneRefusedError(found.reason or "The model was refused.")
            if found.state == "ready":
                return found
            time.sleep(0.3)

    def suggestion(self, scene: str) -> tuple[dict[str, Any], float]:
        """A corridor through a scene and the edge length of its cells."""
        found = self._ask("GET", f"scenes/{scene}/suggestion").json()
        return found["corridor"], float(found["cell_size"])

    def plan(self, scene: str, corridor: dict[str, Any], **settings: Any) -> Plan:
        """What a bake would come to."""
        body = {"scene": scene, "corridor": corridor, "settings": settings}
        return Plan.model_validate(self._ask("POST", "plans", json=body).json())

    def bake(self, scene: str, corridor: dict[str, Any], **settings: Any) -> str:
        """Ask for a bake; returns its id."""
        body = {"scene": scene, "corridor": corridor, "settings": settings}
        return str(self._ask("POST", "bakes", json=body).json()["id"])

    def bakes(self, **filters: str) -> Iterator[BakeBody]:
        """All bakes, those asked for last first; filters are `state` and `scene`."""
        query = {"order": "newest", **filters}
        while True:
            found = BakeList.model_validate(self._ask("GET", "bakes", params=query).json())
            yield from found.bakes
            if found.next is None:
                return
            query["cursor"] = found.next

    def bake_status(self, bake: str) -> BakeBody:
        """A bake, and how far it has come; raises NotFoundError."""
        return BakeBody.model_validate(self._ask("GET", f"bakes/{bake}").json())

    def control(self, bake: str, verb: str) -> BakeBody:
        """Pause, resume, cancel or retry a bake."""
        return BakeBody.model_validate(self._ask("POST", f"bakes/{bake}/{verb}").json())

    def watch(self, bake: str) -> Iterator[BakeBody]:
        """A bake whenever it has changed, until it has ended; goes on after broken connections."""
        self.bake_status(bake)
        tried = 0
        while True:
            try:
                for kind, data in self._events(f"bakes/{bake}/events"):
                    tried = 0
                    if kind == "state":
                        yield BakeBody.model_validate_json(data)
                    elif kind == "end":
                        return
            except httpx2.TransportError as error:
                if tried == len(_RETRIES):
                    raise ServerError(f"The server cannot be reached: {error}.") from None
            time.sleep(_RETRIES[min(tried, len(_RETRIES) - 1)])
            tried += 1

    def walk_address(self, bake: str) -> str:
        """Where a browser walks through a bake."""
        return f"{self.root}walk/{bake}"

    def _events(self, path: str) -> Iterator[tuple[str, str]]:
        with self._http.stream("GET", path, timeout=httpx2.Timeout(60, read=None)) as answer:
            kind = data = ""
            for line in answer.iter_lines():
                field, _, value = line.partition(":")
                if field == "event":
                    kind = value.strip()
                elif field == "data":
                    data += value.strip()
                elif line == "" and kind:
                    yield kind, data
                    kind = data = ""

    def _send_part(self, model: Path, place: str, start: int, size: int, progress: Progress) -> int:
        end = min(size, start + CHUNK)

        def body() -> Iterator[bytes]:
            at = start
            with model.open("rb") as file:
                file.seek(start)
                while at < end:
                    data = file.read(min(_BLOCK, end - at))
                    if not data:
                        raise BadInputError(f"{model} became shorter while it was sent.")
                    at += len(data)
                    yield data
                    progress(at, size)

        headers = _TUS | {
            "Content-Type": "application/offset+octet-stream",
            "Content-Length": str(end - start),
            "Upload-Offset": str(start),
        }
        answer = self._ask("PATCH", place, headers=headers, content=body())
        return int(answer.headers["upload-offset"])

    def _offset(self, place: str, sent: int) -> int:
        try:
            return int(self._ask("HEAD", place, headers=_TUS).headers["upload-offset"])
        except (httpx2.TransportError, ServerError):
            return sent

    def _ask(self, method: str, path: str, **how: Any) -> httpx2.Response:
        try:
            answer = self._http.request(method, path, **how)
        except httpx2.ConnectError as error:
            raise ServerError(f"{self.root} cannot be reached: {error}.") from None
        if answer.is_success:
            return answer
        try:
            sentence = str(answer.json()["detail"])
        except (json.JSONDecodeError, KeyError, TypeError, UnicodeDecodeError):
            sentence = f"{self.root} answered {answer.status_code}; is it a Farfield server?"
        if answer.status_code == 404:
            raise NotFoundError(sentence)
        if answer.status_code in (408, 409, 423) or answer.status_code >= 500:
            raise ServerError(sentence)
        raise BadInputError(sentence)


_TUS = {"Tus-Resumable": "1.0.0"}
