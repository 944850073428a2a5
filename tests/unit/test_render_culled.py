"""The culled renderer against the plain per-layer loop: not one texel may differ."""

import tempfile
from pathlib import Path

import numpy as np
import pytest
from farfield_core.placement import place
from farfield_worker.render.culled import CulledRenderer
from farfield_worker.render.interface import FaceTexels
from farfield_worker.render.plain import PlainRenderer
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.unit.scenes import random_scene

pytestmark = pytest.mark.usefixtures("graphics")


def assert_equal(ours: FaceTexels, oracle: FaceTexels) -> None:
    for name, a, b in zip(FaceTexels._fields, ours, oracle, strict=True):
        np.testing.assert_array_equal(a, b, err_msg=name)
        assert a.dtype == b.dtype


@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    seed=st.integers(0, 2**32 - 1),
    offset=st.sampled_from([(0.0, 0.0, 0.0), (0.31, 0.12, -0.77)]),
    resolution=st.sampled_from([33, 64, 128]),
    layers=st.sampled_from([1, 7, 40]),
)
def test_culled_equals_plain_on_every_face(seed, offset, resolution, layers):
    borders = place((2.0, 1.5, 2.0), resolution, layers).borders
    with tempfile.TemporaryDirectory() as folder:
        scene = random_scene(Path(folder) / "prepared", seed, origin=(1000.0, 0.0, -2000.0))
        culled, plain = CulledRenderer(scene), PlainRenderer(scene)
        eye = scene.origin + offset
        drawn = 0
        for face in range(6):
            ours = culled.face(eye, face, borders, resolution)
            assert_equal(ours, plain.face(eye, face, borders, resolution))
            drawn += len(ours.texel)
        assert drawn > 0
        culled.close()
        plain.close()
