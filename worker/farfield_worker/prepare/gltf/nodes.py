"""The node tree of a glTF (specification, section 3.5) as a flat list of placed meshes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from farfield_worker.prepare.gltf.accessors import Accessors
from farfield_worker.prepare.gltf.document import Document, Json

Matrix = NDArray[np.float64]


def placed_meshes(accessors: Accessors) -> list[tuple[int, Matrix]]:
    """Every (mesh, (k, 4, 4) float64 world matrices) of the default scene.

    k is 1, or the number of instances under EXT_mesh_gpu_instancing. Refuses trees that are none.
    """
    document = accessors.document
    placed: list[tuple[int, Matrix]] = []
    seen: set[int] = set()
    total = 0
    stack = [(root, np.eye(4)) for root in reversed(_roots(document))]
    while stack:
        index, parent = stack.pop()
        node = document.item("nodes", index)
        if index in seen:
            document.refuse("its nodes are not a tree")
        seen.add(index)
        world = parent @ _local(document, node)
        if "mesh" in node:
            if "skin" in node:
                document.note("Skinned meshes stand as they were modelled, without their skeleton.")
                world = np.eye(4)
            packed = node.get("extensions", {}).get("EXT_mesh_gpu_instancing")
            many = world[None] if packed is None else world @ _instances(accessors, packed)
            total += len(many)
            if total > document.limits.nodes:
                document.refuse("it has too many instances")
            placed.append((node["mesh"], many))
        stack.extend((child, world) for child in reversed(node.get("children", [])))
    return placed


def _roots(document: Document) -> list[Any]:
    if document.json.get("scenes"):
        scene = document.item("scenes", document.json.get("scene", 0))
        return list(scene.get("nodes", []))
    nodes = document.json.get("nodes", [])
    children = {child for node in nodes for child in node.get("children", [])}
    return [index for index in range(len(nodes)) if index not in children]


def _local(document: Document, node: Json) -> Matrix:
    if "matrix" in node:
        matrix = np.array(node["matrix"], np.float64).reshape(4, 4).T
    elif any(key in node for key in ("translation", "rotation", "scale")):
        matrix = compose(
            np.array([node.get("translation", (0, 0, 0))], np.float64),
            np.array([node.get("rotation", (0, 0, 0, 1))], np.float64),
            np.array([node.get("scale", (1, 1, 1))], np.float64),
        )[0]
    else:
        return np.eye(4)
    if not np.isfinite(matrix).all():
        document.refuse("a node's transform is not a number")
    return matrix


def compose(translation: Matrix, rotation: Matrix, scale: Matrix) -> Matrix:
    """(k, 4, 4) matrices from (k, 3) translations, (k, 4) quaternions xyzw and (k, 3) scales."""
    length = np.linalg.norm(rotation, axis=1, keepdims=True)
    x, y, z, w = np.where(length > 0, rotation / np.where(length > 0, length, 1), (0, 0, 0, 1)).T
    out = np.zeros((len(rotation), 4, 4))
    out[:, 0, 0], out[:, 0, 1] = 1 - 2 * (y * y + z * z), 2 * (x * y - z * w)
    out[:, 0, 2], out[:, 1, 0] = 2 * (x * z + y * w), 2 * (x * y + z * w)
    out[:, 1, 1], out[:, 1, 2] = 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)
    out[:, 2, 0], out[:, 2, 1] = 2 * (x * z - y * w), 2 * (y * z + x * w)
    out[:, 2, 2] = 1 - 2 * (x * x + y * y)
    out[:, :3, :3] *= scale[:, None, :]
    out[:, :3, 3] = translation
    out[:, 3, 3] = 1
    return out


def _instances(accessors: Accessors, packed: Json) -> Matrix:
    attributes = packed.get("attributes", {})
    columns = {
        key: accessors.floats(attributes[key]).astype(np.float64)
        for key in ("TRANSLATION", "ROTATION", "SCALE")
        if key in attributes
    }
    if not columns:
        return np.eye(4)[None]
    count = min(len(column) for column in columns.values())
    if count > accessors.document.limits.nodes:
        accessors.document.refuse("it has too many instances")
    rest = {"TRANSLATION": (0, 0, 0), "ROTATION": (0, 0, 0, 1), "SCALE": (1, 1, 1)}
    full = [
        columns[key][:count] if key in columns else np.tile(np.array(value, np.float64), (count, 1))
        for key, value in rest.items()
    ]
    matrices = compose(*full)
    if not np.isfinite(matrices).all():
        accessors.document.refuse("an instance's transform is not a number")
    return matrices
