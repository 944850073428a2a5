"""`farfield serve` as a process: it answers, says where, and ends when told to."""

import json
import os
import re
import signal
import socket
import subprocess
import sys
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest


@contextmanager
def serving(store: Path) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A server and its address."""
    server = subprocess.Popen(
        [sys.executable, "-m", "farfield", "serve", "--store", str(store), "--port", "0"],
        stderr=subprocess.PIPE,
        text=True,
    )
    assert server.stderr
    try:
        found = re.search(r"at (http://127\.0\.0\.1:\d+)$", server.stderr.readline().strip())
        assert found
        yield server, found[1]
    finally:
        server.kill()
        server.wait()
        server.stderr.close()


def test_serve_answers_and_ends(tmp_path: Path) -> None:
    with serving(tmp_path / "store") as (server, address):
        with urllib.request.urlopen(f"{address}/api/v1/health", timeout=60) as answer:
            assert answer.status == 200
            assert isinstance(json.load(answer), dict)
        server.send_signal(signal.SIGTERM)
        assert server.wait(timeout=30) in (0, 130, -signal.SIGTERM)


@pytest.mark.parametrize("command", ["serve", "demo"])
def test_a_taken_port_is_told_at_once(tmp_path: Path, command: str) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        result = subprocess.run(
            [sys.executable, "-m", "farfield", command, "--port", str(port)],
            env={**os.environ, "FARFIELD_STORE": str(tmp_path / "store")},
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
    assert result.returncode == 2
    assert f"Port {port}" in result.stderr
    assert "--port" in result.stderr
    assert result.stderr.count("\n") == 1
