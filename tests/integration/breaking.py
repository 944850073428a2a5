"""A bad line: a TCP relay that cuts its connections after given numbers of bytes."""

from __future__ import annotations

import socket
import struct
import threading
from contextlib import suppress


class BadLine:
    """Relays to a port of loopback; cuts when as many bytes as the next of `breaks` went up.

    Attributes:
        port: where it listens.
        cuts: how many connections it has cut.
    """

    def __init__(self, to: int, breaks: list[int]) -> None:
        self._to, self._breaks = to, sorted(breaks)
        self._up = self.cuts = 0
        self._lock = threading.Lock()
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = int(self._listener.getsockname()[1])
        threading.Thread(target=self._accept, daemon=True).start()

    def close(self) -> None:
        """Take no more connections."""
        self._listener.close()

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                client, _ = self._listener.accept()
                server = socket.create_connection(("127.0.0.1", self._to))
                for ends in ((client, server, True), (server, client, False)):
                    threading.Thread(target=self._relay, args=ends, daemon=True).start()

    def _relay(self, source: socket.socket, target: socket.socket, up: bool) -> None:
        with suppress(OSError):
            while data := source.recv(1 << 14):
                allowed = self._allowed(len(data)) if up else len(data)
                target.sendall(data[:allowed])
                if allowed < len(data):
                    # a reset, not a farewell
                    for end in (source, target):
                        end.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
                    break
        for end in (source, target):
            with suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
            end.close()

    def _allowed(self, count: int) -> int:
        with self._lock:
            if self._breaks and self._up + count > self._breaks[0]:
                count = max(0, self._breaks.pop(0) - self._up)
                self.cuts += 1
            self._up += count
            return count
