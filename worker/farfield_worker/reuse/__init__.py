"""Cells of an earlier bake that an edit of the scene leaves as they are."""
