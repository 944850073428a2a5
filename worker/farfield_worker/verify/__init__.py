"""How good is a walk: its pictures against full renders (docs/quality.md)."""
