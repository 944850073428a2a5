"""A model's own folder: files beside the model, and nothing else, may be read."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import unquote

from farfield_worker.prepare.limits import refuse


class ModelFolder:
    """Reads files that a model names, refusing anything that leads out of its folder."""

    def __init__(self, model: Path) -> None:
        self.model = model
        self._root = model.resolve().parent

    @property
    def name(self) -> str:
        """The model's file name, for messages."""
        return self.model.name

    def find(self, reference: str, *, is_uri: bool) -> Path | None:
        """Return the file that `reference` names, or None where there is none.

        Raises SceneRefusedError if it is absolute, a network address, or lies outside the model's
        folder, symbolic links followed. Backslashes count as slashes: OBJ files from Windows.
        """
        text = unquote(reference) if is_uri else reference.replace("\\", "/")
        outside = f"it names {reference[:80]!r}, which is not a file in its own folder"
        if "\0" in text or "://" in text or text.startswith(("/", "\\", "~")):
            refuse(self.name, outside)
        if len(text) > 1 and text[1] == ":":
            refuse(self.name, outside)
        try:
            path = (self._root / text).resolve()
        except (OSError, RuntimeError, ValueError):
            refuse(self.name, outside)
        if not path.is_relative_to(self._root):
            refuse(self.name, outside)
        try:
            return path if path.is_file() else None
        except OSError:
            return None
