"""Coarse versions of a mesh, on which noise of long range looks like noise of short range."""

from typing import NamedTuple

import fast_simplification
import numpy as np
import torch
from numba import njit
from numpy.typing import NDArray
from torch import Tensor

from dnf_pyg.mesh.geometry import mean_edge_length
from dnf_pyg.mesh.topology import Topology

__all__ = ["CoarseMesh", "coarsen"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class CoarseMesh(NamedTuple):
    """A coarse version of a mesh, and the way back.

    Attributes:
        pos: Vertex positions, (W, 3) float64.
        face: Vertices of each face, (3, M).
        corner: Coarse vertices that each vertex of the fine mesh follows, (V, 3).
        weight: Their weights, (V, 3), which add up to 1; 0 for vertices of the fine mesh without a face.
    """

    pos: Tensor
    face: Tensor
    corner: Tensor
    weight: Tensor

    def prolong(self, displacement: Tensor) -> Tensor:
        """Interpolate displacements (W, 3) of the coarse vertices at the vertices of the fine mesh, (V, 3)."""
        return (displacement[self.corner] * self.weight.unsqueeze(2)).sum(dim=1)


def coarsen(pos: Tensor, face: Tensor, share: float = 0.25) -> CoarseMesh:
    """Decimate a mesh, and find where its vertices lie on the coarse version.

    Faces are merged where that changes the surface least (quadric error metric), so sharp edges stay. Each vertex
    takes the barycentric coordinates of the nearest point among the coarse faces around the vertex that it was merged
    into: another sheet of the surface is never mistaken for its own.

    Source: Garland and Heckbert 1997, "Surface simplification using quadric error metrics", by the library
    fast-simplification.

    Args:
        pos: Vertex positions, (V, 3), model units.
        face: Vertices of each face, (3, F).
        share: Share of the faces to keep, about.

    Raises:
        ValueError: If ``share`` is not between 0 and 1.

    Example:
        >>> import trimesh
        >>> sphere = trimesh.creation.icosphere(subdivisions=3)
        >>> pos, face = torch.tensor(sphere.vertices), torch.tensor(sphere.faces).t()
        >>> coarse = coarsen(pos, face)
        >>> face.size(1), coarse.face.size(1), bool((coarse.prolong(coarse.pos) - pos).norm(dim=1).max() < 0.1)
        (1280, 320, True)
    """
    if not 0 < share < 1:
        raise ValueError(f"Expected 'share' between 0 and 1 (got {share}). Use 0.25 for edges of twice the length.")
    pos = pos.detach().cpu().double()
    used, corner = face.cpu().unique(return_inverse=True)
    centre, unit = pos[used].mean(dim=0), float(mean_edge_length(pos, face)) or 1.0
    fine = ((pos[used] - centre) / unit).numpy()
    points, triangles = fine.astype(np.float32), np.ascontiguousarray(corner.t().int().numpy())
    *_, collapses = fast_simplification.simplify(points, triangles, target_reduction=1 - share, return_collapses=True)
    kept, faces, merged = fast_simplification.replay_simplification(points, triangles, collapses)
    coarse, coarse_face = kept.astype(np.float64), torch.from_numpy(faces.astype(np.int64)).t()
    ptr, around = Topology(coarse_face, len(coarse)).vertex_faces
    found, weight = _nearest(
        fine,
        coarse,
        np.ascontiguousarray(coarse_face.t().numpy()),
        merged.astype(np.int64),
        ptr.numpy(),
        around.numpy(),
    )
    all_corners, all_weights = torch.zeros((len(pos), 3), dtype=torch.long), torch.zeros_like(pos)
    all_corners[used], all_weights[used] = torch.from_numpy(found), torch.from_numpy(weight)
    return CoarseMesh(torch.from_numpy(coarse) * unit + centre, coarse_face, all_corners, all_weights)


@njit(cache=True, nogil=True)
def _nearest(point: Floats, pos: Floats, face: Ints, merged: Ints, ptr: Ints, around: Ints) -> tuple[Ints, Floats]:
    """Corners (V, 3) and barycentric coordinates (V, 3) of the nearest point on the faces around a vertex each."""
    corner, weight = np.empty((len(point), 3), np.int64), np.zeros((len(point), 3))
    for v in range(len(point)):
        corner[v] = merged[v]
        weight[v, 0] = 1.0
        best = np.square(point[v] - pos[merged[v]]).sum()
        for f in around[ptr[merged[v]] : ptr[merged[v] + 1]]:
            a, b, c = pos[face[f, 0]], pos[face[f, 1]], pos[face[f, 2]]
            u, w = _on_triangle(point[v], a, b, c)
            distance = np.square(point[v] - (a + u * (b - a) + w * (c - a))).sum()
            if distance < best:
                best = distance
                corner[v] = face[f]
                weight[v, 0], weight[v, 1], weight[v, 2] = 1 - u - w, u, w
    return corner, weight


@njit(cache=True, nogil=True)
def _on_triangle(p: Floats, a: Floats, b: Floats, c: Floats) -> tuple[float, float]:
    """Coordinates (u, w) of the point a + u (b - a) + w (c - a) of a triangle that is nearest to p."""
    ab, ac, ap = b - a, c - a, p - a
    bb, bc, cc = (ab * ab).sum(), (ab * ac).sum(), (ac * ac).sum()
    pb, pc = (ap * ab).sum(), (ap * ac).sum()
    area = bb * cc - bc * bc
    if area > 0:
        u, w = (cc * pb - bc * pc) / area, (bb * pc - bc * pb) / area
        if u >= 0 and w >= 0 and u + w <= 1:
            return u, w
    on_ab = min(max(pb / bb, 0.0), 1.0) if bb > 0 else 0.0
    on_ac = min(max(pc / cc, 0.0), 1.0) if cc > 0 else 0.0
    across = bb + cc - 2 * bc
    on_bc = min(max((pc - pb - bc + bb) / across, 0.0), 1.0) if across > 0 else 0.0
    best_u, best_w = on_ab, 0.0
    best = np.square(ap - on_ab * ab).sum()
    second = np.square(ap - on_ac * ac).sum()
    if second < best:
        best_u, best_w, best = 0.0, on_ac, second
    if np.square(ap - ab - on_bc * (ac - ab)).sum() < best:
        best_u, best_w = 1 - on_bc, on_bc
    return best_u, best_w
