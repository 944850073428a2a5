"""The bake of one view cell: impostors, layered or slanted, near list, files."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np
from farfield_core import layout
from farfield_core.bake import settings_of
from farfield_core.cells import Index
from farfield_core.memory import peak_bytes
from farfield_core.scene import PreparedScene
from farfield_core.settings import BakeSettings
from farfield_core.walk import CellFile, NearBlock, Walk
from numpy.typing import NDArray

from farfield_worker.cell.impostors import ImpostorMaker, Stopwatch
from farfield_worker.cell.layered import LayeredImpostors
from farfield_worker.cell.slanted import SlantedImpostors
from farfield_worker.cell.version import VERSION
from farfield_worker.compile.encode import ENCODERS
from farfield_worker.near import NearBlocks, near_list, near_triangles
from farfield_worker.visibility.near_maps import NearMapRenderer
from farfield_worker.visibility.near_triangles import NearTriangles
from farfield_worker.visibility.sampling import EFFORTS, Watcher, map_resolution, sample

#: what makes the quads of each setting of `quads`
MAKERS: dict[str, Callable[[PreparedScene, Walk, BakeSettings], ImpostorMaker]] = {
    "layers": LayeredImpostors,
    "slanted": SlantedImpostors,
}


class Sink(Protocol):
    """Where a cell's files go: `farfield_core.store.Store`."""

    def put_new(self, key: str, data: bytes) -> bool:
        """Create an object; False if it was there already."""
        ...


class CellBaker:
    """Bakes cells of one walk. Create it in the process that bakes: it owns a GL context."""

    def __init__(self, scene: PreparedScene, walk: Walk, store: Sink) -> None:
        self.walk = walk
        self.settings: BakeSettings = settings_of(walk)
        self._scene, self._store = scene, store
        self._maker: ImpostorMaker = MAKERS[self.settings.quads](scene, walk, self.settings)
        self._blocks = NearBlocks(scene, self._put)
        self._maps: NearMapRenderer | None = None
        if self.settings.visibility != "off":
            effort = EFFORTS[self.settings.visibility]
            self._maps = NearMapRenderer(scene, map_resolution(effort, walk.resolution))

    def _put(self, key: str, data: bytes) -> None:
        self._store.put_new(key, data)

    @property
    def renderer(self) -> str:
        """Name of the GL device that draws."""
        return self._maker.name

    def close(self) -> None:
        """Free what the renderers hold."""
        self._maker.close()
        if self._maps is not None:
            self._maps.close()

    def bake(self, index: Index, centre: NDArray[np.float64]) -> CellFile:
        """Bake the cell `index` around `centre` (3,) and write its files, the cell's own last."""
        watch = Stopwatch()
        with watch("near"):
            inside = near_triangles(self._scene, centre, self.walk.near_drawn)
        shown, look, eyes = inside, None, 0
        if self._maps is not None:
            near = NearTriangles(self._scene, inside, centre, self.walk.near_drawn)

            def look(watchers: Sequence[Watcher]) -> None:
                nonlocal eyes
                eyes = self._look(centre, [near, *watchers])

        impostors = self._maker.make(centre, watch, look)
        if self._maps is not None:
            shown = inside[near.seen]
        with watch("encode"):
            suffix, encode = ENCODERS[self.walk.atlas.encoding]
            files = [encode(page) for page in impostors.pages]
            names = [hashlib.sha256(data).hexdigest()[:32] + suffix for data in files]
        for name, data in zip(names, files, strict=True):
            self._store.put_new(layout.atlas_key(name), data)
        with watch("near"):
            listed = near_list(self._scene, shown)
            blocks = tuple(
                NearBlock(blob=self._blocks.blob(part.block), ranges=part.ranges) for part in listed
            )
        cell = CellFile(
            cell=index,
            eyes=impostors.eyes,
            quads=impostors.quads,
            atlases=tuple(names),
            near=blocks,
            figures={
                "quads": len(impostors.quads.faces),
                "near_triangles": sum(part.triangles for part in listed),
                "near_triangles_inside": len(inside),
                "eyes": eyes,
                "baker": VERSION,
                "atlas_bytes": sum(len(data) for data in files),
                **impostors.figures,
                **watch.figures(),
                "peak_megabytes": peak_bytes() / 2**20,
            },
        )
        text = cell.model_dump_json()
        self._store.put_new(layout.cell_key(self.walk.id, index), text.encode())
        return cell

    def _look(self, centre: NDArray[np.float64], watchers: Sequence[Watcher]) -> int:
        """Show the cell around `centre` (3,) to `watchers`; returns the number of eyes."""
        assert self._maps is not None
        assert self.settings.visibility != "off"
        return sample(
            self._maps,
            centre,
            np.array(self.walk.grid.size) / 2,
            self.walk.near_drawn,
            EFFORTS[self.settings.visibility],
            watchers,
        )
