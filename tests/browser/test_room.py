"""The walk that browser tests draw keeps the format."""

from __future__ import annotations

import json
from pathlib import Path

from farfield_core.format import cell_faults, validate, walk_faults
from farfield_core.walk import CellFile, Walk


def test_room_keeps_the_format(room: Path) -> None:
    document = json.loads((room / "walk.json").read_text())
    validate("walk", document)
    walk = Walk.model_validate(document)
    assert list(walk_faults(walk)) == []
    for path in (room / "cells").iterdir():
        cell = json.loads(path.read_text())
        validate("cell", cell)
        assert list(cell_faults(CellFile.model_validate(cell), walk)) == []
