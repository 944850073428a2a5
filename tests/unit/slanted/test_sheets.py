"""Segmentation, fill, clipping and near border: what they promise, checked on random scenes."""

import numpy as np
import pytest
from farfield_core.faces import texel_centres
from farfield_worker.slanted.clip import (
    clip_half_plane,
    clip_to_range,
    disparity_range,
    grown_rectangles,
    untouched,
)
from farfield_worker.slanted.colours import shown
from farfield_worker.slanted.fill import SheetTexels, fill
from farfield_worker.slanted.fit import fit_plane
from farfield_worker.slanted.grid import GROWTH, Grid, match, texel_starts
from farfield_worker.slanted.near_border import split, walls
from farfield_worker.slanted.planes import triangle_planes
from farfield_worker.slanted.segment import SegmentSettings, Sheets, segment
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tests.unit.slanted.random_scenes import (
    HALF,
    NEAR,
    RESOLUTION,
    Floats,
    Seen,
    cast,
    random_corners,
)

scenes = st.builds(
    lambda seed, count, face, off: cast(
        face,
        (np.random.default_rng(seed).choice([-1.0, 1.0], 3) * HALF if off else np.zeros(3)),
        random_corners(np.random.default_rng(seed), count),
    ),
    st.integers(0, 2**32 - 1),
    st.integers(1, 40),
    st.integers(0, 5),
    st.booleans(),
)


def cut(seen: Seen, knobs: SegmentSettings | None = None) -> tuple[Sheets, Floats, Floats]:
    low, high = seen.tolerance.interval(seen.disparity)
    sheets = segment(
        seen.texel, seen.disparity, low, high, seen.seed, seen.triangles.plane, RESOLUTION, knobs
    )
    return sheets, low, high


def filled(seen: Seen, sheets: Sheets) -> tuple[SheetTexels, Floats, Floats]:
    low2, high2 = seen.tolerance.interval(seen.disparity, 2.0)
    starts = texel_starts(seen.texel, RESOLUTION)
    return fill(sheets, starts, seen.disparity, low2, high2, RESOLUTION), low2, high2


def uv(texel: NDArray[np.int32]) -> tuple[Floats, Floats]:
    c = texel_centres(RESOLUTION)
    return c[texel % RESOLUTION], c[texel // RESOLUTION]


def at(planes: Floats, texel: NDArray[np.int32]) -> Floats:
    u, v = uv(texel)
    return np.asarray(planes[..., 0] * u + planes[..., 1] * v + planes[..., 2])


@given(scenes)
@settings(max_examples=60, deadline=None)
def test_sheets(seen: Seen) -> None:
    sheets, low, high = cut(seen)
    # every fragment is captured, inside its sheet's rectangle, within the exact tolerance
    assert np.all(sheets.owner >= 0)
    x, y = seen.texel % RESOLUTION, seen.texel // RESOLUTION
    rect = sheets.rect[sheets.owner]
    assert np.all((rect[:, 0] <= x) & (x < rect[:, 2]) & (rect[:, 1] <= y) & (y < rect[:, 3]))
    drawn = at(sheets.plane[sheets.owner], seen.texel)
    assert np.all((low <= drawn) & (drawn <= high))
    # nowhere in its texels does a plane fall beyond infinity
    slope = np.abs(sheets.plane[sheets.owner, :2]).sum(axis=1)
    assert np.all(drawn >= slope * (1 + 2 * GROWTH) / RESOLUTION)
    # rectangles are tight: their four sides touch captured texels
    for s, (x0, y0, x1, y1) in enumerate(sheets.rect):
        own = sheets.owner == s
        assert (x0, y0, x1, y1) == (x[own].min(), y[own].min(), x[own].max() + 1, y[own].max() + 1)
    # what is nearer is drawn no farther, among different sheets
    same = np.flatnonzero(np.diff(seen.texel) == 0)
    other = sheets.owner[same] != sheets.owner[same + 1]
    assert np.all(drawn[same][other] >= drawn[same + 1][other])


@given(scenes)
@settings(max_examples=30, deadline=None)
def test_order_holds_between_all_pairs(seen: Seen) -> None:
    sheets, _, _ = cut(seen)
    drawn = at(sheets.plane[sheets.owner], seen.texel)
    for texel in np.unique(seen.texel):
        here = np.flatnonzero(seen.texel == texel)
        for i in range(len(here)):
            for j in range(i):
                if sheets.owner[here[i]] != sheets.owner[here[j]]:
                    assert drawn[here[j]] >= drawn[here[i]]


def test_a_wall_is_one_sheet() -> None:
    wall = np.array(
        [
            [[-40.0, -9, 60], [70, -9, 30], [70, 12, 30]],
            [[-40, -9, 60], [70, 12, 30], [-40, 12, 60]],
        ]
    )
    seen = cast(4, np.zeros(3), wall)
    assert len(seen.texel) > 300
    sheets, _, _ = cut(seen)
    assert len(sheets.rect) == 1
    np.testing.assert_allclose(sheets.plane[0], seen.triangles.plane[0], rtol=1e-6, atol=1e-9)


def test_small_sheets_are_put_off_and_shared() -> None:
    rng = np.random.default_rng(5)
    corners = (
        np.array([0.0, 0, 80])
        + rng.uniform(-1, 1, (150, 1, 3)) * [70, 70, 1]
        + rng.normal(size=(150, 3, 3)) * 1.2
    )
    seen = cast(4, np.zeros(3), corners)
    fine, _, _ = cut(seen, SegmentSettings(blocks=(8,), least=(1,)))
    shared, _, _ = cut(seen)
    assert np.all(fine.owner >= 0)
    assert np.all(shared.owner >= 0)
    assert len(shared.rect) < len(fine.rect)


@given(scenes)
@settings(max_examples=30, deadline=None)
def test_match_is_the_first_fragment_allowed(seen: Seen) -> None:
    low, high = seen.tolerance.interval(seen.disparity)
    starts = texel_starts(seen.texel, RESOLUTION)
    rng = np.random.default_rng(len(seen.texel))
    owner = rng.integers(-1, 2, len(seen.texel)).astype(np.int32)
    open_low = np.where(owner < 0, low, np.inf)
    grid = Grid(starts, seen.disparity, open_low, high, owner, RESOLUTION)
    for row in rng.choice(len(seen.triangles.plane), 5):
        plane = seen.triangles.plane[row]
        for texel in np.unique(seen.texel)[:200]:
            d = float(at(plane, texel))
            want = -1
            for f in np.flatnonzero(seen.texel == texel)[::-1]:
                flat = abs(plane[0]) + abs(plane[1])
                if (
                    owner[f] < 0
                    and low[f] <= d <= high[f]
                    and d >= flat * (1 + 2 * GROWTH) / RESOLUTION
                ):
                    want = int(f)
            assert match(grid, texel % RESOLUTION, texel // RESOLUTION, *plane) == want


def test_fit_is_weighted_least_squares() -> None:
    rng = np.random.default_rng(3)
    texel = np.sort(rng.choice(RESOLUTION * RESOLUTION, 300, replace=False)).astype(np.int32)
    u, v = uv(texel)
    d = 0.02 + 0.003 * u - 0.004 * v + rng.normal(size=300) * 1e-4
    width = rng.uniform(0.5, 2, 300)
    grid = Grid(
        texel_starts(texel, RESOLUTION),
        d,
        d - width,
        d + width,
        np.full(300, -1, np.int32),
        RESOLUTION,
    )
    out = np.empty(3)
    rect = np.array([0, 0, RESOLUTION, RESOLUTION], np.int32)
    assert fit_plane(grid, rect, np.array([0.0, 0, 0.02]), out)
    a = np.stack([u, v, np.ones(300)], axis=1) / (2 * width)[:, None]
    want, *_ = np.linalg.lstsq(a, d / (2 * width), rcond=None)
    np.testing.assert_allclose(out, want, rtol=1e-9)
    assert not fit_plane(
        grid, np.array([0, 5, RESOLUTION, 6], np.int32), np.array([0.0, 0, 0.02]), out
    )


@given(scenes)
@settings(max_examples=30, deadline=None)
def test_fill_is_the_ring_where_the_surface_goes_on(seen: Seen) -> None:
    sheets, _, _ = cut(seen)
    texels, low2, high2 = filled(seen, sheets)
    by_texel: dict[int, list[int]] = {}
    for f, t in enumerate(seen.texel):
        by_texel.setdefault(int(t), []).append(f)
    captured: list[dict[int, int]] = [{} for _ in sheets.plane]
    for f in range(len(seen.texel) - 1, -1, -1):
        captured[sheets.owner[f]][int(seen.texel[f])] = f

    def reached(s: int, t: int) -> int | None:
        """The fragment at texel t where sheet s would go on."""
        plane = sheets.plane[s]
        d = float(at(plane, np.array(t, np.int32)))
        if d < (abs(plane[0]) + abs(plane[1])) * (1 + 2 * GROWTH) / RESOLUTION:
            return None
        fits = [f for f in by_texel.get(t, []) if low2[f] <= d <= high2[f]]
        return min(fits, key=lambda f: abs(seen.disparity[f] - d)) if fits else None

    def closed(s: int, t: int, other: int, c: int) -> bool:
        """Whether `other` closes the sliver between its texel t and texel c of s."""
        u = (t % RESOLUTION + c % RESOLUTION + 1) / RESOLUTION - 1
        v = (t // RESOLUTION + c // RESOLUTION + 1) / RESOLUTION - 1
        ours, its = (a * u + b * v + k for a, b, k in sheets.plane[[s, other]].tolist())
        mine = ours < its or (ours == its and s < other)
        return not mine and (c in captured[other] or reached(other, c) == captured[s][c])

    for s in range(len(sheets.plane)):
        part = slice(texels.starts[s], texels.starts[s + 1])
        want = {t: (f, False) for t, f in captured[s].items()}
        for t in by_texel:
            column, row = t % RESOLUTION, t // RESOLUTION
            beside = [
                c
                for c in captured[s]
                if abs(c % RESOLUTION - column) <= 1 and abs(c // RESOLUTION - row) <= 1
            ]
            g = reached(s, t)
            if t in captured[s] or not beside or g is None:
                continue
            other = int(sheets.owner[g])
            if not all(closed(s, t, other, c) for c in beside):
                want[t] = (g, True)
        got = {
            int(t): (int(f), bool(r))
            for t, f, r in zip(
                texels.texel[part], texels.fragment[part], texels.filled[part], strict=True
            )
        }
        assert got == want
        x, y = np.array(sorted(want)) % RESOLUTION, np.array(sorted(want)) // RESOLUTION
        assert tuple(texels.rect[s]) == (x.min(), y.min(), x.max() + 1, y.max() + 1)


@given(scenes, st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_colours_are_those_of_the_nearest_texel_that_is_seen(seen: Seen, seed: int) -> None:
    sheets, _, _ = cut(seen)
    texels, _, _ = filled(seen, sheets)
    known = np.random.default_rng(seed).random(len(seen.texel)) < 0.6
    got = shown(sheets, texels, known, RESOLUTION)
    for s in range(len(sheets.plane)):
        part = range(texels.starts[s], texels.starts[s + 1])
        firm = {
            int(texels.texel[i]): texels.fragment[i]
            for i in part
            if not texels.filled[i] and known[texels.fragment[i]]
        }
        for i in part:
            t, f = int(texels.texel[i]), texels.fragment[i]
            size = 2.0 / RESOLUTION
            u, v = (t % RESOLUTION + 0.5) * size - 1, (t // RESOLUTION + 0.5) * size - 1
            over = [a * u + b * v + c for a, b, c in sheets.plane[[s, sheets.owner[f]]].tolist()]
            if over[0] >= over[1] if texels.filled[i] else known[f]:
                assert got[i] == f
                continue
            steps = {
                c: (abs(c % RESOLUTION - t % RESOLUTION), abs(c // RESOLUTION - t // RESOLUTION))
                for c in firm
            }
            near = {c: (max(step), 2 * step[0] + step[1]) for c, step in steps.items()}
            near = {c: cost for c, cost in near.items() if cost[0] <= 2}
            best = [firm[c] for c, cost in near.items() if cost == min(near.values())]
            assert got[i] in (best or [f])


@given(scenes)
@settings(max_examples=30, deadline=None)
def test_clipped_quads_keep_their_texels_and_have_no_spikes(seen: Seen) -> None:
    sheets, _, _ = cut(seen)
    texels, _, _ = filled(seen, sheets)
    low, high = disparity_range(
        texels, seen.disparity, seen.seed, seen.triangles, seen.tolerance, RESOLUTION
    )
    captured = ~texels.filled
    sheet = np.repeat(np.arange(len(sheets.rect)), np.diff(texels.starts))
    rectangles = grown_rectangles(texels.rect)
    for s, plane in enumerate(sheets.plane):
        polygon = clip_to_range(rectangles[s], plane, low[s], high[s], RESOLUTION)
        assert 3 <= len(polygon) <= 6
        d = (
            plane[0] * (2 * polygon[:, 0] / RESOLUTION - 1)
            + plane[1] * (2 * polygon[:, 1] / RESOLUTION - 1)
            + plane[2]
        )
        assert np.all(d >= -1e-12)
        assert np.all((d >= low[s] * (1 - 1e-9) - 1e-12) & (d <= high[s] * (1 + 1e-9) + 1e-12))
        own = texels.texel[(sheet == s) & captured]
        centres = np.stack([own % RESOLUTION + 0.5, own // RESOLUTION + 0.5], axis=1)
        for i in range(len(polygon)):
            edge = polygon[(i + 1) % len(polygon)] - polygon[i]
            inward = np.array([-edge[1], edge[0]])
            assert np.all(
                (centres - polygon[i]) @ inward >= -1e-9 * np.linalg.norm(edge) * RESOLUTION
            )
        # the range by sampling triangles inside the grown squares of texels
        f = texels.fragment[(sheet == s)]
        reach = np.clip(
            seen.disparity[f, None]
            + np.outer(np.abs(seen.triangles.plane[seen.seed[f], :2]).sum(axis=1), [-1, 1])
            * 2
            / RESOLUTION,
            seen.triangles.low[seen.seed[f], None],
            seen.triangles.high[seen.seed[f], None],
        )
        lowest, highest = seen.tolerance.interval(np.array([reach.min(), reach.max()]))
        assert low[s] == pytest.approx(max(0.0, lowest[0]), abs=1e-12)
        assert high[s] == pytest.approx(highest[1], abs=1e-12)


@given(st.integers(0, 2**32 - 1))
def test_half_plane_clip_by_sampling(seed: int) -> None:
    rng = np.random.default_rng(seed)
    polygon = np.array([(0.0, 0), (1, 0), (1, 1), (0, 1)])
    points = rng.uniform(0, 1, (300, 2))
    keep = np.ones(300, bool)
    for line in rng.normal(size=(3, 3)) * [1, 1, 0.5]:
        polygon = clip_half_plane(polygon, line) if len(polygon) else polygon
        keep &= points @ line[:2] + line[2] >= 0
    inside = np.ones(300, bool) if len(polygon) else np.zeros(300, bool)
    for i in range(len(polygon)):
        edge = polygon[(i + 1) % len(polygon)] - polygon[i]
        inside &= (points - polygon[i]) @ [-edge[1], edge[0]] >= -1e-12
    assert np.array_equal(inside, keep)


@given(st.integers(0, 2**32 - 1), st.integers(0, 5), st.booleans())
def test_near_border_by_sampling(seed: int, face: int, off: bool) -> None:
    rng = np.random.default_rng(seed)
    eye = rng.choice([-1.0, 1.0], 3) * HALF if off else np.zeros(3)
    wall_planes = walls(face, eye, NEAR)
    plane = rng.normal(size=3) / NEAR * [1, 1, 0.3] + [0, 0, 1 / NEAR]
    polygon = clip_half_plane(
        np.array([(3.0, 4), (40, 4), (40, 45), (3, 45)]),
        np.append(plane[:2], plane[2] - plane[0] - plane[1]) * [2 / RESOLUTION, 2 / RESOLUTION, 1],
    )
    if len(polygon) < 3:
        return
    parts = split(polygon, plane, wall_planes, RESOLUTION)
    points = rng.uniform(0, RESOLUTION, (200, 2))

    def contains(polygon: Floats) -> NDArray[np.bool_]:
        inside = np.ones(len(points), bool)
        for i in range(len(polygon)):
            edge = polygon[(i + 1) % len(polygon)] - polygon[i]
            inside &= (points - polygon[i]) @ [-edge[1], edge[0]] >= 0
        return inside

    u, v = 2 * points[:, 0] / RESOLUTION - 1, 2 * points[:, 1] / RESOLUTION - 1
    rays = np.stack([u, v, np.ones(200)], axis=1)
    from farfield_core.faces import directions

    w = directions(face, u, v)
    # the disparity at which each ray leaves the cube, found from its six walls
    with np.errstate(divide="ignore"):
        leave = np.min((NEAR - np.sign(w) * eye) / np.abs(w), axis=1)
    d = rays @ plane
    want = np.minimum(d, 1 / leave)
    covered = np.zeros(200, int)
    for part, p in parts:
        assert len(part) >= 3
        here = contains(part)
        covered += here
        np.testing.assert_allclose((rays @ p)[here], want[here], rtol=1e-9, atol=1e-12)
    assert np.array_equal(covered, contains(polygon).astype(int))


def test_edge_on_triangles_have_no_plane() -> None:
    corners = np.array(
        [[[0.0, 0, 10], [5, 0, 20], [2, 0, 40]], [[0, 1, 10], [5, 1, 20], [2, 1, 40]]]
    )
    planes = triangle_planes(4, np.zeros(3), corners)
    assert np.isnan(planes.plane[0]).all()
    assert np.isfinite(planes.plane[1]).all()
    assert planes.low[1] == pytest.approx(1 / 40)
    assert planes.high[1] == pytest.approx(1 / 10)
    behind = triangle_planes(4, np.zeros(3), -corners)
    assert np.isinf(behind.high).all()


def test_what_needs_no_clipping_is_what_clipping_leaves_alone() -> None:
    rng = np.random.default_rng(5)
    corner = rng.integers(0, RESOLUTION - 8, (400, 2))
    rects = np.hstack([corner, corner + rng.integers(1, 8, (400, 2))]).astype(np.int32)
    planes = rng.normal(size=(400, 3)) * (0.05, 0.05, 0.0) + (0.0, 0.0, 0.1)
    low, high = rng.uniform(0.0, 0.08, 400), rng.uniform(0.1, 0.2, 400)
    planes_of_walls = walls(4, np.array([1.0, -0.5, 2.0]), 8.0)
    polygons = grown_rectangles(rects)
    whole = untouched(polygons, planes, low, high, planes_of_walls, RESOLUTION)
    for s in range(400):
        clipped = clip_to_range(polygons[s], planes[s], low[s], high[s], RESOLUTION)
        parts = split(polygons[s], planes[s], planes_of_walls, RESOLUTION)
        alone = len(parts) == 1 and np.array_equal(parts[0][1], planes[s])
        same = clipped.shape == (4, 2) and np.array_equal(clipped, polygons[s])
        assert whole[s] == (same and alone)
    assert 50 < whole.sum() < 350
