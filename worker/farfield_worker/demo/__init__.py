"""The demo scene, written by our own code."""
