"""Views of a cell: inside it, of every kind, in every direction, the same for the same seed."""

import math

import numpy as np
from farfield_core.faces import ALL, SIDES
from farfield_worker.verify.views import corners, look, poses
from hypothesis import given
from hypothesis import strategies as st

HALF = np.array([7.0, 2.0, 5.0])
CENTRE = np.array([100.0, 3.0, -50.0])


@given(st.integers(0, 1000), st.integers(3, 60), st.sampled_from([ALL, SIDES, (4,)]))
def test_poses(seed: int, count: int, faces: tuple[int, ...]) -> None:
    views = poses(CENTRE, HALF, faces, count, seed)
    assert len(views) == count
    assert {v.kind for v in views} == {"centre", "corner", "random"}
    for view in views:
        offset = np.abs(view.eye - CENTRE) / HALF
        assert (offset < 1).all()
        if view.kind == "corner":
            assert (offset > 0.99).all()
    again = poses(CENTRE, HALF, faces, count, seed)
    assert all((a.eye == b.eye).all() and a[2:] == b[2:] for a, b in zip(views, again, strict=True))


def test_all_corners_and_faces_are_visited() -> None:
    views = poses(CENTRE, HALF, ALL, 48, 1)
    assert len({tuple(v.eye) for v in views if v.kind == "corner"}) == 8
    assert min(v.pitch for v in views) < -math.pi / 4 < math.pi / 4 < max(v.pitch for v in views)
    assert {round(v.yaw / (math.pi / 2)) % 4 for v in views} == {0, 1, 2, 3}


@given(st.floats(-math.pi, math.pi), st.floats(-1.5, 1.5))
def test_look_inverts_the_convention(yaw: float, pitch: float) -> None:
    """Yaw 0 looks along -z and turns left; pitch is positive upwards."""
    direction = np.array(
        [-math.sin(yaw) * math.cos(pitch), math.sin(pitch), -math.cos(yaw) * math.cos(pitch)]
    )
    back_yaw, back_pitch = look(7.0 * direction)
    assert math.isclose(math.cos(back_yaw - yaw), 1, abs_tol=1e-9)
    assert math.isclose(back_pitch, pitch, abs_tol=1e-9)


def test_corners_are_the_corners() -> None:
    assert {tuple(c) for c in np.sign(corners(HALF))} == {
        (x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)
    }
