"""Meshes that repeat: which instances are copies of one shape, moved, turned and scaled evenly.

A model's own instances say what repeats: a mesh that several nodes name. Copies that are mirrored
or stretched against the first are none, since a true impostor can be neither.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from farfield_core.scene import Batch
from numpy.typing import NDArray

from farfield_worker.prepare.assembly import Assembly
from farfield_worker.prepare.model import Model

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: copies, and triangles of each, that are worth a shape of their own
FEWEST_COPIES, FEWEST_TRIANGLES = 8, 500
#: most shapes of a scene
MOST_SHAPES = 16
#: an even scale may differ by this share along the axes
EVEN = 1e-3


class Copies(NamedTuple):
    """The copies of all shapes.

    Attributes:
        owner: (k,) int32, for each instance of the assembly the copy it is part of, -1: none.
        shape: (n,) int64, of which shape each copy is.
        places: (n, 4) float64, where each stands in scene coordinates, and its scale.
        turns: (n, 4) float64, unit quaternions x, y, z, w.
        first: (s,) int64, the copy of each shape with scale 1 that is not turned.
    """

    owner: NDArray[np.int32]
    shape: Ints
    places: Floats
    turns: Floats
    first: Ints


def find_copies(model: Model, assembly: Assembly, batches: Sequence[Batch]) -> Copies | None:
    """Copies in a model of which enough repeats; None if nothing does."""
    if model.copies is None or model.shapes is None:
        return None
    drawn = np.diff(assembly.drawn)
    rows = np.flatnonzero((model.copies >= 0) & (drawn > 0))
    if len(rows) == 0:
        return None
    number, head = np.unique(model.copies[rows], return_index=True)
    part_of = np.searchsorted(number, model.copies[rows])
    triangles = np.bincount(part_of, drawn[rows]).astype(np.int64)
    plain = np.array([_is_plain(batch) for batch in batches], np.bool_)
    plain_copy = np.bincount(part_of, ~plain[assembly.batch[rows]]) == 0
    shape = model.shapes[rows[head]]

    found: list[tuple[Ints, Floats, Floats]] = []
    for members in _candidates(shape, triangles, plain_copy):
        linear = assembly.linear[rows[head[members]]]
        even, scale, turn = similarities(linear @ np.linalg.inv(linear[0]))
        if even.sum() < FEWEST_COPIES:
            continue
        shift = assembly.shift[rows[head[members]]]
        places = np.concatenate([shift, scale[:, None]], axis=1)
        found.append((members[even], places[even], turn[even]))
    if not found:
        return None
    counts = [len(members) for members, _, _ in found]
    new = np.full(len(number), -1, np.int32)
    new[np.concatenate([members for members, _, _ in found])] = np.arange(sum(counts))
    owner = np.full(len(model.placed), -1, np.int32)
    owner[rows] = new[part_of]
    return Copies(
        owner,
        np.repeat(np.arange(len(found)), counts),
        np.concatenate([places for _, places, _ in found]),
        np.concatenate([turns for _, _, turns in found]),
        np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.int64),
    )


def _candidates(shape: NDArray[np.int32], triangles: Ints, plain: NDArray[np.bool_]) -> list[Ints]:
    """Copies of each shape worth it, (c,) each, the shape with most triangles first."""
    order = np.argsort(shape, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(shape[order])) + 1)
    out = []
    for group in groups:
        # What lost a part on the way is no copy.
        members = group[plain[group] & (triangles[group] == triangles[group[0]])]
        if len(members) >= FEWEST_COPIES and triangles[members[0]] >= FEWEST_TRIANGLES:
            out.append(members)
    out.sort(key=lambda members: -len(members) * int(triangles[members[0]]))
    return out[:MOST_SHAPES]


def _is_plain(batch: Batch) -> bool:
    """Whether a true impostor can draw it: lit, and not screened."""
    return not batch.unlit and batch.alpha != "dither" and not any(batch.emissive)


def similarities(linear: Floats) -> tuple[NDArray[np.bool_], Floats, Floats]:
    """Which of (n, 3, 3) maps turn and scale evenly, (n,); scales (n,), unit quaternions (n, 4).

    Quaternions are the eigenvectors of Bar-Itzhack, "New method for extracting the quaternion from
    a rotation matrix" (2000).
    """
    square = linear.transpose(0, 2, 1) @ linear
    scale = np.sqrt(np.trace(square, axis1=1, axis2=2) / 3)
    safe = np.where(scale > 0, scale, 1.0)
    m = linear / safe[:, None, None]
    off = np.abs(square / safe[:, None, None] ** 2 - np.eye(3)).max(axis=(1, 2))
    even = (scale > 0) & (off <= 2 * EVEN) & (np.linalg.det(m) > 0)
    k = np.empty((len(m), 4, 4))
    xx, yy, zz = m[:, 0, 0], m[:, 1, 1], m[:, 2, 2]
    k[:, 0, 0], k[:, 1, 1], k[:, 2, 2] = xx - yy - zz, yy - xx - zz, zz - xx - yy
    k[:, 3, 3] = xx + yy + zz
    for a, b, value in (
        (0, 1, m[:, 1, 0] + m[:, 0, 1]),
        (0, 2, m[:, 2, 0] + m[:, 0, 2]),
        (1, 2, m[:, 2, 1] + m[:, 1, 2]),
        (0, 3, m[:, 2, 1] - m[:, 1, 2]),
        (1, 3, m[:, 0, 2] - m[:, 2, 0]),
        (2, 3, m[:, 1, 0] - m[:, 0, 1]),
    ):
        k[:, a, b] = k[:, b, a] = value
    return even, scale, np.linalg.eigh(k)[1][:, :, 3]
