"""Where the nodes of a glTF scene place its meshes."""

from typing import Any

import numpy as np

from dnf_pyg.io.formats.document import Floats, UnsupportedError

__all__ = ["apply_transform", "mesh_transforms"]

_DEPTH = 1000  # nodes in each other; the time of trimesh grows with its square


def mesh_transforms(tree: dict[str, Any]) -> dict[int, Floats]:
    """Transform (4, 4) of each mesh that the scene shows, that of the first node where several show it.

    Skinned meshes get none, since their joints place them; nor do those that a node squeezes flat.

    Examples:
        >>> nodes = [{"children": [1], "scale": [2, 2, 2]}, {"mesh": 0, "translation": [1, 0, 0]}]
        >>> mesh_transforms({"nodes": nodes})[0][:3].tolist()
        [[2.0, 0.0, 0.0, 2.0], [0.0, 2.0, 0.0, 0.0], [0.0, 0.0, 2.0, 0.0]]
    """
    nodes, scenes = tree.get("nodes", []), tree.get("scenes", [])
    children = {child for node in nodes for child in node.get("children", [])}
    roots = scenes[tree.get("scene", 0)].get("nodes", []) if scenes else sorted(set(range(len(nodes))) - children)
    stack = [(root, np.eye(4), 0) for root in reversed(roots)]
    visited: set[int] = set()
    transforms: dict[int, Floats] = {}
    while stack:
        number, parent, depth = stack.pop()
        if number in visited:
            continue
        visited.add(number)
        if depth > _DEPTH:
            raise UnsupportedError(f"its nodes lie more than {_DEPTH} deep in each other", "Flatten its scene.")
        node = nodes[number]
        transform = parent @ _node_matrix(node)
        if "mesh" in node and "skin" not in node and _is_invertible(transform):
            transforms.setdefault(node["mesh"], transform)
        stack += [(child, transform, depth + 1) for child in reversed(node.get("children", []))]
    return transforms


def apply_transform(transform: Floats, pos: Floats) -> Floats:
    """Positions (V, 3) seen through a transform (4, 4)."""
    with np.errstate(invalid="ignore"):  # vertices without a position
        return pos @ transform[:3, :3].T + transform[:3, 3]


def _is_invertible(transform: Floats) -> bool:
    with np.errstate(all="ignore"):
        return bool(abs(np.linalg.det(transform)) > 0) and bool(np.isfinite(np.linalg.inv(transform)).all())


def _node_matrix(node: dict[str, Any]) -> Floats:
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    x, y, z, w = node.get("rotation", (0.0, 0.0, 0.0, 1.0))
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrix[:3, :3] *= np.array(node.get("scale", (1.0, 1.0, 1.0)), dtype=np.float64)
    matrix[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
    return matrix
