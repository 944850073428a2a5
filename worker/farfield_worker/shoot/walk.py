"""Pictures of a walk, drawn from its files alone."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from farfield_core.cells import Index
from farfield_core.errors import FarfieldError, NotFoundError
from farfield_core.walk import CellFile

from farfield_worker.gl import context as gl
from farfield_worker.shoot.canvas import Canvas, camera
from farfield_worker.shoot.near import NearPolygons
from farfield_worker.shoot.quads import FarQuads
from farfield_worker.shoot.view import Picture, View
from farfield_worker.shoot.walk_files import Read, WalkFiles, read_folder

#: near clip where the view names none, as a share of the cell's shortest edge
NEAR_CLIP = 0.01


def find_walk(target: Path) -> Path:
    """The walk.json that `target` means: itself, one in that folder, or a store's only bake.

    Raises NotFoundError where there is none or more than one.
    """
    if target.is_file():
        return target
    if (target / "walk.json").is_file():
        return target / "walk.json"
    found = sorted(target.glob("bakes/*/walk.json"))
    if len(found) > 1:
        names = ", ".join(path.parent.name for path in found)
        raise NotFoundError(
            f"{target} holds several bakes ({names}); name one, as in bakes/{found[0].parent.name}."
        )
    if not found:
        raise NotFoundError(f"There is no walk in {target}; bake one with --out {target}.")
    return found[0]


class WalkShooter:
    """Draws pictures of a walk: near polygons first, then its quads front to back.

    `source` is a folder or walk.json (see `find_walk`), or a function that reads files named
    relative to walk.json. Create it in the process that uses it.
    """

    def __init__(self, source: Path | Read) -> None:
        read = read_folder(find_walk(source).parent) if isinstance(source, Path) else source
        self._files = WalkFiles(read)
        self.walk = self._files.walk
        self._light = {name: list(values) for name, values in self.walk.light.items()}
        self._cell: Index | None = None
        with gl.current() as context:
            self._canvas = Canvas(context, self._light)

    def shoot(self, view: View, cell: Index | None = None) -> Picture:
        """Draw one picture from `cell`, or else from the existing cell nearest to the eye.

        Raises NotFoundError where a cell or one of its files does not exist.
        """
        with gl.current():
            self._load(view, cell)
            eye = np.asarray(view.eye, np.float64) - self._centre
            uniforms = camera(view, NEAR_CLIP * min(self.walk.grid.size))
            self._canvas.begin(view)
            self._near.draw(uniforms, eye, self.walk.near_drawn)
            self._quads.draw(uniforms, eye)
            return self._canvas.end()

    def baked(self) -> Iterator[CellFile]:
        """Every cell that exists, from the walk's start on."""
        return self._files.baked()

    def _load(self, view: View, wanted: Index | None) -> None:
        """Make the cell to draw the loaded one."""
        nearest = self._files.nearest(np.asarray(view.eye, np.float64))
        for index in nearest if wanted is None else iter([wanted]):
            if index == self._cell:
                return
            try:
                file = self._files.cell(index)
            except NotFoundError:
                if wanted is not None:
                    raise
                continue
            self._release_cell()
            self._open_cell(file)
            return
        raise NotFoundError(f"No cell of the walk {self.walk.id} is baked yet.")

    def _open_cell(self, file: CellFile) -> None:
        context = gl.shared()
        self._centre = np.array(file.eyes[0], np.float64)
        quads = FarQuads(context, file, self.walk, self._files.atlas)
        try:
            self._near = NearPolygons(
                context, file.near, self._files.near, self._centre, self._light
            )
        except FarfieldError:
            quads.release()
            raise
        self._quads = quads
        self._cell = file.cell

    def _release_cell(self) -> None:
        if self._cell is not None:
            self._near.release()
            self._quads.release()
            self._cell = None

    def close(self) -> None:
        """Free what the GPU holds."""
        with gl.current():
            self._release_cell()
            self._canvas.release()
