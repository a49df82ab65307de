"""One check of a mesh at the door, so that everything behind it can rely on what it gets.

What becomes of a fault (``tests/data/test_faulty_meshes.py`` has each of them); faces and vertices are never reordered:

=================================  ===================================================================================
open boundary                      patches end at it
several components, lone faces     a patch stays in its component; a small one gives patches and neighbours as few as it
                                   has
non-manifold edge, bow-tie vertex  all faces that share a vertex are neighbours, whatever their number; above 512 at one
                                   vertex only those close to each other in the file
zero-area face                     normal from the faces around it, (0, 0, 1) where there are none; otherwise as others
duplicate faces                    kept; at distance 1/65536 of the mean edge length from each other
duplicate vertices                 kept apart: faces that share none by number are not connected (weld them first)
unreferenced vertices              kept, without a normal
faces wound inconsistently         kept: their normals point the other way
any size, far from the origin      worked out about the centre in mean edge lengths, float64
all vertices in one point          faces count as one step apart; the heat method refuses it
no face, vertex out of range,      :class:`~dnf_pyg.errors.MeshError`
NaN, infinity, above 1e30
=================================  ===================================================================================
"""

import torch
from torch import Tensor

from dnf_pyg.errors import MeshError

__all__ = ["validate_mesh"]

_LIMIT = 1e30  # below: distances are finite in float32, products of coordinates in float64


def validate_mesh(pos: Tensor, face: Tensor) -> None:
    """Raise if a mesh cannot be processed at all.

    What passes is processed as it is, faults included: boundaries, components of any size, non-manifold edges
    and vertices, zero-area and duplicate faces, duplicate and unreferenced vertices, mixed winding.

    Args:
        pos: Vertex positions, shape (V, 3), floating point, model units.
        face: Vertices of each face, shape (3, F), int64.

    Raises:
        ValueError: If a shape or dtype is not the one above.
        MeshError: If there is no face, a face names a vertex that does not exist, or a coordinate is not
            finite or larger than 1e30.

    Example:
        >>> validate_mesh(torch.zeros(3, 3), torch.tensor([[0], [1], [5]]))
        Traceback (most recent call last):
        dnf_pyg.errors.MeshError: Expected vertex numbers from 0 to 2 in every face (got 5 in face 0). ...
    """
    if pos.dim() != 2 or pos.size(1) != 3 or not pos.is_floating_point():
        raise ValueError(f"Expected 'pos' of shape [num_vertices, 3] and floating point (got {_form(pos)})")
    if face.dim() != 2 or face.size(0) != 3 or face.dtype != torch.long:
        raise ValueError(f"Expected 'face' of shape [3, num_faces] and int64 (got {_form(face)})")
    if face.size(1) == 0:
        raise MeshError(f"Expected a mesh with faces (got {pos.size(0)} vertices, 0 faces). Mesh a point cloud first.")
    wrong = ((face < 0) | (face >= pos.size(0))).any(dim=0)
    if wrong.any():
        row = int(wrong.nonzero()[0])
        value = next(int(v) for v in face[:, row] if not 0 <= v < pos.size(0))
        raise MeshError(
            f"Expected vertex numbers from 0 to {pos.size(0) - 1} in every face (got {value} in face {row}). "
            "The file is damaged or incomplete: export the mesh again."
        )
    bad = ~(pos.abs() <= _LIMIT).all(dim=-1)
    if bad.any():
        row = int(bad.nonzero()[0])
        raise MeshError(
            f"Expected finite coordinates no larger than {_LIMIT:g} (got {pos[row].tolist()} at vertex {row}, "
            f"{int(bad.sum())} such vertices). Remove these vertices and their faces, or export the mesh again."
        )


def _form(tensor: Tensor) -> str:
    return f"{list(tensor.shape)} {str(tensor.dtype).removeprefix('torch.')}"
