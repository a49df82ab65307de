"""Triangulations of a solid's boundary: even, stretched or irregular, with every vertex exactly on its surfaces."""

import numpy as np
import torch
from torch import Generator

from dnf_pyg.synthetic.shapes.contour import LabelledMesh, project
from dnf_pyg.synthetic.shapes.solid import Field, Solid
from dnf_pyg.synthetic.shapes.topology import collapse_edges, flip_edges, split_edges

__all__ = ["remesh", "shake"]


def remesh(
    solid: Solid,
    mesh: LabelledMesh,
    size: float | Field,
    num_rounds: int = 5,
    relaxation: float = 0.5,
    generator: Generator | None = None,
) -> LabelledMesh:
    """Make the triangles even, with the vertices on their surfaces, sharp edges and corners.

    Rounds of splitting long edges, collapsing short ones, flipping to the Delaunay criterion and moving vertices along
    the surface towards the mean of their neighbours, each followed by Newton steps back onto the surface.
    Source: Botsch and Kobbelt 2004, "A remeshing approach to multiresolution modeling".
    Differs: labels of faces keep the sharp edges; edges flip by angles, not by valence.

    Args:
        solid: The meshed solid.
        mesh: Mesh from :func:`contour`.
        size: Wanted edge length, model units: a number, or a function of positions (V, 3).
        num_rounds: Number of rounds; up to four more follow while a few faces point away from their surfaces.
        relaxation: Share of the way to the neighbours' mean that vertices move in each round; 0 keeps them irregular.
        generator: Source of the order in which edges collapse.
    """
    pos, face, label = (x.numpy() for x in (mesh.pos, mesh.face.t().contiguous(), mesh.label))
    for turn in range(num_rounds + 4):
        wanted = size(torch.from_numpy(pos)).numpy() if callable(size) else np.full(pos.shape[0], size)
        pos, face, label, wanted = split_edges(pos, face, label, wanted, 1.35)
        pos = _back(solid, pos, face, label)
        for factor in (0.1, 0.25, 0.5, 0.75) if turn == 0 else (0.75,):
            order = torch.randperm(face.shape[0], generator=generator).numpy()
            alive = collapse_edges(pos, face, label, _normals(solid, pos, face, label), wanted, order, factor)
            face, label = face[alive], label[alive]
        pos, face, label = _compact(pos, face, label)
        pos = _unfold(solid, pos, face, label)
        flip_edges(pos, face, label, _normals(solid, pos, face, label), 8)
        if relaxation:
            pos = _relax(solid, pos, face, label, relaxation)
            flip_edges(pos, face, label, _normals(solid, pos, face, label), 8)
        turned = (_agreement(pos, face, _normals(solid, pos, face, label)) < 0.7).sum()
        if turn + 1 >= num_rounds and (turned == 0 or turned > 20):
            break
    return LabelledMesh(torch.from_numpy(pos), torch.from_numpy(face).t().contiguous(), torch.from_numpy(label))


def shake(solid: Solid, mesh: LabelledMesh, length: float, generator: Generator | None = None) -> LabelledMesh:
    """Move the vertices at random by about ``length`` along their surfaces and curves."""
    pos, face, label = (x.numpy() for x in (mesh.pos, mesh.face.t().contiguous(), mesh.label))
    offset = length * torch.randn(mesh.pos.shape, generator=generator, dtype=torch.float64).numpy()
    free = _targets(pos, face, label)[1]
    moved = _settle(solid, pos, pos + np.where(free[:, None], offset, 0.0), face, label)
    return LabelledMesh(torch.from_numpy(moved), mesh.face, mesh.label)


def _back(solid: Solid, pos: np.ndarray, face: np.ndarray, label: np.ndarray) -> np.ndarray:
    vertex = torch.from_numpy(face).reshape(-1)
    return project(solid, torch.from_numpy(pos), vertex, torch.from_numpy(label).repeat_interleave(3), 3).numpy()


def _normals(solid: Solid, pos: np.ndarray, face: np.ndarray, label: np.ndarray) -> np.ndarray:
    """Outward unit normals (F, 3) of the surfaces at the faces' centroids."""
    return solid.normals(torch.from_numpy(pos[face].mean(1)), torch.from_numpy(label)).numpy()


def _relax(solid: Solid, pos: np.ndarray, face: np.ndarray, label: np.ndarray, share: float) -> np.ndarray:
    """Move vertices towards the mean of their neighbours, along curves on curves."""
    target, free = _targets(pos, face, label)
    return _settle(solid, pos, np.where(free[:, None], pos + share * (target - pos), pos), face, label)


def _settle(solid: Solid, pos: np.ndarray, moved: np.ndarray, face: np.ndarray, label: np.ndarray) -> np.ndarray:
    """Bring moved vertices back onto their surfaces; moves that turn a face away from its surface are undone."""
    moved = _back(solid, moved, face, label)
    normal = _normals(solid, pos, face, label)
    before = _agreement(pos, face, normal)
    for _ in range(10):
        turned = (_agreement(moved, face, normal) < np.minimum(0.8, before)) & (before > 0.5)
        if not turned.any():
            return moved
        moved[face[turned]] = pos[face[turned]]
    return pos


def _unfold(solid: Solid, pos: np.ndarray, face: np.ndarray, label: np.ndarray) -> np.ndarray:
    """Move the vertices of inverted faces to the mean of their neighbours, up to eight times."""
    for _ in range(8):
        turned = _agreement(pos, face, _normals(solid, pos, face, label)) < 0.5
        if not turned.any():
            break
        target, free = _targets(pos, face, label)
        moves = np.zeros(len(pos), dtype=bool)
        moves[face[turned]] = True
        moves &= free
        near = moves[face].any(1)
        pos = np.where(moves[:, None], target, pos)
        pos = np.where(moves[:, None], _back(solid, pos, face[near], label[near]), pos)
    return pos


def _targets(pos: np.ndarray, face: np.ndarray, label: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean (V, 3) of each vertex's neighbours, on a curve of its two neighbours there, and which vertices may move."""
    half = np.sort(np.stack([face, np.roll(face, -1, 1)], -1).reshape(-1, 2), 1)
    key, inverse, count = np.unique(half @ (len(pos), 1), return_inverse=True, return_counts=True)
    edge = np.stack(np.divmod(key, len(pos)), 1)
    owner = np.repeat(label, 3)
    low, high = np.full(len(edge), np.iinfo(np.int64).max), np.full(len(edge), -1)
    np.minimum.at(low, inverse, owner)
    np.maximum.at(high, inverse, owner)
    feature = (low != high) | (count != 2)
    curves = np.bincount(edge[feature].ravel(), minlength=len(pos))
    total, weight = np.zeros_like(pos), np.zeros(len(pos))
    for rows, chosen in ((edge, curves == 0), (edge[feature], curves == 2)):
        for a, b in ((0, 1), (1, 0)):
            use = chosen[rows[:, a]]
            np.add.at(total, rows[use, a], pos[rows[use, b]])
            np.add.at(weight, rows[use, a], 1.0)
    return total / np.maximum(weight, 1.0)[:, None], weight > 0


def _agreement(pos: np.ndarray, face: np.ndarray, normal: np.ndarray) -> np.ndarray:
    a, b, c = pos[face[:, 0]], pos[face[:, 1]], pos[face[:, 2]]
    cross = np.cross(b - a, c - a)
    return (cross * normal).sum(1) / np.maximum(np.linalg.norm(cross, axis=1), 1e-30)


def _compact(pos: np.ndarray, face: np.ndarray, label: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    used, inverse = np.unique(face, return_inverse=True)
    return pos[used], np.ascontiguousarray(inverse.reshape(face.shape)), label
