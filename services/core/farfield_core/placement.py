"""Layer placement in closed form (LEMI section 4.2, equations 1 and 2).

The paper steps from layer to border to layer by intersecting rays. With h the half extent of the
view cell along a face's normal, a and b its lateral half extents, and

    beta = atan(hypot(a, b) / h)      phi = pi/4 - beta/2      g(y) = y / (y - h),  g(inf) = 1

one step of equation (1) multiplies g by k, ln k = 4 atanh(tan(phi) tan(alpha/2)), and equation (2)
with a bound of t texels divides g by 1 - (t/R) 2h / (h + max(a, b)). Both are free of y, so in
ln g the layers are evenly spaced:

    layer 0 (the farthest)             ln g = ln k
    border after a layer               half a layer step further
    next layer                         min(2 ln k, the texel step) after the layer
    last border (the near field)       ln k after the last layer

A cube has one g for all faces. A box has one per pair of faces; its layers are still cubes, shared
by all faces so that they meet at the seams, and every step is the one of the most demanding face.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from farfield_core.errors import BadInputError
from farfield_core.faces import ALL


@dataclass(frozen=True)
class Placement:
    """Distances of layer and border planes from the cell's centre, metres, far to near.

    `borders[i]` bounds layer i on the near side, so `borders[-1]` is the near field's half width.
    Layer i draws geometry at distances in [borders[i], borders[i - 1]), layer 0 to infinity.
    """

    layers: tuple[float, ...]
    borders: tuple[float, ...]

    @property
    def near_field(self) -> float:
        """Half width of the near-field cube."""
        return self.borders[-1]


def default_alpha(resolution: int) -> float:
    """Angle of the central pixel of a 60 degree image `resolution` pixels across, radians."""
    return 2.0 * math.atan(math.tan(math.radians(30.0)) / resolution)


@dataclass(frozen=True)
class FaceMetric:
    """The scale ln g on which one face's steps are constant."""

    h: float
    ln_k: float
    ln_texel: float  # inf when no texel bound is wanted

    @classmethod
    def of(
        cls, h: float, a: float, b: float, alpha: float, resolution: int, gap_texels: float | None
    ) -> FaceMetric:
        """Metric of a face with half extent `h` along its normal and `a`, `b` across, metres."""
        phi = math.pi / 4 - math.atan(math.hypot(a, b) / h) / 2
        ln_k = 4.0 * math.atanh(math.tan(phi) * math.tan(alpha / 2))
        if gap_texels is None:
            return cls(h, ln_k, math.inf)
        shrink = gap_texels / resolution * 2 * h / (h + max(a, b))
        return cls(h, ln_k, -math.log1p(-shrink) if shrink < 1 else math.inf)

    @property
    def ln_layer(self) -> float:
        """Step from layer to layer."""
        return min(2.0 * self.ln_k, self.ln_texel)

    def ln_g(self, y: float) -> float:
        """Return ln g(y) = -ln(1 - h / y) for y in (h, inf]."""
        return -math.log1p(-self.h / y)

    def nearer(self, y: float, step: float) -> float:
        """Distance reached from `y` by going `step` nearer in ln g."""
        return self.h / -math.expm1(-(self.ln_g(y) + step))


def metrics(
    half_extents: Sequence[float],
    alpha: float,
    resolution: int,
    gap_texels: float | None = 1.0,
    faces: Sequence[int] = ALL,
) -> list[FaceMetric]:
    """Metrics of `faces` of a cell with `half_extents` (3,) metres.

    Raises BadInputError where the numbers allow no placement.
    """
    if len(half_extents) != 3 or not all(math.isfinite(e) and e > 0 for e in half_extents):
        raise BadInputError(
            "A cell needs three positive edge lengths; give --cell-size S or X,Y,Z."
        )
    if resolution < 2:
        raise BadInputError(f"A face of {resolution} texels is too small; use at least 2.")
    if not 0 < alpha < math.pi / 4:
        raise BadInputError(f"The parallax angle {alpha} must lie between 0 and pi/4 radians.")
    if gap_texels is not None and not gap_texels > 0:
        raise BadInputError("The gap bound must be a positive number of texels, or none.")
    axes = sorted({face // 2 for face in faces})
    if not axes:
        raise BadInputError("At least one face is needed.")
    out = []
    for axis in axes:
        a, b = (half_extents[i] for i in range(3) if i != axis)
        out.append(FaceMetric.of(half_extents[axis], a, b, alpha, resolution, gap_texels))
    return out


def place(
    half_extents: Sequence[float],
    resolution: int,
    layers: int,
    alpha: float | None = None,
    gap_texels: float | None = 1.0,
    faces: Sequence[int] = ALL,
) -> Placement:
    """Place `layers` layers around a cell of `half_extents` (3,) metres, far to near.

    Raises BadInputError where the numbers allow no placement.
    """
    if layers < 1:
        raise BadInputError("At least one layer is needed; use --layers 1 or more.")
    alpha = default_alpha(resolution) if alpha is None else alpha
    all_metrics = metrics(half_extents, alpha, resolution, gap_texels, faces)
    y = max(m.nearer(math.inf, m.ln_k) for m in all_metrics)
    ys, borders = [y], []
    while len(ys) < layers:
        border = max(m.nearer(y, m.ln_layer / 2) for m in all_metrics)
        # On a box the border need not lie halfway for every face; no step may pass ln k.
        y = max(max(m.nearer(y, m.ln_layer), m.nearer(border, m.ln_k)) for m in all_metrics)
        borders.append(border)
        ys.append(y)
    borders.append(max(m.nearer(y, m.ln_k) for m in all_metrics))
    return Placement(tuple(ys), tuple(borders))


def layers_across(
    near: float,
    half_extents: Sequence[float],
    resolution: int,
    alpha: float | None = None,
    gap_texels: float | None = 1.0,
) -> float:
    """Layers between infinity and a near field of `near` metres, in closed form, at least 1.

    Exact but for rounding up on a cube; on a box the number of the most demanding face.
    """
    alpha = default_alpha(resolution) if alpha is None else alpha
    return max(
        1.0,
        *(
            1.0 + (m.ln_g(near) - 2.0 * m.ln_k) / m.ln_layer
            for m in metrics(half_extents, alpha, resolution, gap_texels)
        ),
    )


def layers_for_near(
    near: float,
    half_extents: Sequence[float],
    resolution: int,
    alpha: float | None = None,
    gap_texels: float | None = 1.0,
    faces: Sequence[int] = ALL,
    most: int = 4096,
) -> int:
    """Smallest number of layers, up to `most`, whose near field is at most `near` metres.

    Raises BadInputError if `near` does not lie outside the cell, or needs more layers.
    """
    if near <= max(half_extents):
        raise BadInputError(
            f"A near field of {near:g} m does not reach outside the cell; "
            f"use more than {max(half_extents):g} m."
        )
    low, high = 0, 1
    while place(half_extents, resolution, high, alpha, gap_texels, faces).near_field > near:
        if high >= most:
            raise BadInputError(
                f"A near field of {near:g} m needs more than {most} layers; use a larger one."
            )
        low, high = high, min(2 * high, most)
    while high - low > 1:
        middle = (low + high) // 2
        if place(half_extents, resolution, middle, alpha, gap_texels, faces).near_field > near:
            low = middle
        else:
            high = middle
    return high
