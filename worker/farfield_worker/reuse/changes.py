"""What differs between two prepared scenes, triangle by triangle.

Blocks are cut anew at every preparation, so a small edit moves the borders of many. What a triangle
is, does not depend on them: its corners with their normals, texture coordinates and colours, and
how its batch draws, pictures included. Scenes with different origins differ in all.
"""

from __future__ import annotations

import hashlib
import json
from typing import Any, NamedTuple

import numpy as np
from farfield_core.scene import PreparedScene
from numba import njit
from numpy.typing import NDArray

#: triangles hashed together
_PORTION = 1 << 18


class Changes(NamedTuple):
    """Triangles of either scene that the other does not have just so; both ascending, int64."""

    gone: NDArray[np.int64]
    come: NDArray[np.int64]


def changes(before: PreparedScene, after: PreparedScene) -> Changes:
    """Compare two scenes; of equal triangles there have to be equally many."""
    old, new = triangle_hashes(before), triangle_hashes(after)
    values, which = np.unique(np.concatenate([old, new]), return_inverse=True)
    first = np.bincount(which[: len(old)], minlength=len(values))
    second = np.bincount(which[len(old) :], minlength=len(values))
    differs = (first != second)[which]
    return Changes(np.flatnonzero(differs[: len(old)]), np.flatnonzero(differs[len(old) :]))


def triangle_hashes(scene: PreparedScene) -> NDArray[np.uint64]:
    """Hash of each triangle, (m,) uint64."""
    out = np.empty(len(scene.triangles), np.uint64)
    salts = _batch_hashes(scene)
    for block in scene.info.blocks:
        for part in block.parts:
            end = part.first_triangle + part.triangles
            for first in range(part.first_triangle, end, _PORTION):
                rows = slice(first, min(first + _PORTION, end))
                _hash(_words(scene, rows), salts[part.batch], out[rows])
    return out


def _words(scene: PreparedScene, rows: slice) -> NDArray[np.uint32]:
    """All that corners of triangles hold, (n, 24) uint32."""
    corners = np.asarray(scene.triangles[rows]).reshape(-1)
    low, high = int(corners.min()), int(corners.max()) + 1
    columns = []
    for array in (scene.positions, scene.normals, scene.uvs, scene.colors):
        words = np.ascontiguousarray(array[low:high]).view(np.uint32)
        columns.append(words[corners - low].reshape(len(corners) // 3, -1))
    return np.concatenate(columns, axis=1)


def _batch_hashes(scene: PreparedScene) -> NDArray[np.uint64]:
    """Hash of how each batch draws, (batches,) uint64."""
    info = scene.info
    pictures = [
        [
            texture.model_dump(mode="json", exclude={"file"}),
            hashlib.sha256((scene.folder / "textures" / texture.file).read_bytes()).hexdigest(),
        ]
        for texture in info.textures
    ]
    hashes = []
    for batch in info.batches:
        state: dict[str, Any] = batch.model_dump(mode="json")
        for name in ("texture", "emissive_texture"):
            if state[name] is not None:
                state[name] = pictures[state[name]]
        text = json.dumps([info.version, info.origin, state], sort_keys=True)
        hashes.append(int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "little"))
    return np.array(hashes, np.uint64)


@njit(cache=True)
def _hash(words: Any, salt: Any, out: Any) -> None:
    """Mix each row of words (n, w) uint32: Steele, Lea, Flood's SplitMix64 (2014), word by word."""
    for row in range(len(words)):
        h = salt
        for column in range(words.shape[1]):
            h = h ^ np.uint64(words[row, column])
            h += np.uint64(0x9E3779B97F4A7C15)
            h = (h ^ (h >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
            h = (h ^ (h >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
            h = h ^ (h >> np.uint64(31))
        out[row] = h
