"""Farfield's words as code: placement, corridors, the walk format, the store. No GL, no web."""

__version__ = "0.1.0"
