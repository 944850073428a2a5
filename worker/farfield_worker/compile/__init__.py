"""From texels to quads and atlases (LEMI section 5)."""
