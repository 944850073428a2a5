"""KHR_draco_mesh_compression: compressed primitives, decoded by Draco."""

from __future__ import annotations

from typing import Any

import DracoPy
import numpy as np
from numpy.typing import NDArray

from farfield_worker.prepare.gltf.accessors import Accessors
from farfield_worker.prepare.gltf.document import Json, size_of

#: Draco spends at least about a tenth of a bit on a triangle, and a bit or more on a vertex.
_MOST_PER_BYTE = 128


class DracoPrimitive:
    """A decoded primitive.

    Attributes:
        triangles: (m, 3) uint32.
    """

    def __init__(self, accessors: Accessors, primitive: Json, packed: Json) -> None:
        document = accessors.document
        data, _ = accessors.view(packed.get("bufferView"))
        claimed = [primitive["attributes"]["POSITION"]]
        if "indices" in primitive:
            claimed.append(primitive["indices"])
        for index in claimed:
            count = size_of(document, document.item("accessors", index), "count")
            if count > (len(data) + 64) * _MOST_PER_BYTE:
                document.refuse("a Draco primitive claims more than it can hold")
            document.charge(count * 32)
        try:
            mesh = DracoPy.decode(data.tobytes())
        except (DracoPy.FileTypeException, RuntimeError, ValueError):
            document.refuse("a primitive compressed with Draco is damaged")
        if not isinstance(mesh, DracoPy.DracoMesh):
            document.refuse("a primitive compressed with Draco holds no triangles")
        self.triangles: NDArray[np.uint32] = np.asarray(mesh.faces, np.uint32).reshape(-1, 3)
        self._columns = {entry["unique_id"]: entry["data"] for entry in mesh.attributes}
        self._ids = packed.get("attributes", {})

    def column(self, name: str) -> NDArray[Any] | None:
        """(n, k) array of attribute `name` in the accessor's own type; None if not in here."""
        data = self._columns.get(self._ids.get(name))
        return None if data is None else np.atleast_2d(data)
