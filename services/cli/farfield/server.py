"""A web server in this process, in the foreground or beside other work."""

from __future__ import annotations

import socket
import threading
import time

import uvicorn
from farfield_api.server import Server as StoppingServer
from farfield_core.errors import BadInputError, FarfieldError
from fastapi import FastAPI


class Server:
    """Serves `app`; the port is taken at once, so that a taken one is told before any work.

    Attributes:
        address: where a browser finds it.
    """

    def __init__(self, app: FastAPI, host: str, port: int) -> None:
        self._socket = _bind(host, port)
        port = self._socket.getsockname()[1]
        shown = "127.0.0.1" if host in ("", "0.0.0.0", "::") else host
        self.address = f"http://{f'[{shown}]' if ':' in shown else shown}:{port}"
        config = uvicorn.Config(app, log_level="warning", timeout_graceful_shutdown=3)
        self._server = StoppingServer(config)
        self._thread: threading.Thread | None = None

    def run(self) -> None:
        """Serve until interrupted."""
        self._server.run(sockets=[self._socket])

    def start(self) -> None:
        """Serve in the background; returns once requests are answered."""
        self._thread = threading.Thread(target=self.run, name="farfield-server", daemon=True)
        self._thread.start()
        while not self._server.started:
            if not self._thread.is_alive():
                raise FarfieldError("The server could not start; its log says why.")
            time.sleep(0.01)

    def stop(self) -> None:
        """End a server in the background."""
        self._server.should_exit = True
        if self._thread is not None:
            self._thread.join()
        self._socket.close()


def _bind(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
        listener.listen(128)
    except OSError as error:
        listener.close()
        raise BadInputError(
            f"Port {port} of {host} cannot be used ({error.strerror}); choose another with --port."
        ) from None
    return listener
