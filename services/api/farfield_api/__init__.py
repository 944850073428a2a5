"""Farfield over HTTP."""
