"""Textures drawn in code: plaster, stone, paving, earth, thatch, wood, water, grass, cloth."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from farfield_worker.demo.foliage import foliage
from farfield_worker.demo.friezes import friezes
from farfield_worker.demo.hashing import uniform
from farfield_worker.demo.looks import Material

Floats = NDArray[np.float64]
Image = NDArray[np.uint8]

SIZE = 512


def textures() -> dict[Material, Image]:
    """Textures, (height, width, 4) uint8 sRGB; a material of one colour has none."""
    drawn: dict[Material, Callable[[], Floats]] = {
        Material.PLASTER: plaster,
        Material.STONE: stone,
        Material.PAVING: paving,
        Material.EARTH: earth,
        Material.THATCH: thatch,
        Material.WOOD: wood,
        Material.WATER: water,
        Material.GRASS: grass,
        Material.CLOTH: cloth,
        Material.STUCCO: stucco,
    }
    out = {material: _bytes(draw()) for material, draw in drawn.items()}
    out[Material.FOLIAGE] = foliage()
    out[Material.PAINT] = friezes()
    return dict(sorted(out.items()))


def _bytes(color: Floats) -> Image:
    out = np.full((*color.shape[:2], 4), 255, np.uint8)
    out[..., :3] = np.clip(np.rint(color * 255), 0, 255).astype(np.uint8)
    return out


def noise(cells_u: int, cells_v: int, seed: int, size: int = SIZE) -> Floats:
    """Smooth noise in [0, 1] that repeats at the borders, (size, size) float, rows along v."""
    lattice = uniform(seed, np.arange(cells_v)[:, None], np.arange(cells_u)[None])
    u = (np.arange(size) + 0.5) / size * cells_u
    v = (np.arange(size) + 0.5) / size * cells_v
    iu, iv = np.floor(u).astype(int), np.floor(v).astype(int)
    fu, fv = u - iu, v - iv
    su, sv = (fu * fu * (3 - 2 * fu))[None], (fv * fv * (3 - 2 * fv))[:, None]
    iu, iv, ju, jv = iu % cells_u, iv % cells_v, (iu + 1) % cells_u, (iv + 1) % cells_v
    top = lattice[iv][:, iu] * (1 - su) + lattice[iv][:, ju] * su
    low = lattice[jv][:, iu] * (1 - su) + lattice[jv][:, ju] * su
    return np.asarray(top * (1 - sv) + low * sv)


def cloudy(cells_u: int, cells_v: int, octaves: int, seed: int) -> Floats:
    """Sum of noises, each of double frequency and half strength, in [0, 1]."""
    total, weight = np.zeros((SIZE, SIZE)), 0.0
    for k in range(octaves):
        total += noise(cells_u << k, cells_v << k, seed + k) / (1 << k)
        weight += 1 / (1 << k)
    return total / weight


def _smooth(x: Floats, low: float, high: float) -> Floats:
    t = np.clip((x - low) / (high - low), 0, 1)
    return np.asarray(t * t * (3 - 2 * t))


def _mix(a: Floats | tuple[float, ...], b: Floats | tuple[float, ...], t: Floats) -> Floats:
    return np.asarray(np.asarray(a) * (1 - t[..., None]) + np.asarray(b) * t[..., None])


def plaster() -> Floats:
    """Whitewashed adobe: blotches, rain streaks, a few worn patches that show the clay."""
    blotches = cloudy(4, 4, 5, 100)
    streaks = cloudy(24, 3, 3, 110)
    grain = noise(128, 128, 120)
    color = _mix((0.86, 0.83, 0.78), (1.0, 0.985, 0.95), blotches)
    color = color * (1 - 0.12 * _smooth(streaks, 0.55, 0.8))[..., None]
    worn = _smooth(cloudy(3, 3, 6, 132), 0.66, 0.72) * _smooth(cloudy(24, 24, 3, 135), 0.25, 0.55)
    color = _mix(color, _mix((0.66, 0.5, 0.36), (0.76, 0.62, 0.47), grain), 0.5 * worn)
    return color * (0.96 + 0.06 * grain)[..., None]


def _courses(rows: int, columns: int, seed: int) -> tuple[Floats, Floats]:
    """Blocks in courses: distance to the nearest joint in parts of a course's height, and a number
    in [0, 1) per block.
    """
    v = (np.arange(SIZE)[:, None] + 0.5) / SIZE * rows + np.zeros((1, SIZE))
    r = np.floor(v).astype(int)
    u = (np.arange(SIZE)[None] + 0.5) / SIZE * columns + 0.5 * (r % 2) + uniform(seed, r) * 0.3
    u = u + 0.08 * noise(4, rows, seed + 1)
    c = np.floor(u).astype(int)
    jitter = 0.28 * (uniform(seed + 2, r, c % columns) - 0.5)
    after = 1 + 0.28 * (uniform(seed + 2, r, (c + 1) % columns) - 0.5)
    f = u - c
    block = np.where(f < jitter, c - 1, np.where(f >= after, c + 1, c))
    aspect = rows / columns
    to_left = np.abs(f - jitter) * aspect
    to_right = np.abs(f - after) * aspect
    fv = v - r
    distance = np.minimum(np.minimum(to_left, to_right), np.minimum(fv, 1 - fv))
    return distance, uniform(seed + 3, r, block % columns)


def stone() -> Floats:
    """Squared blocks in lime mortar."""
    distance, tone = _courses(8, 5, 200)
    distance = distance + 0.05 * (cloudy(16, 16, 3, 205) - 0.5)
    weather = cloudy(6, 6, 5, 210)
    color = _mix((0.62, 0.58, 0.52), (0.93, 0.88, 0.8), 0.25 + 0.5 * tone)
    color = color * (0.78 + 0.34 * weather)[..., None]
    color = color * (0.94 + 0.1 * noise(128, 128, 220))[..., None]
    color = color * (0.8 + 0.2 * _smooth(distance, 0.05, 0.2))[..., None]
    return _mix((0.52, 0.47, 0.41), color, _smooth(distance, 0.02, 0.07))


def paving() -> Floats:
    """Irregular slabs: the cells of scattered points."""
    count = 7
    gu, gv = np.meshgrid(np.arange(count), np.arange(count))
    px = (gu + 0.15 + 0.7 * uniform(300, gu, gv)) / count
    pz = (gv + 0.15 + 0.7 * uniform(301, gu, gv)) / count
    u = (np.arange(SIZE)[None] + 0.5) / SIZE + 0.012 * (noise(16, 16, 302) - 0.5)
    v = (np.arange(SIZE)[:, None] + 0.5) / SIZE + 0.012 * (noise(16, 16, 303) - 0.5)
    first = np.full((SIZE, SIZE), 9.0)
    second = first.copy()
    tone = np.zeros((SIZE, SIZE))
    for a, b, t in zip(px.ravel(), pz.ravel(), uniform(304, gu, gv).ravel(), strict=True):
        du, dv = np.abs(u - a), np.abs(v - b)
        du, dv = np.minimum(du, 1 - du), np.minimum(dv, 1 - dv)
        d = np.sqrt(du * du + dv * dv)
        nearer = d < first
        second = np.where(nearer, first, np.minimum(second, d))
        tone = np.where(nearer, t, tone)
        first = np.where(nearer, d, first)
    gap = (second - first) * count
    color = _mix((0.76, 0.72, 0.66), (0.94, 0.9, 0.83), 0.2 + 0.6 * tone)
    color = color * (0.86 + 0.22 * cloudy(8, 8, 5, 305))[..., None]
    return _mix((0.6, 0.54, 0.46), color, _smooth(gap, 0.04, 0.16))


def earth() -> Floats:
    """Trodden ground with pebbles and dry tufts."""
    base = cloudy(5, 5, 6, 400)
    color = _mix((0.72, 0.64, 0.52), (0.98, 0.93, 0.84), base)
    pebbles = _smooth(noise(96, 96, 410), 0.8, 0.9)
    color = _mix(color, (0.7, 0.68, 0.64), 0.5 * pebbles)
    tufts = _smooth(cloudy(9, 9, 4, 420), 0.62, 0.7) * _smooth(noise(128, 128, 430), 0.3, 0.7)
    return _mix(color, (0.52, 0.56, 0.3), 0.55 * tufts)


def thatch() -> Floats:
    """Layers of straw, each frayed at its lower edge."""
    layers = 6
    v = (np.arange(SIZE)[:, None] + 0.5) / SIZE * layers + 0.35 * noise(40, 6, 500)
    f = v - np.floor(v)
    straw = 0.6 * noise(160, 10, 510) + 0.4 * noise(60, 4, 520)
    color = _mix((0.5, 0.38, 0.22), (1.0, 0.88, 0.6), straw)
    color = color * (0.72 + 0.34 * (1 - f))[..., None]
    return color * (0.85 + 0.2 * cloudy(3, 3, 4, 530))[..., None]


def wood() -> Floats:
    """Weathered planks along u."""
    planks = 8
    v = (np.arange(SIZE)[:, None] + 0.5) / SIZE * planks + np.zeros((1, SIZE))
    r = np.floor(v).astype(int)
    f = v - r
    grain = 0.55 * noise(4, 128, 600) + 0.45 * noise(12, 64, 610)
    color = _mix((0.55, 0.42, 0.3), (0.95, 0.82, 0.64), 0.3 * uniform(620, r) + 0.7 * grain)
    gap = np.minimum(f, 1 - f)
    return color * (0.35 + 0.65 * _smooth(gap, 0.01, 0.06))[..., None]


def stucco() -> Floats:
    """Painted or burnished lime: faint clouds and brush strokes."""
    color = np.ones((SIZE, SIZE, 3)) * (0.88 + 0.12 * cloudy(3, 3, 6, 140))[..., None]
    strokes = noise(64, 6, 150)
    return np.asarray(color * (0.95 + 0.07 * strokes)[..., None] * np.array((1.0, 0.99, 0.97)))


def water() -> Floats:
    """Quiet water: the sky in its ripples."""
    swell = cloudy(3, 5, 4, 700)
    ripple = cloudy(12, 36, 3, 710)
    fine = noise(64, 160, 720)
    color = _mix((0.15, 0.34, 0.4), (0.24, 0.45, 0.53), swell)
    color = _mix(color, (0.46, 0.64, 0.74), 0.7 * _smooth(ripple, 0.5, 0.76))
    color = _mix(color, (0.78, 0.88, 0.93), 0.6 * _smooth(ripple * 0.65 + fine * 0.35, 0.7, 0.82))
    return color * (0.94 + 0.1 * fine)[..., None]


def grass() -> Floats:
    """Growth on a slope, pale so that its tint decides: tufts, dry spots, dark bushes."""
    base = cloudy(7, 7, 6, 800)
    blades = noise(170, 170, 810)
    color = _mix((0.66, 0.72, 0.52), (0.95, 0.95, 0.8), base)
    color = _mix(color, (1.0, 0.93, 0.74), 0.5 * _smooth(cloudy(5, 5, 5, 820), 0.5, 0.7))
    bushes = _smooth(cloudy(24, 24, 4, 830), 0.58, 0.68)
    color = _mix(color, (0.42, 0.52, 0.34), 0.5 * bushes)
    return color * (0.8 + 0.28 * blades)[..., None]


def cloth() -> Floats:
    """Woven cotton with two borders of stripes."""
    threads = 0.5 * noise(4, 256, 900) + 0.5 * noise(256, 4, 910)
    color = np.ones((SIZE, SIZE, 3)) * (0.86 + 0.14 * threads)[..., None]
    v = (np.arange(SIZE)[:, None] + 0.5) / SIZE + np.zeros((1, SIZE))
    for centre, half in ((0.12, 0.03), (0.2, 0.012), (0.88, 0.03), (0.8, 0.012)):
        band = 1 - _smooth(np.abs(v - centre), half, half + 0.006)
        color = _mix(color, color * np.array((0.45, 0.38, 0.36)), band)
    return color * (0.9 + 0.1 * cloudy(3, 3, 3, 920))[..., None]
