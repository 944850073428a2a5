"""Hidden texels: those that no eye in the view cell can see (LEMI section 5).

Seen from an eye at (ex, ey) across and ez along a face's axis, the point u of layer i lies on the
nearer layer j at u + s (ex - ez u), s = (y_i - y_j) / (y_j (y_i - ez)): at most `shift` texels away
for any eye in the cell and any u. A texel of layer i is therefore hidden if every texel within that
distance is covered on layer i + 1. The paper asks for the 3x3 neighbourhood, its shift being one
texel.

"Covered" may itself mean hidden: a texel of layer i + 1 that is not there, but behind which no eye
can look, hides as well as one that is there. So with A the texels and H the hidden positions,

    H[N - 1] = nothing        H[i] = erode(A[i + 1] or H[i + 1])

and the texels A[i] and H[i] can go. Whatever hides a texel is there or is hidden in its turn, from
the same eye and by something nearer, so all of them can go at once. A face's edge hides nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from farfield_worker.compile import bitplanes
from farfield_worker.compile.bitplanes import Planes


def shift(
    far: float, near: float, half: tuple[float, float, float], resolution: int
) -> tuple[float, float]:
    """Largest shift between planes at distances `far` > `near`, in texels: (across, down).

    `half` are the cell's half extents in the face's axes (right, down, forward), metres.
    """
    across, down, along = half
    scale = resolution / 2 * (far - near) / (near * (far - along))
    return scale * (across + along), scale * (down + along)


def reaches(
    layers: Sequence[float], half: tuple[float, float, float], resolution: int
) -> list[tuple[int, int]]:
    """Whole texels (across, down) by which layer i and layer i + 1 may shift, for each i."""
    out = []
    for far, near in pairwise(layers):
        across, down = shift(far, near, half, resolution)
        # The placement makes the shift one texel up to rounding.
        out.append((math.ceil(across - 1e-6), math.ceil(down - 1e-6)))
    return out


def hidden(planes: Planes, reach: Sequence[tuple[int, int]]) -> Planes:
    """Positions that nothing can be seen at: (N, R, words) uint64, like `planes`.

    `reach[i]` is the shift between layers i and i + 1 in whole texels, (across, down).
    """
    out = bitplanes.empty(planes.shape[0], planes.shape[1])
    for i in range(planes.shape[0] - 2, -1, -1):
        across, down = reach[i]
        out[i] = bitplanes.erode(planes[i + 1] | out[i + 1], down, across)
    return out
