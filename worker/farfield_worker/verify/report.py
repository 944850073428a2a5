"""`farfield verify`: every baked cell of a walk against full renders, as figures and a picture.

Views are 60 degrees wide with as many pixels across as a face has texels, the paper's setting,
unless `pixels` says how many. A second set of figures, `fine`, is at twice that; a third,
`corners`, is of the views from a cell's corners alone. `floor` is what the same figures say of the
full render against itself half a pixel off: a bake that reaches it is as good as a picture can
tell.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from farfield_core import faces, layout
from farfield_core.cells import Index, cell_name
from farfield_core.errors import NotFoundError
from farfield_core.scene import open_scene
from farfield_core.walk import CellFile
from numpy.typing import NDArray

from farfield_worker.shoot.scene import SceneShooter
from farfield_worker.shoot.view import NearField, Picture, View
from farfield_worker.shoot.walk import WalkShooter, find_walk
from farfield_worker.verify.metrics import Figures, Rgb, Shot, combine, compare, mean_flip
from farfield_worker.verify.views import Pose, look, poses

FOV = 60.0
#: points on each common face at which neighbouring cells are compared
POP_VIEWS = 4

Json = dict[str, Any]
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class ComparedView:
    """One view with its pictures, kept for the contact sheet."""

    cell: Index
    pose: Pose
    figures: Figures
    full: Rgb
    walk: Rgb


@dataclass
class Tally:
    """Figures gathered over the views of a cell, or of all cells."""

    walk: list[Figures] = field(default_factory=list)
    floor: list[Figures] = field(default_factory=list)
    fine_walk: list[Figures] = field(default_factory=list)
    fine_floor: list[Figures] = field(default_factory=list)
    corner_walk: list[Figures] = field(default_factory=list)
    corner_floor: list[Figures] = field(default_factory=list)
    pops: list[tuple[float, int]] = field(default_factory=list)

    def add(self, other: Tally) -> None:
        """Take in another tally."""
        for part in fields(self):
            getattr(self, part.name).extend(getattr(other, part.name))

    def json(self) -> Json:
        """Figures by name; null where no view showed any far field."""
        pixels = sum(count for _, count in self.pops)
        pop = sum(mean * count for mean, count in self.pops) / pixels if pixels else None
        return {
            **_json(self.walk, pop),
            "floor": _floor(self.floor),
            "fine": {**_json(self.fine_walk, None), "floor": _floor(self.fine_floor)},
            "corners": {**_json(self.corner_walk, None), "floor": _floor(self.corner_floor)},
        }


def _json(figures: list[Figures], pop: float | None) -> Json:
    total = combine(figures)
    names = ("wrong", "missing", "extra", "flip")
    out: Json = {name: None if total is None else getattr(total, name) for name in names}
    # JSON knows no infinity: pictures without any difference have no PSNR.
    out["psnr"] = None if total is None or not np.isfinite(total.psnr) else total.psnr
    return out | {"pop": pop, "pixels": 0 if total is None else total.pixels}


def _floor(figures: list[Figures]) -> Json:
    out = _json(figures, None)
    return out | {"pop": out["flip"]}


def shot(picture: Picture) -> Shot:
    """A picture as the metrics want it."""
    return Shot(picture.rgba[..., :3], picture.rgba[..., 3] > 0, picture.far)


class Verifier:
    """Compares a walk in a local store with its scene. Create it in the process that uses it.

    `pixels` across a view are as many as a face has texels unless given. Raises NotFoundError where
    there is no walk, or its scene is not in the same store.
    """

    def __init__(self, target: Path, pixels: int | None = None) -> None:
        manifest = find_walk(target)
        self._walks = WalkShooter(manifest)
        self.walk = self._walks.walk
        store = manifest.resolve().parents[2]
        prepared = store / layout.prepared_prefix(self.walk.scene.id)
        if not (prepared / "scene.json").is_file():
            raise NotFoundError(
                f"The scene of {manifest} is not beside it; verify the store that the bake wrote."
            )
        self._scenes = SceneShooter(open_scene(prepared))
        self._pixels = pixels or self.walk.resolution
        self._near_clip = 0.01 * min(self.walk.grid.size)

    def close(self) -> None:
        """Free what the GPU holds."""
        self._walks.close()
        self._scenes.close()

    def compare(self, cell: CellFile, views: int) -> Iterator[tuple[Tally, ComparedView | None]]:
        """Tallies of `views` views in a cell, one after the other, each with its pictures."""
        centre = np.array(cell.eyes[0])
        half = np.array(self.walk.grid.size) / 2
        shown = sorted(set(cell.quads.faces)) or list(faces.ALL)
        seed = zlib.crc32(cell_name(cell.cell).encode())
        for pose in poses(centre, half, shown, views, seed):
            tally = Tally()
            worst = self._view(cell, pose, 1, tally.walk, tally.floor)
            if pose.kind == "corner":
                tally.corner_walk.extend(tally.walk)
                tally.corner_floor.extend(tally.floor)
            self._view(cell, pose, 2, tally.fine_walk, tally.fine_floor)
            yield tally, worst

    def _view(
        self, cell: CellFile, pose: Pose, scale: int, walk: list[Figures], floor: list[Figures]
    ) -> ComparedView | None:
        """Compare one view, `scale` times as fine, adding to `walk` and `floor`."""
        x, y, z = (float(c) for c in pose.eye)
        view = View((x, y, z), pose.yaw, pose.pitch, FOV, scale * self._pixels, self._near_clip)
        near_field = NearField(cell.eyes[0], self.walk.near_field)
        full = shot(self._scenes.shoot(view, near_field))
        moved = shot(self._scenes.shoot(replace(view, jitter=(0.5, 0.5)), near_field))
        drawn = shot(self._walks.shoot(view, cell.cell))
        if (figures := compare(full, moved)) is not None:
            floor.append(figures)
        if (figures := compare(full, drawn)) is None:
            return None
        walk.append(figures)
        return ComparedView(cell.cell, pose, figures, full.rgb, drawn.rgb)

    def pop(self, cell: CellFile, neighbour: CellFile) -> Iterator[tuple[float, int]]:
        """FLIP between two neighbours at points of their common face, with numbers of pixels."""
        a, b = np.array(cell.eyes[0]), np.array(neighbour.eyes[0])
        half = np.array(self.walk.grid.size) / 2
        low, high = np.maximum(a - half, b - half), np.minimum(a + half, b + half)
        rng = np.random.default_rng(zlib.crc32(cell_name(cell.cell).encode()))
        for _ in range(POP_VIEWS):
            eye: NDArray[np.float64] = rng.uniform(np.minimum(low, high), np.maximum(low, high))
            x, y, z = (float(c) for c in eye)
            yaw, pitch = look(rng.normal(size=3) * (1, 0.25, 1))
            view = View((x, y, z), yaw, pitch, FOV, self._pixels, self._near_clip)
            first = shot(self._walks.shoot(view, cell.cell))
            second = shot(self._walks.shoot(view, neighbour.cell))
            far = first.far | second.far
            if far.any():
                yield mean_flip(first.rgb, second.rgb, far), int(far.sum())

    def cells(self) -> list[CellFile]:
        """The cells that are baked."""
        return list(self._walks.baked())


def neighbours(cells: list[CellFile]) -> Iterator[tuple[CellFile, CellFile]]:
    """Pairs of cells that share a face, each once."""
    by_index = {cell.cell: cell for cell in cells}
    for (i, j, k), cell in by_index.items():
        for other in ((i + 1, j, k), (i, j + 1, k), (i, j, k + 1)):
            if other in by_index:
                yield cell, by_index[other]


def verify(
    target: Path,
    views: int,
    progress: Progress | None = None,
    keep: int = 6,
    pixels: int | None = None,
) -> tuple[Json, list[ComparedView]]:
    """Figures of every baked cell and overall, and the `keep` views with most wrong pixels.

    `pixels` across a view are as many as a face has texels unless given. Raises
    NotFoundError where there is nothing to verify.
    """
    verifier = Verifier(target, pixels)
    try:
        cells = verifier.cells()
        if not cells:
            raise NotFoundError(f"No cell of {target} is baked yet; run farfield bake first.")
        tallies = {cell.cell: Tally() for cell in cells}
        worst: list[ComparedView] = []
        for number, cell in enumerate(cells):
            for tally, view in verifier.compare(cell, views):
                tallies[cell.cell].add(tally)
                if view is not None:
                    worst = sorted([*worst, view], key=lambda v: -v.figures.wrong)[:keep]
            if progress:
                progress(number + 1, len(cells))
        overall = Tally()
        for cell, other in neighbours(cells):
            pops = list(verifier.pop(cell, other))
            tallies[cell.cell].pops.extend(pops)
            tallies[other.cell].pops.extend(pops)
            overall.pops.extend(pops)
        for tally in tallies.values():
            overall.add(replace(tally, pops=[]))
        figures = {cell_name(index): tally.json() for index, tally in tallies.items()}
        return {"overall": overall.json(), "cells": figures}, worst
    finally:
        verifier.close()
