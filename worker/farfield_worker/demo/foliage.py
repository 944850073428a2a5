"""The foliage atlas: leaves stamped one by one into eight pictures with transparent ground."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from farfield_worker.demo.hashing import Dice
from farfield_worker.demo.looks import Rgb

Image = NDArray[np.uint8]
Canvas = NDArray[np.float64]

WIDTH, HEIGHT = 128, 256
COLUMNS, ROWS = 4, 2
(WILLOW_TWIG, WILLOW, ROUND_TREE, FROND, CORN, FLOWERS, BROAD_TWIG, REED) = range(8)

# leaf: x, y in pixels, rows down; dx, dy half axis; half width; colour
Leaf = tuple[float, float, float, float, float, Rgb]


def picture_uv(picture: int) -> tuple[float, float, float, float]:
    """U at the left and right and v at the bottom and top of a picture, inside a margin."""
    c, r = picture % COLUMNS, picture // COLUMNS
    m, n = 1.5 / (WIDTH * COLUMNS), 1.5 / (HEIGHT * ROWS)
    return (
        c / COLUMNS + m,
        (c + 1) / COLUMNS - m,
        (r + 1) / ROWS - n,
        r / ROWS + n,
    )


def foliage() -> Image:
    """The texture, (512, 512, 4) uint8."""
    pictures = (_willow_twig, _willow, _round_tree, _frond, _corn, _flowers, _broad_twig, _reed)
    out = np.zeros((HEIGHT * ROWS, WIDTH * COLUMNS, 4), np.uint8)
    for k, leaves in enumerate(pictures):
        canvas = np.zeros((HEIGHT, WIDTH, 4))
        dice = Dice(7000 + k)
        for leaf in leaves(dice):
            _stamp(canvas, leaf)
        r, c = k // COLUMNS * HEIGHT, k % COLUMNS * WIDTH
        out[r : r + HEIGHT, c : c + WIDTH] = _finish(canvas)
    return out


def _stamp(canvas: Canvas, leaf: Leaf) -> None:
    x, y, dx, dy, width, color = leaf
    reach = max(abs(dx), abs(dy)) + width + 2
    x0, x1 = max(int(x - reach), 2), min(int(x + reach) + 2, WIDTH - 2)
    y0, y1 = max(int(y - reach), 2), min(int(y + reach) + 2, HEIGHT - 2)
    if x0 >= x1 or y0 >= y1:
        return
    px = np.arange(x0, x1)[None] + 0.5 - x
    py = np.arange(y0, y1)[:, None] + 0.5 - y
    length = (dx * dx + dy * dy) ** 0.5
    along = (px * dx + py * dy) / (length * length)
    across = (px * dy - py * dx) / length
    # pointed at both ends; a lighter rib in the middle
    half = width * np.maximum(1 - along * along, 0)
    cover = np.clip(half - np.abs(across) + 0.5, 0, 1) * (np.abs(along) < 1)
    light = 1.0 + 0.18 * (np.abs(across) < 0.6) - 0.12 * (across > 0)
    area = canvas[y0:y1, x0:x1]
    area[..., :3] += (np.array(color) * light[..., None] - area[..., :3]) * cover[..., None]
    area[..., 3] = np.maximum(area[..., 3], cover)


def _finish(canvas: Canvas) -> Image:
    """Colour runs on under transparent texels, so that no fringe shows."""
    color, alpha = canvas[..., :3], canvas[..., 3]
    solid = alpha > 0.5
    mean = color[solid].sum(axis=0) / max(int(solid.sum()), 1)
    filled = np.where(solid[..., None], color, 0.0)
    weight = solid.astype(np.float64)
    for _ in range(6):
        total, count = filled * weight[..., None], weight.copy()
        for axis in (0, 1):
            for step in (-1, 1):
                total = total + np.roll(filled * weight[..., None], step, axis=axis)
                count = count + np.roll(weight, step, axis=axis)
        grown = (weight == 0) & (count > 0)
        filled = np.where(grown[..., None], total / np.maximum(count, 1)[..., None], filled)
        weight = np.where(grown, 1.0, weight)
    filled = np.where(weight[..., None] > 0, filled, mean)
    out = np.concatenate([filled, alpha[..., None]], axis=2)
    return np.asarray(np.rint(np.clip(out, 0, 1) * 255).astype(np.uint8))


def _green(dice: Dice, depth: float = 0.0, warm: float = 0.0) -> Rgb:
    """A leaf's colour; `depth` 0 lies in front, 1 deep inside."""
    light = (1 - 0.45 * depth) * dice.between(0.8, 1.15)
    return (0.36 + warm) * light, 0.52 * light, 0.2 * light


_BARK = (0.36, 0.28, 0.2)


def _willow_twig(dice: Dice) -> Iterator[Leaf]:
    """Slender shoots that rise and bend over."""
    for k in range(9):
        x, y = WIDTH / 2 + dice.between(-14, 14), HEIGHT - 8.0
        lean = (k - 4) * 0.085 + dice.between(-0.05, 0.05)
        for s in range(24):
            x += lean * 10 + dice.between(-1.5, 1.5)
            y -= 9.6
            lean *= 1.03
            for side in (-1, 1):
                dx = side * dice.between(7, 13)
                dy = dice.between(-11, 5)
                color = _green(dice, 0.6 * (1 - s / 24), 0.03)
                yield x + dx * 0.7, y + dy * 0.7, dx, dy, dice.between(2.6, 3.8), color


def _willow(dice: Dice) -> Iterator[Leaf]:
    """A whole tall willow."""
    yield WIDTH / 2, HEIGHT - 24, 0.0, 30.0, 5.0, _BARK
    for k in range(900):
        t = k / 900
        y = HEIGHT - 22 - dice.between(0, 1) * 222
        h = (HEIGHT - 22 - y) / 222
        reach = 44 * min(1.0, 0.35 + 2.4 * h) * min(1.0, 2.1 * (1.04 - h))
        x = WIDTH / 2 + dice.between(-1, 1) * reach
        dx, dy = dice.between(-4, 4), dice.between(-11, -5)
        yield x, y, dx, dy, dice.between(2.0, 3.2), _green(dice, 1 - t, 0.02)


def _round_tree(dice: Dice) -> Iterator[Leaf]:
    """A whole broad tree."""
    yield WIDTH / 2, HEIGHT - 50, 0.0, 56.0, 7.0, _BARK
    for k in range(1000):
        t = k / 1000
        while True:
            a, b = dice.between(-1, 1), dice.between(-1, 1)
            if a * a + b * b < 1:
                break
        bump = 0.86 + 0.14 * dice.between(0, 1)
        x, y = WIDTH / 2 + 58 * a * bump, 98 + 92 * b * bump
        dx, dy = dice.between(-7, 7), dice.between(-6, 6) + 0.5
        yield (
            x,
            y,
            dx,
            dy,
            dice.between(2.5, 4.2),
            _green(dice, min(1.0, (1 - t) + 0.3 * (b > 0.4))),
        )


def _frond(dice: Dice) -> Iterator[Leaf]:
    """A palm frond, its stem at the bottom."""
    yield WIDTH / 2, HEIGHT / 2, 0.0, HEIGHT / 2 - 6, 2.5, (0.5, 0.5, 0.22)
    for k in range(64):
        y = HEIGHT - 14 - k * 3.65
        h = k / 64
        reach = 56 * min(1.0, 0.4 + 2 * h) * min(1.0, 2.2 * (1.05 - h))
        for side in (-1, 1):
            dx, dy = side * reach / 2, -reach * 0.28 - dice.between(0, 4)
            color = _green(dice, 0.25 * dice.between(0, 1), 0.02)
            yield WIDTH / 2 + dx, y + dy, dx, dy, 2.6, color


def _corn(dice: Dice) -> Iterator[Leaf]:
    """A row of maize."""
    for k in range(7):
        x = 10 + k * 18 + dice.between(-3, 3)
        top = dice.between(14, 46)
        yield x, (HEIGHT + top) / 2, 0.5, (HEIGHT - top) / 2, 2.4, (0.5, 0.56, 0.24)
        for s in range(9):
            y = HEIGHT - 14 - s * (HEIGHT - top - 20) / 9
            dx = (1 if s % 2 else -1) * dice.between(10, 19)
            dy = dice.between(-18, -2)
            yield x + dx, y + dy, dx, dy, 3.6, _green(dice, 0.5 - s / 20, 0.03)
        yield x, top + 4, dice.between(-3, 3), -10.0, 3.0, (0.82, 0.7, 0.36)


def _flowers(dice: Dice) -> Iterator[Leaf]:
    """A bed of leaves with blossoms."""
    for k in range(420):
        y = HEIGHT - 6 - dice.between(0, 1) * 190
        x = dice.between(4, WIDTH - 4)
        dx, dy = dice.between(-9, 9), dice.between(-14, -5)
        yield x, y, dx, dy, dice.between(3, 5), _green(dice, 1 - k / 420)
    petals = ((0.95, 0.5, 0.12), (0.92, 0.74, 0.2), (0.85, 0.22, 0.2), (0.9, 0.86, 0.8))
    for _ in range(46):
        x, y = dice.between(8, WIDTH - 8), HEIGHT - 30 - dice.between(0, 1) * 175
        color = dice.pick(petals)
        yield x, y, 5.5, 0.4, 4.2, color
        yield x, y, 0.4, 5.5, 4.2, color


def _broad_twig(dice: Dice) -> Iterator[Leaf]:
    """A leafy branch with broad leaves."""
    for _ in range(7):
        x, y = WIDTH / 2, HEIGHT - 10.0
        lean = dice.between(-0.5, 0.5)
        for s in range(17):
            x += lean * 7 + dice.between(-2, 2)
            y -= 13
            for side in (-1, 1):
                dx, dy = side * dice.between(7, 14), dice.between(-12, 4)
                color = _green(dice, 0.55 * (1 - s / 17))
                yield x + dx, y + dy, dx, dy, dice.between(4.5, 6.5), color


def _reed(dice: Dice) -> Iterator[Leaf]:
    """Blades that fan out from one foot: reeds and agaves."""
    for k in range(40):
        lean = (k / 39 - 0.5) * 2
        lean += dice.between(-0.1, 0.1)
        length = dice.between(90, 122) * (1.0 - 0.35 * abs(lean))
        dx, dy = lean * 48, -length
        color = _green(dice, 0.5 * dice.between(0, 1), 0.06)
        yield WIDTH / 2 + dx * 0.9, HEIGHT - 6 - length, dx, dy, 4.0, color
