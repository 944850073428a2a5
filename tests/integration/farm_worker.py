"""A farm worker with stand-ins for cells and scenes: `farm_worker.py BROKER STORE [JOBS]`."""

import os
import sys
from functools import partial
from pathlib import Path

from farfield_core.dispatch import prepare
from farfield_worker.farm import celery_app
from farfield_worker.farm.bakers import Limits

TESTS = Path(__file__).parents[1]
#: seconds without a sign of life, instead of 10: tests wait for it
LOST = 4
CELL = (sys.executable, str(TESTS / "integration/farm_cell.py"))

if __name__ == "__main__":
    prepare_scene = prepare.prepare_scene
    fake = (sys.executable, str(TESTS / "integration/fake_prepare.py"))
    celery_app.prepare_scene = partial(prepare_scene, command=fake)
    jobs = int(sys.argv[3]) if len(sys.argv) > 3 else 2
    limits = Limits.from_environment(os.environ, jobs)
    preparing = prepare.PrepareLimits.from_environment(os.environ)
    worker = celery_app.create_worker(
        sys.argv[1], sys.argv[2], CELL, limits=limits, prepare_limits=preparing, lost=LOST
    )
    celery_app.run_worker(worker, jobs)
