"""A web server in this process, in the foreground or beside other work."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import uvicorn
from farfield_api.server import Server as StoppingServer
from farfield_core.errors import BadInputError, FarfieldError
from fastapi import FastAPI


class Server:
    """Serves an app; the port is taken at once, so that a taken one is told before any work.

    Attributes:
        address: where a browser finds it.
    """

    def __init__(self, host: str, port: int) -> None:
        self._socket = _bind(host, port)
        port = self._socket.getsockname()[1]
        shown = "127.0.0.1" if host in ("", "0.0.0.0", "::") else host
        self.address = f"http://{f'[{shown}]' if ':' in shown else shown}:{port}"

    def run(self, app: FastAPI) -> None:
        """Serve until interrupted."""
        _stopping_server(app).run(sockets=[self._socket])

    @contextmanager
    def beside(self, app: FastAPI) -> Iterator[None]:
        """Serve in the background for as long as the context lasts."""
        server = _stopping_server(app)
        thread = threading.Thread(
            target=server.run, args=([self._socket],), name="farfield-server", daemon=True
        )
        thread.start()
        try:
            while not server.started:
                if not thread.is_alive():
                    raise FarfieldError("The server could not start; its log says why.")
                time.sleep(0.01)
            yield
        finally:
            server.should_exit = True
            thread.join()


def _stopping_server(app: FastAPI) -> StoppingServer:
    return StoppingServer(uvicorn.Config(app, log_level="warning", timeout_graceful_shutdown=3))


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
