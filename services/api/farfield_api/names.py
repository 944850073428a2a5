"""Path parameters: what a name in an address may look like. Nothing else reaches the store."""

from __future__ import annotations

import re
from typing import Annotated

from fastapi import Path

_ID = r"^[a-z0-9](?:[a-z0-9-]{0,62}[a-z0-9])?$"
IS_ID = re.compile(_ID)
_BLOB = r"^[0-9a-f]{32}\.[a-z0-9]{2,5}$"

SceneId = Annotated[str, Path(pattern=_ID, description="A scene's id.")]
BakeId = Annotated[str, Path(pattern=_ID, description="A bake's id, which is also its walk's.")]
BlobName = Annotated[str, Path(pattern=_BLOB, description="Hash and suffix of a blob.")]
CellName = Annotated[
    str, Path(pattern=r"^-?\d{1,9}_-?\d{1,9}_-?\d{1,9}$", description="A cell: i_j_k.")
]
PageNumber = Annotated[int, Path(ge=0, le=10**9, description="A slice of the cell table.")]
PreparedName = Annotated[
    str,
    Path(
        pattern=r"^(scene\.json|(map|thumbnail)\.png|(positions|normals|uvs|colors|triangles)\.npy"
        r"|textures/[0-9a-f]{32}\.png)$",
        description="A file of a prepared scene.",
    ),
]
