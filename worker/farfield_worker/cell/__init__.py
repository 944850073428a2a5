"""One view cell, from scene to files."""
