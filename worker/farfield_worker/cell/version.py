"""The baker's version, a figure of each cell.

Cells of another version are baked again where they could be carried over (reuse/carry.py).
"""

from __future__ import annotations

#: raised whenever the baker makes other cells of the same scene and settings than before
VERSION = 4
