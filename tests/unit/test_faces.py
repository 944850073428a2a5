"""Faces: right-handed, orthogonal, and projecting there and back."""

import numpy as np
from farfield_core.faces import ALL, FACES, directions, project, texel_centres
from hypothesis import given
from hypothesis import strategies as st


def test_axes_are_orthonormal_and_right_handed() -> None:
    for face in FACES:
        axes = np.stack([face.right, face.down, face.forward])
        np.testing.assert_array_equal(axes @ axes.T, np.eye(3))
        np.testing.assert_array_equal(np.cross(face.right, face.down), face.forward)


def test_the_faces_look_six_ways() -> None:
    assert {tuple(face.forward) for face in FACES} == {
        tuple(sign * np.eye(3)[axis]) for axis in range(3) for sign in (1, -1)
    }


def test_side_faces_have_the_sky_on_top() -> None:
    for face in (0, 1, 4, 5):
        np.testing.assert_array_equal(FACES[face].down, [0, -1, 0])


@given(
    st.sampled_from(ALL),
    st.floats(-1, 1),
    st.floats(-1, 1),
    st.floats(0.1, 1000),
    st.tuples(*[st.floats(-100, 100)] * 3),
)
def test_project_inverts_directions(
    face: int, u: float, v: float, z: float, eye: tuple[float, float, float]
) -> None:
    point = np.array(eye) + z * directions(face, np.array(u), np.array(v))
    pu, pv, pz = project(face, np.array(eye), point)
    np.testing.assert_allclose([pu, pv], [u, v], atol=1e-9 * (1 + 1000 / z))
    np.testing.assert_allclose(pz, z, rtol=1e-9)


def test_texel_centres() -> None:
    np.testing.assert_allclose(texel_centres(4), [-0.75, -0.25, 0.25, 0.75])
