"""Vertex positions that fit given facet normals."""

from collections.abc import Callable

import numpy as np
import torch
from numba import njit
from numpy.typing import NDArray
from torch import Tensor

from dnf_pyg.mesh.early_stopping import EarlyStopping
from dnf_pyg.mesh.flips import revert_flips, unfold
from dnf_pyg.mesh.topology import Topology

__all__ = ["update_vertices"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]


def update_vertices(
    pos: Tensor,
    face: Tensor,
    normal: Tensor,
    num_iterations: int = 20,
    *,
    tolerance: float = 1e-5,
    early_stopping: bool = False,
    max_move: float | Tensor = float("inf"),
    origin: Tensor | None = None,
    fixed: Tensor | None = None,
    weight: Tensor | None = None,
    guard: bool = True,
    topology: Topology | None = None,
    ended: Callable[[int, str], object] = lambda count, reason: None,
) -> Tensor:
    """Move the vertices until the faces around them are orthogonal to the given normals.

    Each iteration moves all vertices at once: ``v_i += mean over faces k around i of n_k (n_k . (c_k - v_i))`` with
    the current centroid ``c_k`` of face k. The update ends early once no vertex moves by more than ``tolerance``.

    The first iterations remove noise, later ones bend the surface to errors of the normals. ``early_stopping`` ends the
    update in between (:class:`~dnf_pyg.mesh.early_stopping.EarlyStopping`), if the noise of neighbouring vertices is
    independent.

    Source: Sun et al., Fast and Effective Feature-Preserving Mesh Denoising, TVCG 2007, Sec. 4.
    Differs: ``early_stopping``, ``guard``, ``max_move``, ``fixed`` and ``weight``; with ``guard=False`` and the other
    defaults this is the published update.

    Args:
        pos: Vertex positions, (V, 3), model units.
        face: Vertices of each face, (3, F).
        normal: Target facet normals, (F, 3), unit length; faces with a zero vector have no effect.
        num_iterations: Largest number of iterations.
        tolerance: Largest movement per iteration, in mean edge lengths, below which the update ends.
        early_stopping: Whether the update ends, after three iterations or more, at the smallest estimated error.
        max_move: Largest displacement from the position in ``origin``, in mean edge lengths; for all vertices, or for
            each, (V,).
        origin: Positions that displacements are measured from, (V, 3); ``pos`` if not given.
        fixed: Vertices that stay in place, (V,) bool.
        weight: Factor of the movement towards the plane of each face, (F,), up to 1; 1 if not given.
        guard: Open folds first (:func:`~dnf_pyg.mesh.flips.unfold`), and revert steps that flip a face away from its
            target normal.
        topology: Connectivity of the mesh; computed if not given.
        ended: Called with the number of iterations that ran, and why no more did.

    Returns:
        Updated positions, (V, 3), of the dtype and device of ``pos``; vertices without a face stay in place.

    Raises:
        ValueError: If shapes do not match or a number is negative.

    Examples:
        >>> pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.3]])
        >>> face = torch.tensor([[0, 1], [1, 3], [2, 2]])
        >>> up = torch.tensor([[0.0, 0, 1], [0, 0, 1]])
        >>> flat = update_vertices(pos, face, up, num_iterations=100)
        >>> bool((flat[:, 2] - flat[:, 2].mean()).abs().max() < 1e-3)
        True
    """
    if normal.shape != (face.size(1), 3):
        raise ValueError(f"Expected 'normal' of shape [{face.size(1)}, 3] (got {list(normal.shape)}). Pass one a face.")
    if fixed is not None and fixed.shape != (len(pos),):
        raise ValueError(f"Expected 'fixed' of shape [{len(pos)}] (got {list(fixed.shape)}). Pass one a vertex.")
    if weight is not None and weight.shape != (face.size(1),):
        raise ValueError(f"Expected 'weight' of shape [{face.size(1)}] (got {list(weight.shape)}). Pass one a face.")
    limit = torch.as_tensor(max_move, dtype=torch.float64, device="cpu").expand(len(pos))
    lowest = float(limit.min()) if len(pos) else 0.0
    for name, value in (("num_iterations", num_iterations), ("tolerance", tolerance), ("max_move", lowest)):
        if not value >= 0:
            raise ValueError(f"Expected '{name}' of at least 0 (got {value}). Raise it.")
    if face.size(1) == 0:
        return pos.clone()
    center = pos.mean(dim=0)  # differences of positions far from the origin lose digits
    current = (pos - center).detach().cpu().double().numpy()
    start = current if origin is None else (origin - center).detach().cpu().double().numpy()
    topology = topology or Topology(face, len(pos))
    stays = np.zeros(len(pos), dtype=bool) if fixed is None else fixed.cpu().numpy()
    corner = np.ascontiguousarray(face.cpu().t().numpy())
    target = np.ascontiguousarray(normal.detach().cpu().double().numpy())
    trust = np.ones(len(corner)) if weight is None else weight.detach().cpu().double().numpy()
    unit = float(topology.mean_edge_length(pos.detach())) or 1.0  # infinity times 0 is not a number
    farthest = (limit * unit).contiguous().numpy()
    degree = np.bincount(corner.ravel(), minlength=len(pos))
    stopping = _stopping(corner, target, trust, degree, stays, topology.edges) if early_stopping else None
    before, best, count, reason = current, current, 0, "the largest number was reached"
    if guard and num_iterations > 0:
        current = unfold(current, corner, target, stays, start, farthest)
    for count in range(1, num_iterations + 1):
        updated = _stepped(current, start, corner, target, trust, degree, stays, farthest)
        if guard:
            revert_flips(updated, current, corner, target)
        step = updated - current
        if stopping:
            if stopping.should_end((updated + current) / 2 - before, step):
                break
            if stopping.best == count:
                best = updated
        current = updated
        if np.abs(step).max() <= tolerance * unit:
            reason = "the vertices came to rest"
            break
    if stopping and stopping.best < count:
        current, count, reason = best, stopping.best, "the estimated error began to rise"
    ended(count, reason)
    moved = torch.from_numpy(current != before).any(dim=1).to(pos.device)
    return torch.where(moved[:, None], torch.from_numpy(current).to(pos) + center, pos)


def _stopping(face: Ints, normal: Floats, weight: Floats, degree: Ints, fixed: Flags, edge: Tensor) -> EarlyStopping:
    """Early stopping of an update with these normals."""
    direction = np.zeros((len(fixed), 3))
    for corner in face.T:
        np.add.at(direction, corner, normal)
    direction /= np.maximum(np.linalg.norm(direction, axis=1, keepdims=True), 1e-12)
    origin, unlimited = np.zeros_like(direction), np.full(len(fixed), np.inf)
    return EarlyStopping(
        lambda values: _stepped(values, origin, face, normal, weight, degree, fixed, unlimited),
        direction,
        edge,
        free=~fixed & (degree > 0),
    )


@njit(cache=True, nogil=True)
def _stepped(
    pos: Floats,
    start: Floats,
    face: Ints,
    normal: Floats,
    weight: Floats,
    degree: Ints,
    fixed: Flags,
    max_move: Floats,
) -> Floats:
    """Compute the positions (V, 3) after one iteration; ``degree`` is the number of faces at each vertex."""
    step = np.zeros_like(pos)
    for f in range(len(face)):  # numbers instead of rows, whose views take four times as long
        x, y, z = normal[f, 0], normal[f, 1], normal[f, 2]
        a, b, c = face[f, 0], face[f, 1], face[f, 2]
        height_a = x * pos[a, 0] + y * pos[a, 1] + z * pos[a, 2]
        height_b = x * pos[b, 0] + y * pos[b, 1] + z * pos[b, 2]
        height_c = x * pos[c, 0] + y * pos[c, 1] + z * pos[c, 2]
        height = (height_a + height_b + height_c) / 3
        for v, height_v in ((a, height_a), (b, height_b), (c, height_c)):
            distance = weight[f] * (height - height_v)
            step[v, 0] += distance * x
            step[v, 1] += distance * y
            step[v, 2] += distance * z
    updated = pos.copy()
    for v in range(len(pos)):
        if fixed[v] or degree[v] == 0:
            continue
        x = pos[v, 0] + step[v, 0] / degree[v] - start[v, 0]
        y = pos[v, 1] + step[v, 1] / degree[v] - start[v, 1]
        z = pos[v, 2] + step[v, 2] / degree[v] - start[v, 2]
        moved = np.sqrt(x * x + y * y + z * z)
        shrink = 1.0 if moved <= max_move[v] else max_move[v] / moved
        updated[v, 0] = start[v, 0] + shrink * x
        updated[v, 1] = start[v, 1] + shrink * y
        updated[v, 2] = start[v, 2] + shrink * z
    return updated
