"""A static server for browser tests: the built pages, and walks at the addresses of the API."""

from __future__ import annotations

import mimetypes
import sys
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any


class _QuietServer(ThreadingHTTPServer):
    daemon_threads = True

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A browser that closes a connection is no fault."""
        if not isinstance(sys.exc_info()[1], ConnectionError):
            super().handle_error(request, client_address)


class WalkServer:
    """Serves `pages` and the walks in `walks`; faults can be set while it runs.

    Attributes:
        walks: folder of each walk, by id.
        missing: parts of addresses that answer 404.
        broken: parts of addresses that answer with bytes that mean nothing.
        delays: seconds to wait before answering, by part of the address.
        log: addresses asked for, oldest first.
    """

    def __init__(self, pages: Path, walks: dict[str, Path]) -> None:
        self.pages, self.walks = pages, walks
        self.log: list[str] = []
        self.clear()
        self._http = _QuietServer(("127.0.0.1", 0), self._handler())
        self._thread = threading.Thread(target=self._http.serve_forever, daemon=True)
        self._thread.start()

    def clear(self) -> None:
        """End all faults and forget what was asked for."""
        self.missing: set[str] = set()
        self.broken: set[str] = set()
        self.delays: dict[str, float] = {}
        self.log.clear()

    @property
    def url(self) -> str:
        """Where the server answers, without a slash at the end."""
        return f"http://127.0.0.1:{self._http.server_address[1]}"

    def close(self) -> None:
        """Stop and wait for the thread."""
        self._http.shutdown()
        self._thread.join()
        self._http.server_close()

    def find(self, path: str) -> Path | None:
        """The file that an address means."""
        parts = path.strip("/").split("/")
        if parts[:3] == ["api", "v1", "walks"] and len(parts) > 4:
            root = self.walks.get(parts[3])
            return root and root.joinpath(*parts[4:])
        if parts[0] == "walk":
            return self.pages / "walk" / "index.html"
        return self.pages / (path.strip("/") or "index.html")

    def _handler(self) -> type[BaseHTTPRequestHandler]:
        server = self

        class Handler(BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def do_GET(self) -> None:
                path = self.path.split("?")[0]
                server.log.append(path)
                time.sleep(sum(s for part, s in server.delays.items() if part in path))
                file = server.find(path)
                hidden = any(part in path for part in server.missing)
                if hidden or file is None or not file.is_file():
                    self._send(404, b"", "text/plain")
                elif any(part in path for part in server.broken):
                    self._send(200, b"nothing that makes sense", "application/octet-stream")
                else:
                    kind = mimetypes.guess_type(file.name)[0] or "application/octet-stream"
                    self._send(200, file.read_bytes(), kind)

            def _send(self, status: int, body: bytes, kind: str) -> None:
                try:
                    self.send_response(status)
                    self.send_header("Content-Type", kind)
                    self.send_header("Content-Length", str(len(body)))
                    self.send_header("Cache-Control", "no-store")
                    self.end_headers()
                    self.wfile.write(body)
                except (BrokenPipeError, ConnectionResetError):
                    self.close_connection = True  # the page has called off

            def log_message(self, *args: Any) -> None:
                del args

        return Handler
