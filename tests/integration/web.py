"""The web server of Compose and of the chart, as a process in front of an API."""

from __future__ import annotations

import os
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import httpx2

from tests.integration.servers import ROOT, free_port

CONFIGURATION = ROOT / "deploy/helm/farfield/files/nginx.conf"
NGINX = shutil.which("nginx") or shutil.which("nginx", path="/usr/sbin")


@contextmanager
def web_server(api: str, folder: Path) -> Iterator[str]:
    """nginx in front of the API at `api`, its files in `folder`; yields its root.

    The deployed configuration but for its addresses and folders.
    """
    assert NGINX, "nginx is needed; make setup installs it"
    port, cache = free_port(), folder / "walks"
    text = CONFIGURATION.read_text(encoding="utf-8")
    for deployed, here in (
        ("server api:8000;", f"server {api.removeprefix('http://')};"),
        ("listen 8080;", f"listen 127.0.0.1:{port};"),
        ("/var/cache/nginx", str(cache)),
        ("/tmp/nginx", f"{folder}/nginx"),
    ):
        assert deployed in text
        text = text.replace(deployed, here)
    folder.mkdir(exist_ok=True)
    file = folder / "nginx.conf"
    # without this it would drop root for a user who may not look into a test's folder
    file.write_text(f"user root;\n{text}" if os.geteuid() == 0 else text)
    with (folder / "log").open("w") as log:
        process = subprocess.Popen(
            [NGINX, "-p", folder, "-e", "stderr", "-c", file, "-g", "daemon off;"], stderr=log
        )
    url = f"http://127.0.0.1:{port}"
    try:
        end = time.monotonic() + 20
        while True:
            with suppress(httpx2.TransportError):
                if httpx2.get(f"{url}/api/v1/health").status_code == 200:
                    break
            assert process.poll() is None, (folder / "log").read_text()
            assert time.monotonic() < end, (folder / "log").read_text()
            time.sleep(0.05)
        yield url
    finally:
        process.terminate()
        process.wait(timeout=20)
