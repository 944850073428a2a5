"""The near field: blocks of polygons shared by cells."""
