"""A farm worker whose cells and scenes are made by stand-ins: `farm_worker.py BROKER STORE`."""

import sys
from pathlib import Path

from farfield_core.dispatch import prepare
from farfield_worker.farm import celery_app

TESTS = Path(__file__).parents[1]
CELL = (sys.executable, str(TESTS / "unit/fake_executor.py"))

if __name__ == "__main__":
    prepare_scene = prepare.prepare_scene
    fake = (sys.executable, str(TESTS / "integration/fake_prepare.py"))
    celery_app.prepare_scene = lambda store, scene: prepare_scene(store, scene, fake)
    celery_app.run_worker(celery_app.create_worker(sys.argv[1], sys.argv[2], CELL), jobs=2)
