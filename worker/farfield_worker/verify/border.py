"""Where near polygons meet the far field: does background show through a surface there?

A pixel belongs to the border if the full render shows a surface there that lies within a small
share of the near field's half width from its border, and geometry all around. Such a pixel is a
crack if the walk shows background.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farfield_worker.shoot.scene import SceneShooter
from farfield_worker.shoot.view import NearField, View
from farfield_worker.verify.metrics import eroded

Mask = NDArray[np.bool_]

#: how far to both sides of the border, as a share of the near field's half width
WITHIN = 0.02


class Border(NamedTuple):
    """Pixels of one view at the near border, and those of them that are cracks: (h, w) bool."""

    pixels: Mask
    cracks: Mask


def border(scene: SceneShooter, view: View, near_field: NearField, geometry: Mask) -> Border:
    """Look for cracks in a walk that has `geometry` (h, w) where it shows no background."""
    centre, half_width = near_field
    inner, outer = (
        scene.shoot(view, NearField(centre, half_width * share))
        for share in (1.0 - WITHIN, 1.0 + WITHIN)
    )
    pixels = inner.far & ~outer.far & eroded(inner.rgba[..., 3] > 0)
    return Border(pixels, pixels & ~geometry)
