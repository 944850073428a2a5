"""From geometry to texels: one interface, several renderers."""
