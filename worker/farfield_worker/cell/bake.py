"""The bake of one view cell (LEMI sections 3 to 5): place, render, compile, encode, near list."""

from __future__ import annotations

import hashlib
import resource
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

import numpy as np
from farfield_core import faces as face_axes
from farfield_core import layout, placement
from farfield_core.bake import settings_of
from farfield_core.cells import Index
from farfield_core.scene import PreparedScene
from farfield_core.settings import BakeSettings
from farfield_core.walk import CellFile, NearBlock, Walk
from numpy.typing import NDArray

from farfield_worker.compile.atlas import lay_out
from farfield_worker.compile.encode import ENCODERS
from farfield_worker.compile.layered import CompiledFace, Rules, compile_face, gutter_free
from farfield_worker.compile.pack import GUTTER
from farfield_worker.compile.quads import layer_quads
from farfield_worker.near import NearBlocks, near_list
from farfield_worker.render import Renderer, open_renderer

#: a steep surface may pass this many layers from texel to texel and is still filled (`gaps`)
REACH = 8


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
        self._renderer: Renderer = open_renderer(self.settings.renderer, scene)
        self._blocks = NearBlocks(scene, self._put)
        self._half = np.array(walk.grid.size) / 2
        self._rules = Rules(
            walk.layers,
            walk.resolution,
            REACH,
            self.settings.grower,
            gutter_free(min(walk.atlas.width, walk.atlas.height), GUTTER),
        )
        # One more layer inside the near field tells gap filling where surfaces come nearer still.
        inner = placement.place(
            self.settings.half_extents,
            walk.resolution,
            len(walk.layers) + 1,
            self.settings.alpha,
            self.settings.gap_texels,
        ).near_field
        self._borders = (*walk.borders, inner)

    def _put(self, key: str, data: bytes) -> None:
        self._store.put_new(key, data)

    @property
    def renderer(self) -> str:
        """Name of the GL device that draws."""
        return self._renderer.name

    def close(self) -> None:
        """Free what the renderer holds."""
        self._renderer.close()

    def bake(self, index: Index, centre: NDArray[np.float64]) -> CellFile:
        """Bake the cell `index` around `centre` (3,) and write its files, the cell's own last."""
        watch = Stopwatch()
        resolution, layers = self.walk.resolution, self.walk.layers
        compiled = {}
        for face in self._faces():
            with watch("render"):
                texels = self._renderer.face(centre, face, self._borders, resolution)
            with watch("compile"):
                if (texels.layer < len(layers)).any():
                    compiled[face] = compile_face(texels, self._rules, self._face_half(face))
        with watch("compile"):
            size = (self.walk.atlas.width, self.walk.atlas.height)
            boxes, places, pages = lay_out(compiled, resolution, size)
        with watch("encode"):
            suffix, encode = ENCODERS[self.walk.atlas.encoding]
            files = [encode(page) for page in pages]
            names = [hashlib.sha256(data).hexdigest()[:32] + suffix for data in files]
        for name, data in zip(names, files, strict=True):
            self._store.put_new(layout.atlas_key(name), data)
        with watch("near"):
            near = near_list(self._scene, centre, self.walk.near_field)
            blocks = tuple(
                NearBlock(blob=self._blocks.blob(part.block), ranges=part.ranges) for part in near
            )
        x, y, z = (float(c) for c in centre)
        cell = CellFile(
            cell=index,
            eyes=((x, y, z),),
            quads=layer_quads(boxes, places, layers),
            atlases=tuple(names),
            near=blocks,
            figures={
                "quads": len(boxes.face),
                "near_triangles": sum(part.triangles for part in near),
                "atlas_bytes": sum(len(data) for data in files),
                **texel_figures(compiled),
                **watch.figures(),
                "peak_megabytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
            },
        )
        text = cell.model_dump_json()
        self._store.put_new(layout.cell_key(self.walk.id, index), text.encode())
        return cell

    def _faces(self) -> tuple[int, ...]:
        return face_axes.SIDES if self.settings.faces == "sides" else face_axes.ALL

    def _face_half(self, face: int) -> tuple[float, float, float]:
        """Half extents of the cell along a face's right, down and forward."""
        _, right, down, forward = face_axes.FACES[face]
        across, along, depth = (float(np.abs(axis) @ self._half) for axis in (right, down, forward))
        return across, along, depth


def texel_figures(faces: dict[int, CompiledFace]) -> dict[str, float]:
    """Counts of texels at each stage, and how full the rectangles are."""
    stored = sum(len(face.texel) for face in faces.values())
    area = sum(int((face.boxes[:, 3] * face.boxes[:, 4]).sum()) for face in faces.values())
    return {
        "texels_rendered": sum(face.rendered for face in faces.values()),
        "texels_filled": sum(face.filled for face in faces.values()),
        "texels": stored,
        "fill": stored / area if area else 1.0,
    }


class Stopwatch:
    """Seconds spent on each kind of work."""

    def __init__(self) -> None:
        self._seconds: dict[str, float] = {}

    @contextmanager
    def __call__(self, kind: str) -> Iterator[None]:
        """Count the time of the block under `kind`."""
        start = time.perf_counter()
        yield
        self._seconds[kind] = self._seconds.get(kind, 0.0) + time.perf_counter() - start

    def figures(self) -> dict[str, float]:
        """Seconds of each kind as `seconds_<kind>`, and their sum as `seconds`."""
        out = {f"seconds_{kind}": spent for kind, spent in self._seconds.items()}
        return out | {"seconds": sum(self._seconds.values())}
