"""Any model file in, one `Model` out; whatever goes wrong becomes one sentence."""

from __future__ import annotations

import logging
import struct
import warnings
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import cast

from farfield_worker.prepare.files import ModelFolder
from farfield_worker.prepare.limits import Limits, refuse
from farfield_worker.prepare.model import Model

#: suffix -> module and function that reads it; imported when needed
READERS = {
    ".glb": ("farfield_worker.prepare.gltf", "read_gltf"),
    ".gltf": ("farfield_worker.prepare.gltf", "read_gltf"),
    ".obj": ("farfield_worker.prepare.obj", "read_obj"),
    ".ply": ("farfield_worker.prepare.ply", "read_ply"),
    ".stl": ("farfield_worker.prepare.stl", "read_stl"),
}

#: what parsers raise on damaged data; the sizes that cost memory are checked before
_DAMAGE = (
    ArithmeticError,
    AssertionError,
    AttributeError,
    EOFError,
    LookupError,
    NameError,  # trimesh, where a PLY's faces are called otherwise
    OSError,
    RecursionError,
    RuntimeError,
    TypeError,
    ValueError,
    Warning,
    struct.error,
)


def read_model(source: Path, limits: Limits) -> Model:
    """Read the model at `source`; raises SceneRefusedError, whatever the file holds."""
    suffix = source.suffix.lower()
    if suffix not in READERS:
        known = ", ".join(READERS)
        refuse(source.name, f"its suffix {suffix!r} is not one of {known}")
    if not source.is_file():
        refuse(source.name, "there is no such file")
    module, function = READERS[suffix]
    reader = cast(Callable[[ModelFolder, Limits], Model], getattr(import_module(module), function))
    try:
        with warnings.catch_warnings():
            # NumPy reports numbers that are none as a deprecation
            warnings.simplefilter("error", DeprecationWarning)
            warnings.simplefilter("ignore", RuntimeWarning)
            model = reader(ModelFolder(source), limits)
    except MemoryError:
        refuse(source.name, "it needs more memory than there is")
    except _DAMAGE as error:
        logging.getLogger(__name__).debug("reading %s", source, exc_info=True)
        cause = " ".join(str(error).split())[:120] or type(error).__name__
        refuse(source.name, f"it is damaged or not what its suffix says ({cause})")
    if not any(len(mesh.triangles) for mesh in model.meshes):
        refuse(source.name, "it holds no triangles")
    return model
