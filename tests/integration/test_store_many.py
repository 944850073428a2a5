"""Lists of many keys, in a folder and from a real S3 server over one.

In the soak a million keys in the folder. The S3 server keeps no index, and takes more than in
proportion to their number, so it gets a hundred thousand.
"""

import os
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from farfield_core.memory import peak_bytes
from farfield_core.store import Store

from tests.integration.servers import BUCKET, S3Server, running, s3_environment, versitygw

SOAK = os.environ.get("FARFIELD_SOAK") == "1"
MANY = {"folder": 1_000_000, "versitygw": 100_000} if SOAK else {}


@pytest.fixture(params=["folder", *(["versitygw"] if versitygw() else [])])
def placed(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[tuple[str, Store, Path]]:
    """Name, store, and the folder in which its objects lie."""
    with ExitStack() as servers:
        if request.param == "folder":
            yield "folder", Store.open(tmp_path / "store"), tmp_path / "store"
            return
        server = S3Server(tmp_path)
        servers.enter_context(running(server))
        for name, value in s3_environment(server.endpoint).items():
            monkeypatch.setenv(name, value)
        yield "versitygw", Store.open(f"s3://{BUCKET}/store"), tmp_path / BUCKET / "store"


def test_many_keys_are_listed(
    placed: tuple[str, Store, Path], record_testsuite_property: Callable[[str, object], None]
) -> None:
    name, store, folder = placed
    count = MANY.get(name, 3_000)
    cells = folder / "bakes" / "b" / "cells"
    cells.mkdir(parents=True)
    for n in range(count):
        os.close(os.open(cells / f"{n}_0_0.json", os.O_CREAT | os.O_WRONLY))
    store.put("bakes/b/walk.json", b"{}")
    Path("/proc/self/clear_refs").write_text("5")  # the peak begins anew
    before = peak_bytes()
    began = time.monotonic()
    seen = bytearray(count)
    for key in store.list("bakes/b/cells/"):
        seen[int(key.removeprefix("bakes/b/cells/").split("_")[0])] += 1
    seconds = time.monotonic() - began
    grown = (peak_bytes() - before) / 2**20
    assert seen == b"\x01" * count
    # listed page by page, not gathered
    assert grown < 100
    record_testsuite_property(f"{name}_keys_listed", count)
    record_testsuite_property(f"{name}_keys_a_second", count / seconds)
    record_testsuite_property(f"{name}_list_megabytes", grown)
