"""Colours under transparent texels and in gutters, so that filtering finds no dark edges.

Inside a rectangle a transparent texel takes the colour of the covered texel above it in its column,
or else of the first one below; a column without any takes that of its left neighbour, or else of
the first one to its right. Columns, because the up filter of a PNG makes zeros of what repeats
downwards. The gutter repeats the rectangle's edge, alpha and all: a sample that falls on it by
rounding finds what it should.
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def dilate(pages, page, x, y, width, height):
    """Continue colours in place on `pages` (p, H, W) uint32, little-endian RGBA, alpha 0 or 255.

    Rectangles (n,) begin at texel (x, y) of their page and have a gutter of one texel around.
    """
    rgb = np.uint32(0xFFFFFF)
    covered = np.empty(pages.shape[2], np.bool_)
    for n in range(page.size):
        image = pages[page[n]]
        left, top = x[n], y[n]
        right, bottom = left + width[n], top + height[n]
        first = right  # the first column with a covered texel
        for column in range(left, right):
            seen = bottom
            for row in range(bottom - 1, top - 1, -1):
                if image[row, column] > rgb:
                    seen = row
            covered[column] = seen < bottom
            if seen == bottom:
                continue
            first = min(first, column)
            for row in range(top, bottom):
                if image[row, column] > rgb:
                    seen = row
                else:
                    image[row, column] = image[seen, column] & rgb
        for column in range(left, right):
            source = first if column < first else column - 1
            if not covered[column]:
                for row in range(top, bottom):
                    image[row, column] = image[row, source] & rgb
        for row in range(top, bottom):
            image[row, left - 1], image[row, right] = image[row, left], image[row, right - 1]
        for column in range(left - 1, right + 1):
            image[top - 1, column] = image[top, column]
            image[bottom, column] = image[bottom - 1, column]
