"""Means of rows and the score of Eq. 4."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from dnf_pyg.evaluate.benchmark.rows import Row

__all__ = ["complete_methods", "means", "mesh_thetas", "names", "noisy_rows", "scores", "summarize"]

Thetas = dict[str, dict[str, float]]


def names(rows: Iterable[Row], field: str) -> list[str]:
    """Distinct values of a field, such as ``method`` or ``mesh``, in the order of the rows."""
    return list(dict.fromkeys(getattr(row, field) for row in rows))


def means(rows: Iterable[Row], field: str, *by: str) -> dict[tuple[str, ...], float]:
    """Mean of a field over the rows that agree in the fields ``by``; rows without a value are left out.

    Example:
        >>> means([Row("a", "n1", "x", 1.0), Row("a", "n2", "x", 3.0)], "theta_deg", "method", "mesh")
        {('x', 'a'): 2.0}
    """
    groups: dict[tuple[str, ...], list[float]] = {}
    for row in rows:
        if (value := getattr(row, field)) is not None:
            groups.setdefault(tuple(getattr(row, key) for key in by), []).append(value)
    return {key: sum(values) / len(values) for key, values in groups.items()}


def noisy_rows(rows: Iterable[Row]) -> list[Row]:
    """Rows of a method called ``noisy`` that leaves the meshes as they are, one for each measured mesh."""
    found = {(row.mesh, row.noise): row.theta_noisy_deg for row in rows if row.theta_noisy_deg is not None}
    return [Row(mesh, noise, "noisy", theta) for (mesh, noise), theta in found.items()]


def mesh_thetas(rows: Sequence[Row]) -> Thetas:
    """Theta by method and mesh, mean over the noise levels, where the method has every level of the mesh.

    Example:
        >>> mesh_thetas([Row("a", "n1", "x", 1.0), Row("a", "n2", "x", 3.0), Row("a", "n1", "y", 2.0)])
        {'x': {'a': 2.0}, 'y': {}}
    """
    levels: dict[tuple[str, ...], set[str]] = {}
    for row in rows:
        for key in ((row.mesh,), (row.method, row.mesh)):
            levels.setdefault(key, set()).add(row.noise)
    found: Thetas = {method: {} for method in names(rows, "method")}
    for (method, mesh), theta in means(rows, "theta_deg", "method", "mesh").items():
        if levels[method, mesh] == levels[mesh,]:
            found[method][mesh] = theta
    return found


def complete_methods(rows: Sequence[Row]) -> list[str]:
    """Methods that have a result for every noisy mesh, in the order of the rows."""
    cases: dict[str, set[tuple[str, str]]] = {}
    for row in rows:
        cases.setdefault(row.method, set()).add((row.mesh, row.noise))
    return [method for method, own in cases.items() if own == set().union(*cases.values())]


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
    found: Thetas = {method: {} for method in thetas}
    for mesh in dict.fromkeys(mesh for by_mesh in thetas.values() for mesh in by_mesh):
        theta = {method: by_mesh[mesh] for method, by_mesh in thetas.items() if mesh in by_mesh}
        lowest, highest = min(theta.values()), max(theta.values())
        for method, value in theta.items():
            found[method][mesh] = 1 - (value - lowest) / (highest - lowest) if highest > lowest else 1.0
    return found


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
    methods = names(rows, "method")
    if len(methods) != 1:
        raise ValueError(f"Expected 'rows' of one method (got {methods}). Pass those of one at a time.")
    fields = ("theta_deg", "theta_normals_deg", "vertex_error", "seconds")
    overall = {field: means(rows, field).get(()) for field in fields}
    by_noise = sorted(means(rows, "theta_deg", "noise").items())
    return {
        "data": data,
        "num_meshes": len(rows),
        "parameters": rows[0].parameters,
        **{field: None if value is None else round(value, 6) for field, value in overall.items()},
        "theta_by_mesh": {mesh: round(theta, 6) for (mesh,), theta in means(rows, "theta_deg", "mesh").items()},
        "theta_by_noise": {noise: round(theta, 6) for (noise,), theta in by_noise},
    }
