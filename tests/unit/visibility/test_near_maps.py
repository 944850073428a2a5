"""Near maps, and what is seen in them, against rays cast at every triangle."""

from pathlib import Path

import numpy as np
import pytest
from farfield_core.faces import directions, texel_centres
from farfield_core.scene import PreparedScene
from farfield_worker.near import near_triangles
from farfield_worker.visibility.far_texels import MARGIN, FarTexels
from farfield_worker.visibility.from_region import cell_eyes
from farfield_worker.visibility.near_maps import NearMap, NearMapRenderer, farthest_around
from farfield_worker.visibility.near_triangles import NearTriangles
from farfield_worker.visibility.sampling import (
    EFFORTS,
    FIXED,
    WINDOW,
    Effort,
    map_resolution,
    more_eyes,
    sample,
)
from numpy.typing import NDArray

from tests.unit.raycast import cast
from tests.unit.scenes import SceneWriter, checkerboard

Floats = NDArray[np.float64]
CENTRE = np.array([50.0, 2.0, -30.0])
HALF = np.array([1.0, 1.0, 1.0])
NEAR = 12.0
ON = EFFORTS["on"]


def around(*offsets: object) -> Floats:
    """Points given relative to CENTRE."""
    return np.asarray(CENTRE + np.array(offsets, np.float64))


def clutter(folder: Path, seed: int, sides: bool = False, boxes: int = 60) -> PreparedScene:
    """Boxes around the eye, many behind others, some across the near border, on a floor."""
    rng = np.random.default_rng(seed)
    writer = SceneWriter(CENTRE)
    batch = writer.batch(double_sided=sides)
    floor = np.array([[-40, -2, 40], [40, -2, 40], [40, -2, -40], [-40, -2, -40]])
    for x in range(4):
        for z in range(4):
            part = floor / 4 + [20 * x - 30, -1.5, 20 * z - 30]
            writer.quad(batch, CENTRE + part)
    for distance in np.exp(rng.uniform(np.log(2.5), np.log(30), boxes)):
        angle = rng.uniform(0, 2 * np.pi)
        size = rng.uniform(0.1, 0.5, 3) * distance
        (low,) = around((distance * np.cos(angle), -2, distance * np.sin(angle)))
        inner = low - CENTRE - 1.2, low + size - CENTRE + 1.2
        if (inner[0] < 0).all() and (inner[1] > 0).all():
            continue
        writer.box(batch, low, low + size)
    return writer.write(folder)


def rays(eye: Floats, scene: PreparedScene, number: int, seed: int) -> tuple[Floats, Floats]:
    """What random rays meet first within the near field: distances (inf: nothing), triangles."""
    directions_ = np.random.default_rng(seed).normal(size=(number, 3))
    hits = cast(scene, eye, directions_, np.zeros((number, 2), np.int64)).distance
    points = eye + np.where(np.isinf(hits), 0, hits)[..., None] * directions_[:, None]
    hits[np.abs(points - CENTRE).max(axis=-1) > NEAR] = np.inf
    nearest = hits.argmin(axis=1)
    return hits[np.arange(number), nearest], nearest


@pytest.mark.usefixtures("graphics")
@pytest.mark.parametrize("sides", [False, True])
def test_a_map_is_what_rays_meet_in_the_near_field(tmp_path: Path, sides: bool) -> None:
    scene = clutter(tmp_path / "prepared", 3, sides)
    renderer = NearMapRenderer(scene, 32)
    renderer.enter(CENTRE, NEAR)
    eye = CENTRE + HALF * (0.3, -0.6, 0.8)
    c = texel_centres(32)
    u, v = (grid.reshape(-1) for grid in np.meshgrid(c, c))
    right = equal = 0
    for face in range(6):
        there = renderer.map(eye, face)
        across = directions(face, u, v)
        hits = cast(scene, eye, across, np.zeros((len(u), 2), np.int64)).distance
        points = eye + np.where(np.isinf(hits), 0, hits)[..., None] * across[:, None]
        hits[np.abs(points - CENTRE).max(axis=-1) > NEAR] = np.inf
        nearest = hits.min(axis=1)
        expected = np.where(np.isinf(nearest), -1, hits.argmin(axis=1))
        with np.errstate(divide="ignore"):
            close = np.isclose(1 / nearest, there.solid.reshape(-1), rtol=1e-4)
        right += int(close.sum())
        equal += int((expected == there.triangle.reshape(-1)).sum())
    # rays through edges may go either way
    assert right >= 0.995 * 6 * 32 * 32
    assert equal >= 0.99 * 6 * 32 * 32
    renderer.close()


@pytest.mark.usefixtures("graphics")
@pytest.mark.parametrize("seed", range(2))
def test_hardly_a_ray_finds_a_triangle_that_was_left_out(tmp_path: Path, seed: int) -> None:
    scene = clutter(tmp_path / "prepared", seed)
    inside = near_triangles(scene, CENTRE, NEAR)
    near = NearTriangles(scene, inside, CENTRE, NEAR)
    renderer = NearMapRenderer(scene, 128)
    sample(renderer, CENTRE, HALF, NEAR, ON, [near])
    renderer.close()
    kept = np.zeros(scene.info.triangles, bool)
    kept[inside[near.seen]] = True
    rng = np.random.default_rng(seed + 100)
    met = np.zeros(scene.info.triangles, bool)
    wrong = total = 0
    for k in range(40):
        distance, triangle = rays(CENTRE + HALF * rng.uniform(-1, 1, 3), scene, 300, k)
        hit = triangle[np.isfinite(distance)]
        met[hit] = True
        wrong += int((~kept[hit]).sum())
        total += 300
    assert wrong <= 1e-4 * total
    # what nobody meets is mostly left out
    assert kept.sum() <= 1.6 * met.sum()
    assert kept.sum() < 0.75 * len(inside)


def hidden_box(folder: Path, **screen: object) -> tuple[PreparedScene, int]:
    """A box behind a screen that fills the view of it; returns the box's first batch number."""
    writer = SceneWriter(CENTRE)
    options = dict(screen)
    if "holes" in options:
        options["texture"] = writer.texture(checkerboard(alpha=options.pop("holes")))
    wall = writer.batch(double_sided=True, **options)
    box = writer.batch()
    writer.quad(
        wall,
        around([-9, -9, -4], [9, -9, -4], [9, 9, -4], [-9, 9, -4]),
        color=(1, 1, 1, 0.9),
        tiles=4.0,
    )
    writer.box(box, *around([-1, -1, -8], [1, 1, -6]))
    return writer.write(folder), box


@pytest.mark.usefixtures("graphics")
@pytest.mark.parametrize(
    ("screen", "hides"),
    [
        ({}, True),
        ({"alpha": "mask", "holes": (255, 0)}, False),
        ({"alpha": "mask", "holes": (255, 255)}, False),
        ({"alpha": "dither"}, False),
    ],
    ids=["opaque", "holes", "soft", "screened"],
)
def test_only_what_is_opaque_hides(tmp_path: Path, screen: dict[str, object], hides: bool) -> None:
    scene, _ = hidden_box(tmp_path / "prepared", **screen)
    near = NearTriangles(scene, near_triangles(scene, CENTRE, NEAR), CENTRE, NEAR)
    behind = FarTexels(around([14, 0, -40], [0, 0, 40]), np.full(2, 1e-3))
    renderer = NearMapRenderer(scene, 128)
    sample(renderer, CENTRE, HALF, NEAR, ON, [near, behind])
    renderer.close()
    z = scene.positions[scene.triangles[near.triangles[near.seen]]][..., 2]
    assert (z > -4.5).all(axis=1).sum() == 2, "the screen itself is seen"
    assert bool((z < -5).any()) == (not hides)
    assert behind.seen.tolist() == [not hides, True]


@pytest.mark.usefixtures("graphics")
def test_what_is_smaller_than_a_texel_is_kept(tmp_path: Path) -> None:
    writer = SceneWriter(CENTRE)
    batch = writer.batch(double_sided=True)
    rng = np.random.default_rng(0)
    specks = rng.uniform(-8, 8, (300, 1, 3)) + rng.normal(size=(300, 3, 3)) * 1e-3
    writer.triangles(batch, CENTRE + specks[np.abs(specks[:, 0]).max(axis=1) > 2])
    scene = writer.write(tmp_path / "prepared")
    near = NearTriangles(scene, near_triangles(scene, CENTRE, NEAR), CENTRE, NEAR)
    renderer = NearMapRenderer(scene, 128)
    sample(renderer, CENTRE, HALF, NEAR, EFFORTS["fast"], [near])
    renderer.close()
    assert len(near.seen) > 200
    assert near.seen.all()


@pytest.mark.usefixtures("graphics")
def test_backs_that_do_not_show_are_left_out(tmp_path: Path) -> None:
    """A one-sided wall that turns its back to the whole cell draws nothing and hides nothing."""
    for sides in (False, True):
        writer = SceneWriter(CENTRE)
        batch = writer.batch(double_sided=sides)
        wall = CENTRE + np.array([[-9, -9, -4], [-9, 9, -4], [9, 9, -4], [9, -9, -4]])
        writer.quad(batch, wall)
        writer.box(batch, *around([-1, -1, -8], [1, 1, -6]))
        scene = writer.write(tmp_path / f"prepared{sides}")
        near = NearTriangles(scene, near_triangles(scene, CENTRE, NEAR), CENTRE, NEAR)
        renderer = NearMapRenderer(scene, 128)
        sample(renderer, CENTRE, HALF, NEAR, ON, [near])
        renderer.close()
        z = scene.positions[scene.triangles[near.triangles[near.seen]]][..., 2]
        assert (z > -5).all(axis=1).sum() == (2 if sides else 0)
        assert (z < -5).any() != sides


class Nothing:
    """Near maps that show nothing."""

    def __init__(self, resolution: int) -> None:
        self.entered: list[tuple[Floats, float]] = []
        shape = (resolution, resolution)
        self._map = NearMap(np.zeros(shape, np.float32), np.full(shape, -1, np.int32))

    def enter(self, centre: Floats, half_width: float) -> None:
        self.entered.append((centre, half_width))

    def map(self, eye: Floats, face: int) -> NearMap:
        return self._map


class Recorder:
    """A watcher to which everything is new `until` some eye."""

    def __init__(self, until: int) -> None:
        self.eyes: list[Floats] = []
        self.until = until

    def look(self, eye: Floats, maps: object) -> float:
        self.eyes.append(eye)
        return 1.0 if len(self.eyes) <= self.until else 0.0


def test_sampling_ends_when_nothing_is_new() -> None:
    effort = Effort(scale=0.5, most=40, target=1e-5)
    for until, expected in ((0, FIXED), (20, 20 + WINDOW), (100, 40)):
        recorder = Recorder(until)
        renderer = Nothing(8)
        eyes = sample(renderer, CENTRE, HALF, NEAR, effort, [Recorder(0), recorder])  # type: ignore[arg-type]
        assert eyes == len(recorder.eyes) == expected
        assert renderer.entered == [(CENTRE, NEAR)]
        offsets = np.abs(np.array(recorder.eyes) - CENTRE)
        assert (offsets <= HALF).all()
        assert np.array_equal(recorder.eyes[:FIXED], cell_eyes(CENTRE, HALF))


def test_more_eyes_fill_the_cell_evenly() -> None:
    eyes = (more_eyes(np.zeros(3), np.ones(3), 512) + 1) / 2
    counts, _ = np.histogramdd(eyes, bins=(4, 4, 4), range=[(0, 1)] * 3)
    assert counts.min() >= 4  # 8 on average
    assert counts.max() <= 12
    assert np.array_equal(more_eyes(np.zeros(3), np.ones(3), 8), eyes[:8] * 2 - 1)


def test_maps_are_no_smaller_than_they_need_be() -> None:
    assert map_resolution(EFFORTS["on"], 512) == 256
    assert map_resolution(EFFORTS["careful"], 512) == 512
    assert map_resolution(EFFORTS["on"], 40) == 128


def test_far_texels_by_plain_loops() -> None:
    rng = np.random.default_rng(7)
    resolution = 16
    points = rng.normal(size=(900, 3)) * 30
    points = points[np.abs(points).max(axis=1) > 12]
    slack = rng.uniform(0, 0.2, len(points))
    far = FarTexels(points, slack)
    expected = np.zeros(len(points), bool)
    for n, eye in enumerate(rng.uniform(-2, 2, (5, 3))):
        solid = np.where(rng.random((6, resolution, resolution)) < 0.997, 1 / 9.0, 0.0)
        solid = solid.astype(np.float32)
        # near polygons lose a margin: what is left is solid all over the square around
        grown = np.pad(solid, ((0, 0), (MARGIN, MARGIN), (MARGIN, MARGIN)), mode="edge")
        square = np.lib.stride_tricks.sliding_window_view(grown, (2 * MARGIN + 1,) * 2, (1, 2))
        shown = square.min(axis=(3, 4))
        places = []
        for p in points - eye:
            axis = int(np.abs(p).argmax())
            face = 2 * axis + int(p[axis] < 0)
            z = abs(p[axis])
            u = [
                (p @ directions(face, *t) - p @ directions(face, 0, 0)) / z
                for t in ((1, 0), (0, 1))
            ]
            column, row = (min(int((t + 1) / 2 * resolution), resolution - 1) for t in u)
            places.append((face, row, column, np.float32(1 / z)))
            shown[face, row, column] = max(shown[face, row, column], np.float32(1 / z))
        least = [farthest_around(m) for m in shown]
        before = expected.copy()
        first = set()
        for i, (face, row, column, d) in enumerate(places):
            if least[face][row, column] <= d * (1 + slack[i]):
                if not before[i] and shown[face, row, column] == d:
                    first.add((face, row, column))
                expected[i] = True
        none = np.full((resolution, resolution), -1, np.int32)
        new = far.look(eye, [NearMap(m, none) for m in solid])
        assert np.array_equal(far.seen, expected), n
        assert new == pytest.approx(len(first) / solid.size, abs=1 / solid.size)
    assert 0.2 < expected.mean() < 0.98


@pytest.mark.parametrize("shape", [(1, 1), (1, 5), (5, 1), (2, 2), (7, 4), (16, 16)])
@pytest.mark.parametrize("texels", [0, 1, 2])
def test_farthest_around(shape: tuple[int, int], texels: int) -> None:
    values = np.random.default_rng(7).random((*shape, 2), np.float32)[..., 0]
    found = farthest_around(values, texels)
    for y, x in np.ndindex(shape):
        around = values[max(y - texels, 0) : y + texels + 1, max(x - texels, 0) : x + texels + 1]
        assert found[y, x] == around.min()
