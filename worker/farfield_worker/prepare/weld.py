"""Blocks in their final form: triangles in drawing order, vertices shared where nothing differs.

Inside a block triangles are sorted by batch, then along the Morton curve of their centroids
(Morton 1966), so that triangles near each other in space are near each other in the index buffer.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from farfield_worker.prepare.assembly import Assembly


@dataclass(frozen=True)
class Welded:
    """Vertices and triangles of consecutive blocks; arrays as in farfield_core.scene.

    Attributes:
        triangles: (t, 3) uint32, indices from the first vertex of these blocks.
        batch: (t,) int32.
        vertex_starts: (b + 1,) int64, first vertex of each block.
        instance: (t,) int32, of which instance each triangle is.
    """

    positions: NDArray[np.float32]
    normals: NDArray[np.int8]
    uvs: NDArray[np.float32]
    colors: NDArray[np.uint16]
    triangles: NDArray[np.uint32]
    batch: NDArray[np.int32]
    vertex_starts: NDArray[np.int64]
    instance: NDArray[np.int32]


def weld(
    assembly: Assembly,
    origin: NDArray[np.float64],
    double_sided: NDArray[np.bool_],
    order: NDArray[np.uint32],
    centroids: NDArray[np.float32],
    starts: NDArray[np.int64],
) -> Welded:
    """Sort and weld blocks.

    Args:
        assembly: the model.
        origin: (3,) float, subtracted from positions.
        double_sided: (batches,) bool.
        order: (t,) uint32, drawn triangles of these blocks; sorted in place.
        centroids: (t, 3) float32, in the same order as `order` came.
        starts: (b + 1,) int64, from 0, where each block begins in `order`.
    """
    a = assembly
    instance = np.searchsorted(a.drawn, order, side="right").astype(np.int32) - 1
    _sort(order, instance, centroids, a.batch[instance], starts)
    count = len(order)
    floats = np.empty((3 * count, 5), np.float32)
    packed = np.empty((3 * count, 12), np.uint8)
    triangles = np.empty((count, 3), np.uint32)
    vertex_starts = np.zeros(len(starts), np.int64)
    _weld(
        order, instance, starts, a.drawn, a.first, a.batch, a.linear, a.shift - origin, a.turned,
        double_sided, a.positions, a.normals, a.uvs, a.colors, a.corners,
        floats, floats.view(np.uint32), packed.view(np.int8), packed.view(np.uint16),
        packed.view(np.uint32), triangles, vertex_starts,
    )  # fmt: skip
    n = int(vertex_starts[-1])
    return Welded(
        np.ascontiguousarray(floats[:n, :3]),
        np.ascontiguousarray(packed.view(np.int8)[:n, :4]),
        np.ascontiguousarray(floats[:n, 3:]),
        np.ascontiguousarray(packed.view(np.uint16)[:n, 2:]),
        triangles,
        a.batch[instance],
        vertex_starts,
        instance,
    )


@numba.njit(cache=True, nogil=True)
def _spread(n) -> Any:  # type: ignore[no-untyped-def]
    # ten bits, two zeros after each
    n = (n | (n << 16)) & 0x030000FF
    n = (n | (n << 8)) & 0x0300F00F
    n = (n | (n << 4)) & 0x030C30C3
    return (n | (n << 2)) & 0x09249249


@numba.njit(cache=True, nogil=True)
def _sort(order, instance, centroids, batch, starts) -> None:  # type: ignore[no-untyped-def]
    for b in range(len(starts) - 1):
        low, high = starts[b], starts[b + 1]
        n = high - low
        least = np.full(3, np.inf, np.float64)
        most = np.full(3, -np.inf, np.float64)
        for i in range(low, high):
            for axis in range(3):
                least[axis] = min(least[axis], centroids[i, axis])
                most[axis] = max(most[axis], centroids[i, axis])
        side = max(most[0] - least[0], most[1] - least[1], most[2] - least[2])
        scale = 1023.0 / side if side > 0 else 0.0
        # 16 bits of batch, 30 of the curve, 16 of the place so that the sort is stable
        keys = np.empty(n, np.int64)
        for i in range(n):
            code = 0
            for axis in range(3):
                step = int((centroids[low + i, axis] - least[axis]) * scale)
                code |= _spread(step) << axis
            keys[i] = (np.int64(batch[low + i]) << 46) | (np.int64(code) << 16) | i
        keys.sort()
        new_order = np.empty(n, order.dtype)
        new_instance = np.empty(n, instance.dtype)
        for i in range(n):
            place = low + (keys[i] & 0xFFFF)
            new_order[i] = order[place]
            new_instance[i] = instance[place]
        order[low:high] = new_order
        instance[low:high] = new_instance


@numba.njit(cache=True, nogil=True)
def _weld(  # type: ignore[no-untyped-def]  # noqa: PLR0912, PLR0915
    order, instance, starts, drawn, first, batch, linear, shift, turned, double_sided,
    positions, normals, uvs, colors, corners,
    floats, float_bits, normal_bytes, color_shorts, packed_bits, triangles, vertex_starts,
) -> None:  # fmt: skip
    # open addressing; a slot holds vertex + 1 of the block that wrote it, and slots of earlier
    # blocks are recognised by their smaller vertex numbers
    size = 1 << 15
    largest = 0
    for b in range(len(starts) - 1):
        largest = max(largest, starts[b + 1] - starts[b])
    while size < 6 * largest:
        size *= 2
    table = np.zeros(size, np.int64)
    fresh = 0
    p = np.empty((3, 3))
    n = np.empty((3, 3))
    cof = np.empty((3, 3))
    last = -1
    for b in range(len(starts) - 1):
        block = fresh
        for i in range(starts[b], starts[b + 1]):
            k = instance[i]
            t = first[k] + np.int64(order[i]) - drawn[k]
            if k != last:
                # normals turn with the cofactors of the linear part, whatever its scale
                last = k
                m = linear[k]
                for r in range(3):
                    r1, r2 = (r + 1) % 3, (r + 2) % 3
                    for c in range(3):
                        c1, c2 = (c + 1) % 3, (c + 2) % 3
                        x = m[r1, c1] * m[r2, c2] - m[r1, c2] * m[r2, c1]
                        cof[r, c] = -x if turned[k] else x
            for c in range(3):
                # a mirrored mesh has its winding turned back
                v = corners[t, (3 - c) % 3 if turned[k] else c]
                for axis in range(3):
                    x = shift[k, axis]
                    y = 0.0
                    for j in range(3):
                        x += linear[k, axis, j] * positions[v, j]
                        y += cof[axis, j] * normals[v, j]
                    p[c, axis] = x
                    n[c, axis] = y
            fx = (p[1, 1] - p[0, 1]) * (p[2, 2] - p[0, 2]) - (p[1, 2] - p[0, 2]) * (
                p[2, 1] - p[0, 1]
            )
            fy = (p[1, 2] - p[0, 2]) * (p[2, 0] - p[0, 0]) - (p[1, 0] - p[0, 0]) * (
                p[2, 2] - p[0, 2]
            )
            fz = (p[1, 0] - p[0, 0]) * (p[2, 1] - p[0, 1]) - (p[1, 1] - p[0, 1]) * (
                p[2, 0] - p[0, 0]
            )
            length = np.sqrt(fx * fx + fy * fy + fz * fz)
            if length > 0:
                fx, fy, fz = fx / length, fy / length, fz / length
            else:
                fy = 1.0
            agree = 0.0
            for c in range(3):
                length = np.sqrt(n[c, 0] * n[c, 0] + n[c, 1] * n[c, 1] + n[c, 2] * n[c, 2])
                if length > 0:
                    n[c] /= length
                    agree += n[c, 0] * fx + n[c, 1] * fy + n[c, 2] * fz
                else:
                    n[c, 0], n[c, 1], n[c, 2] = fx, fy, fz
                    agree += 1.0
            flip = False
            if agree < 0:
                if double_sided[batch[k]]:
                    flip = True
                else:
                    n *= -1.0
            for c in range(3):
                d = (3 - c) % 3 if flip else c
                v = corners[t, (3 - d) % 3 if turned[k] else d]
                for axis in range(3):
                    floats[fresh, axis] = np.float32(p[d, axis]) + np.float32(0.0)
                    normal_bytes[fresh, axis] = np.int8(np.rint(n[d, axis] * 127.0))
                normal_bytes[fresh, 3] = 0
                floats[fresh, 3] = uvs[v, 0] + np.float32(0.0)
                floats[fresh, 4] = uvs[v, 1] + np.float32(0.0)
                for j in range(4):
                    color_shorts[fresh, 2 + j] = colors[v, j]
                # FNV-1a over words, then mixed
                key = np.uint64(14695981039346656037)
                for j in range(5):
                    key = (key ^ np.uint64(float_bits[fresh, j])) * np.uint64(1099511628211)
                for j in range(3):
                    key = (key ^ np.uint64(packed_bits[fresh, j])) * np.uint64(1099511628211)
                key ^= key >> np.uint64(29)
                slot = np.int64(key & np.uint64(size - 1))
                while True:
                    other = table[slot] - 1
                    if other < block:
                        table[slot] = fresh + 1
                        triangles[i, c] = fresh
                        fresh += 1
                        break
                    same = True
                    for j in range(5):
                        if float_bits[other, j] != float_bits[fresh, j]:
                            same = False
                    for j in range(3):
                        if packed_bits[other, j] != packed_bits[fresh, j]:
                            same = False
                    if same:
                        triangles[i, c] = other
                        break
                    slot = (slot + 1) & (size - 1)
        vertex_starts[b + 1] = fresh
