"""From a model file to a prepared scene (farfield_core.scene)."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Literal

import numpy as np
from farfield_core.scene import Batch, Block, Bounds, Part, SceneInfo, Triple, map_scene
from numpy.typing import NDArray

from farfield_worker.objects.shapes import bake_shapes
from farfield_worker.prepare.arrays import GrowingArray
from farfield_worker.prepare.assembly import Assembly, assemble
from farfield_worker.prepare.batches import TextureFiles, sort_into_batches
from farfield_worker.prepare.clean import clean
from farfield_worker.prepare.expand import bounds, centroids
from farfield_worker.prepare.limits import Limits, refuse
from farfield_worker.prepare.orientation import guess_orientation, upright_matrix
from farfield_worker.prepare.pictures import draw_pictures
from farfield_worker.prepare.read import read_model
from farfield_worker.prepare.repeats import Copies, find_copies
from farfield_worker.prepare.split import split
from farfield_worker.prepare.weld import Welded, weld

Progress = Callable[[str], None]

#: blocks welded at a time; bounds the memory of the expansion
_CHUNK = 64
#: coordinates beyond this lose too much in single precision to show anything
_FARTHEST = 1e12


def prepare(
    source: Path,
    out: Path,
    scene_id: str,
    name: str,
    limits: Limits | None = None,
    progress: Progress = lambda line: None,
    pictures: bool = True,
    up: Literal["y", "z"] = "y",
    scale: float = 1.0,
    repeats: bool = True,
) -> SceneInfo:
    """Prepare the model at `source` into the folder `out`, replacing what is there.

    `up` is the axis of the model's own coordinates that points up, `scale` the metres in one of
    their units.

    With `repeats` objects of which there are many copies are baked as true impostors.
    Nothing is visible under `out` before everything is. With `pictures` it draws the map and the
    thumbnail, which creates a GL context in this process. Raises SceneRefusedError for files that
    cannot be read, whatever is wrong with them.
    """
    limits = limits or Limits()
    out.parent.mkdir(parents=True, exist_ok=True)
    work = Path(tempfile.mkdtemp(prefix=f".{out.name}-", dir=out.parent))
    try:
        work.chmod(0o755)
        upright = upright_matrix(up, scale)
        info = _prepare(source, work, scene_id, name, limits, progress, pictures, upright, repeats)
        if out.exists():
            shutil.rmtree(out)
        work.rename(out)
    except MemoryError:
        refuse(source.name, "it needs more memory than there is")
    finally:
        shutil.rmtree(work, ignore_errors=True)
    return info


def _prepare(
    source: Path,
    work: Path,
    scene_id: str,
    name: str,
    limits: Limits,
    progress: Progress,
    pictures: bool,
    upright: NDArray[np.float64],
    repeats: bool,
) -> SceneInfo:
    info = _convert(source, work, scene_id, name, limits, progress, upright, repeats)
    if pictures:
        progress("drawing the map")
        view = draw_pictures(map_scene(work, info), work)
        notes = info.notes
        if view is None:
            notes += ("There is no map and no thumbnail: this machine offers no OpenGL.",)
        info = info.model_copy(update={"map": view, "notes": notes})
    (work / "scene.json").write_text(info.model_dump_json(), encoding="utf-8")
    return info


def _convert(
    source: Path,
    work: Path,
    scene_id: str,
    name: str,
    limits: Limits,
    progress: Progress,
    upright: NDArray[np.float64],
    repeats: bool,
) -> SceneInfo:
    """Write everything but the pictures and scene.json."""
    progress("reading")
    model = read_model(source, limits)
    if not np.isfinite(model.matrices).all():
        refuse(source.name, "a transform is not a number")
    model.matrices = upright @ model.matrices
    clean(model)
    (work / "textures").mkdir()
    files = TextureFiles(work / "textures", model.notes)
    batches, looks = sort_into_batches(model, files)
    assembly = assemble(model, looks)
    if assembly.triangles == 0:
        refuse(source.name, "it holds no triangles")
    if assembly.triangles > limits.triangles:
        refuse(source.name, f"it has more than {limits.triangles} triangles")

    progress(f"sorting {assembly.triangles} triangles")
    low, high = bounds(assembly)
    if not (np.abs(low).max() < _FARTHEST and np.abs(high).max() < _FARTHEST):
        refuse(source.name, "its coordinates are too large")
    said = not np.array_equal(upright, np.eye(4))
    suspected = None if said else guess_orientation(assembly, low, high, source.suffix)
    origin = np.rint((low + high) / 2) + 0.0
    points = centroids(assembly, origin)
    order, starts = split(points)
    progress(f"writing {len(starts) - 1} blocks")
    copies = find_copies(model, assembly, batches) if repeats else None
    blocks, vertices = _write(work, assembly, origin, batches, points, order, starts, copies)
    info = SceneInfo(
        id=scene_id,
        name=name,
        bounds=Bounds(min=_triple(low), max=_triple(high)),
        origin=_triple(origin),
        triangles=assembly.triangles,
        vertices=vertices,
        textures=tuple(files.entries),
        batches=tuple(batches),
        blocks=tuple(blocks),
        notes=tuple(model.notes),
        suspected=suspected,
    )
    if copies is not None:
        progress(f"baking {len(copies.first)} objects that repeat")
        bake_shapes(map_scene(work, info), copies)
    return info


def _write(
    work: Path,
    assembly: Assembly,
    origin: NDArray[np.float64],
    batches: list[Batch],
    points: NDArray[np.float32],
    order: NDArray[np.uint32],
    starts: NDArray[np.int64],
    copies: Copies | None,
) -> tuple[list[Block], int]:
    files = {
        "positions": GrowingArray(work / "positions.npy", np.float32, 3),
        "normals": GrowingArray(work / "normals.npy", np.int8, 4),
        "uvs": GrowingArray(work / "uvs.npy", np.float32, 2),
        "colors": GrowingArray(work / "colors.npy", np.uint16, 4),
        "triangles": GrowingArray(work / "triangles.npy", np.uint32, 3),
    }
    if copies is not None:
        files["owners"] = GrowingArray(work / "owners.npy", np.int32, 1)
    double_sided = np.array([batch.double_sided for batch in batches], np.bool_)
    blocks: list[Block] = []
    vertices = 0
    for at in range(0, len(starts) - 1, _CHUNK):
        chunk = starts[at : at + _CHUNK + 1]
        rows = slice(int(chunk[0]), int(chunk[-1]))
        welded = weld(assembly, origin, double_sided, order[rows], points[rows], chunk - chunk[0])
        blocks += _describe(welded, chunk, vertices)
        welded.triangles[...] += np.uint32(vertices)
        for name, file in files.items():
            if name == "owners":
                assert copies is not None
                file.append(copies.owner[welded.instance][:, None])
            else:
                file.append(getattr(welded, name))
        vertices += len(welded.positions)
    for file in files.values():
        file.close()
    return blocks, vertices


def _describe(welded: Welded, starts: NDArray[np.int64], vertices: int) -> list[Block]:
    blocks = []
    for b in range(len(starts) - 1):
        low, high = (int(n) for n in welded.vertex_starts[b : b + 2])
        first, last = (int(n) for n in starts[b : b + 2] - starts[0])
        batch = welded.batch[first:last]
        cuts = [0, *(np.flatnonzero(np.diff(batch)) + 1).tolist(), last - first]
        parts = tuple(
            Part(
                batch=int(batch[cuts[n]]),
                first_triangle=int(starts[b]) + cuts[n],
                triangles=cuts[n + 1] - cuts[n],
            )
            for n in range(len(cuts) - 1)
        )
        positions = welded.positions[low:high]
        blocks.append(
            Block(
                low=_triple(positions.min(axis=0)),
                high=_triple(positions.max(axis=0)),
                first_vertex=vertices + low,
                vertices=high - low,
                parts=parts,
            )
        )
    return blocks


def _triple(point: NDArray[np.floating]) -> Triple:
    x, y, z = (float(n) for n in point)
    return (x, y, z)
