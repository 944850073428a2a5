"""`python -m farfield_worker cell`: bakes the cells named on its standard input, one at a time.

It prints one JSON line `{"ready": true, "renderer": ...}`, then one for each line `i_j_k` it reads:
`{"cell": ..., "ok": true, "figures": {...}}` or `{"cell": ..., "ok": false, "error": sentence}`,
with `"store": true` where the store is to blame. It ends with its input, or with its parent.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from typing import Any, TextIO

from farfield_core.bake import read_walk
from farfield_core.cells import parse_cell_name
from farfield_core.errors import FarfieldError
from farfield_core.scenes import open_prepared
from farfield_core.store import Store, StoreError
from farfield_core.tables import walk_grid

from farfield_worker.orphans import end_with_parent

#: seconds that a store may be gone before a cell is handed back
PATIENCE = 120.0


def main(argv: list[str]) -> int:
    """Run the executor; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m farfield_worker cell", description=__doc__)
    parser.add_argument("--store", required=True, help="a folder or a store's address")
    parser.add_argument("--bake", required=True, help="the bake's id")
    options = parser.parse_args(argv)
    end_with_parent()
    # One process per core is faster than one process on all cores, for Mesa and for Numba.
    os.environ.setdefault("LP_NUM_THREADS", "0")
    os.environ.setdefault("NUMBA_NUM_THREADS", "1")
    # What libraries print must not get between the answers.
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    try:
        serve(Store.open(options.store, patience=PATIENCE), options.bake, sys.stdin, answers)
    except FarfieldError as error:
        print(str(error), file=sys.stderr)
        return error.exit_code
    return 0


def serve(store: Store, bake: str, requests: TextIO, answers: TextIO) -> None:
    """Answer requests until they end."""
    # after the environment is set
    from farfield_worker.cell.bake import CellBaker  # noqa: PLC0415
    from farfield_worker.reuse.carry import open_carrier  # noqa: PLC0415

    walk = read_walk(store, bake)
    grid = walk_grid(store, walk)
    scene = open_prepared(store, walk.scene.id)
    carrier = open_carrier(store, walk, scene)
    baker = CellBaker(scene, walk, store)

    def answer(**fields: Any) -> None:
        print(json.dumps(fields), file=answers, flush=True)

    answer(ready=True, renderer=baker.renderer)
    try:
        for line in requests:
            name = line.strip()
            try:
                index = parse_cell_name(name)
                centre = grid.centre(index)
                cell = carrier.carry(index, centre) if carrier is not None else None
                carried = cell is not None
                cell = cell or baker.bake(index, centre)
            except FarfieldError as error:
                answer(cell=name, ok=False, error=str(error), store=isinstance(error, StoreError))
            else:
                answer(cell=name, ok=True, figures={**cell.figures, "carried": carried})
    finally:
        baker.close()
