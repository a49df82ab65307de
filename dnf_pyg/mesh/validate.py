"""Validation of a mesh before it is processed.

How faults are handled (tested in ``tests/datasets/test_faulty_meshes.py``); faces and vertices keep their order:

=================================  ===================================================================================
open boundary                      patches end at it
several components, lone faces     a patch stays in its component, and has no more faces and neighbours than that
non-manifold edge, bow-tie vertex  all faces that share a vertex are neighbours; of more than 64 at one vertex only
                                   those that are close to each other around it
zero-area face                     takes the normal of the faces around it, or (0, 0, 1) where there are none
duplicate faces                    kept, at a distance of 1/65536 of the mean edge length from each other
duplicate vertices                 kept; faces are neighbours only if they share a vertex number (weld the mesh first)
unreferenced vertices              kept, without a normal
inconsistent winding               kept; the normals of some faces point inwards
any size, far from the origin      computed about the centre in mean edge lengths and float64
all vertices at one point          faces count as one step apart; the heat method refuses the mesh
no face, vertex out of range,      :class:`~dnf_pyg.errors.MeshError`
NaN, infinity, above 1e30,
not one point, but below 1e-100
=================================  ===================================================================================
"""

import torch
from torch import Tensor

from dnf_pyg.errors import MeshError

__all__ = ["validate_mesh"]

_LIMIT = 1e30  # up to which distances are finite in float32 and products of coordinates in float64
_SMALLEST = 1e-100  # extent from which squares of distances do not vanish in float64


def validate_mesh(pos: Tensor, face: Tensor) -> None:
    """Raise an error if a mesh cannot be processed at all.

    Other faults are allowed: boundaries, components of any size, non-manifold edges and vertices, zero-area and
    duplicate faces, duplicate and unreferenced vertices, inconsistent winding.

    Args:
        pos: Vertex positions, shape (V, 3), floating point, model units.
        face: Vertices of each face, shape (3, F), int64.

    Raises:
        ValueError: If a shape or dtype is not the one above.
        MeshError: If there is no face, a face names a vertex that does not exist, a coordinate is not finite or
            larger than 1e30, or the extent is below 1e-100 without being 0.

    Example:
        >>> validate_mesh(torch.zeros(3, 3), torch.tensor([[0], [1], [5]]))
        Traceback (most recent call last):
        dnf_pyg.errors.MeshError: Expected vertex numbers from 0 to 2 in every face (got 5 in face 0). ...
    """
    if pos.dim() != 2 or pos.size(1) != 3 or not pos.is_floating_point():
        raise ValueError(f"Expected 'pos' of shape [num_vertices, 3] and a float dtype (got {_form(pos)}). Convert it.")
    if face.dim() != 2 or face.size(0) != 3 or face.dtype != torch.long:
        raise ValueError(f"Expected 'face' of shape [3, num_faces] and int64 (got {_form(face)}). Convert it.")
    if face.size(1) == 0:
        raise MeshError(f"Expected a mesh with faces (got {pos.size(0)} vertices, 0 faces). Mesh a point cloud first.")
    wrong = ((face < 0) | (face >= pos.size(0))).any(dim=0)
    if wrong.any():
        row = int(wrong.nonzero()[0])
        value = next(int(v) for v in face[:, row] if not 0 <= v < pos.size(0))
        raise MeshError(
            f"Expected vertex numbers from 0 to {pos.size(0) - 1} in every face (got {value} in face {row}). "
            "Count from 0; a file with such faces is damaged: export it again."
        )
    bad = ~(pos.abs() <= _LIMIT).all(dim=-1)
    if bad.any():
        row = int(bad.nonzero()[0])
        raise MeshError(
            f"Expected finite coordinates no larger than {_LIMIT:g} (got {pos[row].tolist()} at vertex {row}, "
            f"{int(bad.sum())} such vertices). Remove these vertices and their faces, or export the mesh again."
        )
    corner = pos.detach()[face.flatten()]
    extent = float((corner.amax(dim=0) - corner.amin(dim=0)).max())
    if 0 < extent < _SMALLEST:
        raise MeshError(f"Expected a mesh of an extent of at least {_SMALLEST:g} (got {extent:g}). Scale it up.")


def _form(tensor: Tensor) -> str:
    return f"{list(tensor.shape)} {str(tensor.dtype).removeprefix('torch.')}"
