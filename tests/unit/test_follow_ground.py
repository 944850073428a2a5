"""Corridors over real surfaces: hills, stairs, one floor above another."""

import math

import numpy as np
from farfield_core.corridor import Corridor, Path_, cut
from farfield_core.ground import ground_of, ground_under
from numpy.typing import NDArray

from tests.unit.soup import block, floor, soup

Floats = NDArray[np.float64]
EYE = 1.7


def walk(*points: tuple[float, float, float], width: float = 1.0) -> Corridor:
    return Corridor(path=Path_(points=points, width=width, height=2.0), follow_ground=True)


def hill(x: float, z: float) -> float:
    """A hilly land that is never steeper than 40 degrees."""
    return 6 * math.sin(x / 11) + 4 * math.cos(z / 9 + x / 30)


def land(edge: float = 2.0, count: int = 60) -> Floats:
    """`hill` over a square around the origin, as triangles."""
    t = (np.arange(count + 1) - count / 2) * edge
    h = np.array([[hill(x, z) for z in t] for x in t])
    triangles = []
    for i in range(count):
        for k in range(count):
            a, b, c, d = (
                (t[i + n], h[i + n, k + m], t[k + m]) for n, m in ((0, 0), (0, 1), (1, 1), (1, 0))
            )
            triangles += [[a, b, c], [a, c, d]]
    return np.array(triangles)


def test_hills_are_walked_at_eye_height_though_only_the_ends_are_given() -> None:
    scene = soup(land(), blocks=40)
    path = walk((-50.0, hill(-50, 0), 0.0), (50.0, hill(50, 0), 0.0), width=9.0)
    grid = cut(path, (3.0, 3.0, 3.0), ground_of(scene))
    centres = grid.centres()
    assert len(grid) > 90
    assert set(grid.index[:, 1]) == {0}, "one cell a column"
    heights = np.array([hill(x, z) for x, _, z in centres])
    assert np.ptp(heights) > 10
    # flat triangles cut the hills' curves
    assert np.abs(centres[:, 1] - heights - EYE).max() < 0.15


def house() -> Floats:
    """A hall, twenty steps up along one wall, and a gallery over the hall; a table in the way."""
    parts = [floor((0, 0), (40, 12), 0.0), floor((0, 4), (30, 12), 4.0)]
    parts += [block((20 + 0.5 * n, 0, 0), (20.5 + 0.5 * n, 0.2 * (n + 1), 3)) for n in range(20)]
    parts += [block((30, 0, 0), (40, 4, 12)), block((9, 0, 7), (11, 0.8, 9))]
    parts += [floor((0, 0), (40, 12), 8.0)]
    return np.concatenate(parts)


def test_up_the_stairs_and_back_over_the_hall() -> None:
    scene = soup(house(), blocks=8)
    path = walk(
        (1.2, 0.0, 8.3),
        (18.0, 0.0, 8.3),
        (19.5, 0.0, 1.5),
        (30.5, 4.0, 1.5),
        (33.0, 4.0, 8.3),
        (1.2, 4.0, 8.3),
    )
    size = (1.0, 1.0, 1.0)
    grid = cut(path, size, ground_under(scene, path))
    by_column: dict[tuple[int, int], list[float]] = {}
    for (i, _, k), (x, y, z) in zip(grid.indices(), grid.centres(), strict=True):
        under = y - EYE
        by_column.setdefault((i, k), []).append(under)
        if 20 <= x < 30 and z < 3:
            assert math.isclose(under, 0.2 * math.floor((x - 20) / 0.5 + 1e-6) + 0.2, abs_tol=1e-5)
        elif x >= 30:
            assert math.isclose(under, 4.0, abs_tol=1e-5)
        elif 9 < x < 11 and 7 < z < 9 and under < 2:
            assert math.isclose(under, 0.0, abs_tol=1e-5), "the floor under the table is nearer"
        else:
            assert min(abs(under), abs(under - 4)) < 1e-5, (x, y, z)
    # hall and gallery along z = 8: two storeys, numbered from below
    storeys = [sorted(found) for (i, k), found in by_column.items() if len(found) == 2]
    assert len(storeys) >= 16
    assert all(np.allclose(found, [0.0, 4.0], atol=1e-5) for found in storeys)
    for column, found in by_column.items():
        levels = [j for i, j, k in grid.indices() if (i, k) == column]
        assert levels == list(range(len(found)))
    # a walker comes by the stairs between one floor and the other
    order = grid.centres()[:, 1] - EYE
    first_up, last_down = (
        int(np.argmax(order > 3.9)),
        len(order) - 1 - int(np.argmax(order[::-1] < 0.1)),
    )
    assert last_down < first_up
