"""One view cell from geometry to files."""
