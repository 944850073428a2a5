"""Servers that tests start and kill: Redis, an S3 gateway, and a proxy that injects faults."""

from __future__ import annotations

import http.client
import os
import random
import shutil
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from redis import Redis
from redis.exceptions import RedisError

from tests.integration.serving import until

ROOT = Path(__file__).parents[2]
REDIS = shutil.which("redis-server")
BUCKET = "farfield"


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return int(listener.getsockname()[1])


class Server:
    """A server process on a port of its own, which comes back with what it had on disk."""

    def __init__(self, command: list[str], environment: dict[str, str] | None = None) -> None:
        self._command = command
        self._environment = {**os.environ, **(environment or {})}
        self._process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        self._process = subprocess.Popen(
            self._command,
            env=self._environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )

    def kill(self) -> None:
        assert self._process
        self._process.send_signal(signal.SIGKILL)
        self._process.wait()


class RedisServer(Server):
    """Redis, with an append-only file as in docker-compose.yml."""

    def __init__(self, folder: Path) -> None:
        assert REDIS, "redis-server is needed; make setup installs it"
        port = free_port()
        self.url = f"redis://127.0.0.1:{port}/0"
        options = ["--port", str(port), "--bind", "127.0.0.1", "--save", "", "--dir", str(folder)]
        super().__init__([REDIS, *options, "--appendonly", "yes", "--appendfsync", "everysec"])

    def start(self) -> None:
        super().start()
        with Redis.from_url(self.url) as client:
            until(lambda: self._answers(client))

    @staticmethod
    def _answers(client: Redis) -> bool:
        with suppress(RedisError):
            return bool(client.ping())
        return False

    def flush(self) -> None:
        with Redis.from_url(self.url) as client:
            client.flushall()


def versitygw() -> str | None:
    """The S3 gateway that `make setup` builds where Go is installed."""
    built = ROOT / ".venv/bin/versitygw"
    return str(built) if built.exists() else shutil.which("versitygw")


class S3Server(Server):
    """An S3 server over a folder: versitygw."""

    def __init__(self, folder: Path) -> None:
        self.port = free_port()
        self.endpoint = f"http://127.0.0.1:{self.port}"
        (folder / BUCKET).mkdir(parents=True, exist_ok=True)
        gateway = versitygw()
        assert gateway, "versitygw is needed"
        address = ["--port", f"127.0.0.1:{self.port}", "--health", "/health"]
        keys = {"ROOT_ACCESS_KEY": "key", "ROOT_SECRET_KEY": "a secret of tests"}
        super().__init__([gateway, *address, "posix", str(folder)], keys)

    def start(self) -> None:
        super().start()
        until(self._answers)

    def _answers(self) -> bool:
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=5)
        with suppress(OSError):
            connection.request("GET", "/health")
            return connection.getresponse().status == 200
        return False


class MotoServer(Server):
    """An S3 server in memory; it checks no signatures, and forgets all when it is killed."""

    def __init__(self) -> None:
        self.port = free_port()
        self.endpoint = f"http://127.0.0.1:{self.port}"
        super().__init__([sys.executable, "-m", "moto.server", "-p", str(self.port)])

    def start(self) -> None:
        super().start()
        until(self._has_bucket)

    def _has_bucket(self) -> bool:
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=5)
        with suppress(OSError):
            connection.request("PUT", f"/{BUCKET}")
            return connection.getresponse().status == 200
        return False


def s3_server(folder: Path) -> S3Server | MotoServer:
    """The real one, or moto where Go is not installed."""
    return S3Server(folder) if versitygw() else MotoServer()


def s3_environment(endpoint: str) -> dict[str, str]:
    """What a client of a server here needs to know, and all that it is to ask."""
    return {
        "AWS_ENDPOINT_URL": endpoint,
        "AWS_ACCESS_KEY_ID": "key",
        "AWS_SECRET_ACCESS_KEY": "a secret of tests",
        "AWS_REGION": "us-east-1",
    }


class Faults:
    """A proxy before an S3 server: a share of requests fails, and all while it is `gone`.

    A third fails before it reaches the server, a third after, and a third is not answered at all,
    but cut off after `silence` seconds.
    """

    def __init__(self, port: int, share: float = 0.0, seed: int = 1, silence: float = 30.0) -> None:
        self.share = share
        self.gone = False
        self.requests = self.faults = 0
        self._random = random.Random(seed)
        self._closing = threading.Event()
        faults = self

        class Handler(BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def log_message(self, *_: Any) -> None:
                pass

            def handle_any(self) -> None:
                body = self.rfile.read(int(self.headers.get("Content-Length") or 0))
                faults.requests += 1
                fault = faults._choose()
                if faults.gone or fault == "before":
                    self._answer(503, [], b"")
                    return
                connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
                try:
                    connection.request(self.command, self.path, body, dict(self.headers.items()))
                    answer = connection.getresponse()
                    status, headers, content = answer.status, answer.getheaders(), answer.read()
                finally:
                    connection.close()
                if fault == "after":
                    self._answer(500, [], b"")
                elif fault == "silence":
                    faults._closing.wait(silence)
                    self.close_connection = True
                else:
                    self._answer(status, headers, content)

            def _answer(self, status: int, headers: list[tuple[str, str]], body: bytes) -> None:
                self.send_response_only(status)
                kept = {name: value for name, value in headers if name.lower() != "connection"}
                if self.command != "HEAD" or "Content-Length" not in kept:
                    kept["Content-Length"] = str(len(body))
                kept.pop("Transfer-Encoding", None)
                for name, value in kept.items():
                    self.send_header(name, value)
                self.end_headers()
                if self.command != "HEAD":
                    self.wfile.write(body)

        for method in ("GET", "PUT", "HEAD", "DELETE", "POST"):
            setattr(Handler, f"do_{method}", Handler.handle_any)

        class Proxy(ThreadingHTTPServer):
            daemon_threads = True
            request_queue_size = 128

            def handle_error(self, *_: Any) -> None:
                """Clients that do not wait are what the proxy is for."""

        self._server = Proxy(("127.0.0.1", 0), Handler)
        self.endpoint = f"http://127.0.0.1:{self._server.server_address[1]}"
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)
        self._thread.start()

    def _choose(self) -> str:
        if self._random.random() >= self.share:
            return ""
        self.faults += 1
        return self._random.choice(["before", "after", "silence"])

    def close(self) -> None:
        self._closing.set()
        self._server.shutdown()
        self._thread.join()
        self._server.server_close()


@contextmanager
def running(server: Server) -> Iterator[None]:
    server.start()
    try:
        yield
    finally:
        server.kill()
