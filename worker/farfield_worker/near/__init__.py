"""The near field: polygons that view cells list, in blocks that they share."""

from farfield_worker.near.blobs import NearBlocks
from farfield_worker.near.select import NearRanges, near_list, near_triangles

__all__ = ["NearBlocks", "NearRanges", "near_list", "near_triangles"]
