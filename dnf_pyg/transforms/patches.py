"""Patches of a mesh as PyG data."""

import torch
from torch_geometric.data import Batch, Data
from torch_geometric.transforms import BaseTransform

from dnf_pyg.mesh import filled_face_normals
from dnf_pyg.patches import AnisotropicSeeds, FaceFeatures, PatchExtractor, PatchOptions, patch_to_data

__all__ = ["CutPatches"]


class CutPatches(BaseTransform):
    """Cut random patches out of a mesh ``Data(pos, face)``: a ``Batch`` whose nodes are faces.

    The attributes are listed in :mod:`dnf_pyg.patches.patch`. Where the mesh has ``clean_pos``, the clean facet normals
    are ``y``. Seeds are drawn as for training (:class:`~dnf_pyg.patches.AnisotropicSeeds`).

    Args:
        patches: Number and size of the patches; ``seed`` is not used.
        generator: Source of randomness; the default of torch if not given.

    Raises:
        MeshError: When applied, see :func:`~dnf_pyg.mesh.validate_mesh`.

    Example:
        >>> pos = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
        >>> mesh = Data(pos=pos, face=torch.tensor([[0, 1], [1, 3], [2, 2]]))
        >>> CutPatches(PatchOptions(num_patches=5))(mesh).num_graphs
        5
    """

    def __init__(self, patches: PatchOptions | None = None, generator: torch.Generator | None = None) -> None:
        self.patches = patches or PatchOptions()
        self.generator = generator

    def forward(self, data: Data) -> Batch:
        """Cut patches out of a mesh."""
        options = self.patches
        features = FaceFeatures.from_mesh(data.pos, data.face)
        clean = filled_face_normals(data.clean_pos, data.face) if "clean_pos" in data else None
        extractor = PatchExtractor(data.pos, data.face, options.growth, options.patch_size, options.k)
        seeds = AnisotropicSeeds()(features.normal, data.face, options.num_patches, self.generator)
        patches = map(extractor.extract, seeds.tolist())
        return Batch.from_data_list([patch_to_data(patch, features, clean) for patch in patches])

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.patches!r})"
