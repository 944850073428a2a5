"""What is promised of a cell's slanted quads, checked by brute force."""

import numpy as np
from farfield_worker.slanted.baker import SlantedCell, SlantedSettings
from farfield_worker.slanted.quads import texel_points, texel_uv
from farfield_worker.slanted.residual import EyeQuads
from farfield_worker.slanted.tolerance import Tolerance
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def drawn_texels(
    part: EyeQuads, resolution: int
) -> tuple[NDArray[np.int32], NDArray[np.bool_], Floats, Floats]:
    """Texel, whether filled, true and drawn disparity of everything a part draws."""
    texels, sheets = part.quads.texels, part.quads.sheets
    sheet = np.repeat(np.arange(len(sheets.rect)), np.diff(texels.starts))
    u, v = texel_uv(texels.texel, resolution)
    a, b, c = sheets.plane[sheet].T
    return texels.texel, texels.filled, part.quads.disparity[texels.fragment], a * u + b * v + c


def check_tolerances(cell: SlantedCell, settings: SlantedSettings) -> None:
    """Captured texels lie within the exact tolerance, filled ones within two."""
    for part in cell.parts:
        _, filled, true, drawn = drawn_texels(part, settings.resolution)
        tolerance = Tolerance.of(
            part.face,
            part.eye,
            settings.half_extents,
            settings.alpha,
            settings.near,
            settings.tolerance,
        )
        for mask, times in ((~filled, 1.0), (filled, 2.0)):
            low, high = tolerance.interval(true[mask], times)
            assert np.all((low <= drawn[mask]) & (drawn[mask] <= high))


def check_angles(cell: SlantedCell, settings: SlantedSettings, every: int) -> None:
    """No eye of a lattice sees a captured point off by more than the parallax bound.

    Looks at every `every`th texel.
    """
    steps = [np.linspace(-h, h, 5) for h in settings.half_extents]
    eyes = np.stack(np.meshgrid(*steps), axis=-1).reshape(-1, 3)
    for part in cell.parts:
        texel, filled, true, drawn = drawn_texels(part, settings.resolution)
        keep = np.flatnonzero(~filled)[::every]
        p = part.eye + texel_points(part.face, texel[keep], true[keep], settings.resolution)
        # drawn where it lies, or on the near border where the plane dips inside
        ray = texel_points(part.face, texel[keep], np.ones(len(keep)), settings.resolution)
        walls = (settings.near - np.sign(ray) * part.eye) / np.maximum(np.abs(ray), 1e-12)
        q = part.eye + ray * np.maximum(1 / drawn[keep], walls.min(axis=1))[:, None]
        for eye in eyes:
            across = np.linalg.norm(np.cross(p - eye, q - eye), axis=1)
            angle = np.arctan2(across, np.einsum("ij,ij->i", p - eye, q - eye))
            assert np.all(angle <= settings.alpha)


def check_order(cell: SlantedCell, settings: SlantedSettings) -> None:
    """Of two fragments of one texel in different sheets the nearer one lies on the nearer plane."""
    for part in cell.parts:
        sheets = part.quads.sheets
        own = np.flatnonzero(sheets.owner >= 0)
        texel, owner = part.quads.texel[own], sheets.owner[own]
        u, v = texel_uv(texel, settings.resolution)
        a, b, c = sheets.plane[owner].T
        drawn = a * u + b * v + c
        pairs = np.flatnonzero((np.diff(texel) == 0) & (np.diff(owner) != 0))
        assert np.all(drawn[pairs] >= drawn[pairs + 1])
