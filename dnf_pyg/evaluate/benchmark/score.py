"""Means over noise levels and the score of Eq. 4."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from dnf_pyg.evaluate.benchmark.rows import Row

__all__ = ["complete_methods", "mesh_thetas", "scores", "summarize"]

Thetas = dict[str, dict[str, float]]


def mesh_thetas(rows: Sequence[Row]) -> Thetas:
    """Theta by method and mesh, mean over the noise levels; only where the method has every level of the mesh.

    Example:
        >>> mesh_thetas([Row("a", "n1", "x", 1.0), Row("a", "n2", "x", 3.0), Row("a", "n1", "y", 2.0)])
        {'x': {'a': 2.0}, 'y': {}}
    """
    levels: dict[str, set[str]] = {}
    for row in rows:
        levels.setdefault(row.mesh, set()).add(row.noise)
    found: dict[str, dict[str, list[float]]] = {}
    for row in rows:
        found.setdefault(row.method, {}).setdefault(row.mesh, []).append(row.theta_deg)
    return {
        method: {mesh: sum(t) / len(t) for mesh, t in by_mesh.items() if len(t) == len(levels[mesh])}
        for method, by_mesh in found.items()
    }


def complete_methods(rows: Sequence[Row]) -> list[str]:
    """Methods that have a result for every noisy mesh, in the order of the rows."""
    cases = {(row.mesh, row.noise) for row in rows}
    return [
        method
        for method in dict.fromkeys(row.method for row in rows)
        if {(row.mesh, row.noise) for row in rows if row.method == method} == cases
    ]


def scores(thetas: Mapping[str, Mapping[str, float]]) -> Thetas:
    """Score of each method on each mesh: 1 for the lowest theta of all methods, 0 for the highest.

    ``1 - (theta - min) / (max - min)`` with minimum and maximum over the methods that have the mesh; 1 for all where
    these are equal.

    Source: Li et al. 2020, Sec. 4.1, Eq. (4).

    Args:
        thetas: Degrees by method and mesh, mean over noise levels.

    Example:
        >>> scores({"x": {"a": 1.0}, "y": {"a": 2.0}, "z": {"a": 5.0}})
        {'x': {'a': 1.0}, 'y': {'a': 0.75}, 'z': {'a': 0.0}}
    """
    lowest, highest = (
        {mesh: pick(_of_mesh(thetas, mesh)) for by_mesh in thetas.values() for mesh in by_mesh} for pick in (min, max)
    )
    return {
        method: {
            mesh: 1 - (theta - lowest[mesh]) / (highest[mesh] - lowest[mesh]) if highest[mesh] > lowest[mesh] else 1.0
            for mesh, theta in by_mesh.items()
        }
        for method, by_mesh in thetas.items()
    }


def _of_mesh(thetas: Mapping[str, Mapping[str, float]], mesh: str) -> Iterable[float]:
    return [by_mesh[mesh] for by_mesh in thetas.values() if mesh in by_mesh]


def summarize(rows: Sequence[Row], data: str) -> dict[str, Any]:
    """Means of one method's rows, as a model card and ``metrics.json`` state them.

    Args:
        rows: Rows of one method, measured here.
        data: Name of the test set.

    Returns:
        Plain numbers and strings: means over the noisy meshes, and theta by mesh and by noise level.

    Raises:
        ValueError: If there are no rows or they are of several methods.

    Example:
        >>> row = Row("a", "n1", "x", 1.5, "x()", theta_normals_deg=2.0, vertex_error=0.1, seconds=3.0)
        >>> summarize([row], "test")["theta_by_mesh"]
        {'a': 1.5}
    """
    if len({row.method for row in rows}) != 1:
        raise ValueError(f"Expected 'rows' of one method (got {sorted({row.method for row in rows})})")

    def mean(values: Iterable[float | None]) -> float | None:
        known = [value for value in values if value is not None]
        return round(sum(known) / len(known), 4) if known else None

    meshes = dict.fromkeys(row.mesh for row in rows)
    noises = sorted({row.noise for row in rows})
    return {
        "data": data,
        "num_meshes": len(rows),
        "parameters": rows[0].parameters,
        "theta_deg": mean(row.theta_deg for row in rows),
        "theta_normals_deg": mean(row.theta_normals_deg for row in rows),
        "vertex_error": mean(row.vertex_error for row in rows),
        "seconds": mean(row.seconds for row in rows),
        "theta_by_mesh": {mesh: mean(row.theta_deg for row in rows if row.mesh == mesh) for mesh in meshes},
        "theta_by_noise": {noise: mean(row.theta_deg for row in rows if row.noise == noise) for noise in noises},
    }
