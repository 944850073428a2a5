"""A cell as one ordinary glTF file."""
