"""Where everything lies in a store (docs/format.md, "The store")."""

from __future__ import annotations

from farfield_core.cells import Index, cell_name


def source_prefix(scene: str) -> str:
    """Folder of the upload as it came."""
    return f"scenes/{scene}/source/"


def prepared_prefix(scene: str) -> str:
    """Folder of the render-ready scene."""
    return f"scenes/{scene}/prepared/"


def bake_prefix(bake: str) -> str:
    """Folder of one bake."""
    return f"bakes/{bake}/"


def walk_key(bake: str) -> str:
    """The manifest."""
    return f"bakes/{bake}/walk.json"


def predecessor_key(bake: str) -> str:
    """Which bake a bake follows, so that cells can be carried over."""
    return f"bakes/{bake}/follows.json"


def cells_prefix(bake: str) -> str:
    """Folder of a bake's cell files."""
    return f"bakes/{bake}/cells/"


def cell_key(bake: str, index: Index) -> str:
    """A cell's file; a cell is done when it exists."""
    return f"bakes/{bake}/cells/{cell_name(index)}.json"


def atlas_key(name: str) -> str:
    """An atlas page, `name` being its hash and suffix."""
    return f"blobs/atlases/{name}"


def near_key(name: str) -> str:
    """A near block or a texture of one, `name` being its hash and suffix."""
    return f"blobs/near/{name}"


def scene_key(scene: str) -> str:
    """What says that a scene is ready; written last."""
    return f"scenes/{scene}/prepared/scene.json"


def refused_key(scene: str) -> str:
    """Why a scene could not be prepared."""
    return f"scenes/{scene}/refused.json"


def scene_prefix(scene: str) -> str:
    """Folder of everything that belongs to a scene."""
    return f"scenes/{scene}/"


def orientation_key(scene: str) -> str:
    """How a scene's model is turned and scaled, where somebody has said so."""
    return f"scenes/{scene}/orientation.json"
