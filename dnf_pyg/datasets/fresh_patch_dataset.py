"""Training patches that are cut anew each time they are served."""

from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch_geometric.data import Data

from dnf_pyg.datasets.mesh_dataset import Arrays, MeshDataset
from dnf_pyg.mesh import FacetGraph, filled_face_normals
from dnf_pyg.mesh.geodesic import BoundDijkstra
from dnf_pyg.patches.patch import PatchExtractor, face_surface, patch_to_data

__all__ = ["FreshPatchDataset"]


class FreshPatchDataset(MeshDataset):
    """Serve patches that are cut when they are asked for, from a new seed each time: no two epochs are alike.

    Noise, where the clean file comes alone, is drawn first: the patch and its nearest faces then follow the noisy
    surface, as they will when a mesh is denoised. Only the meshes and their facet graphs are kept on disk, under the
    rules of :class:`PatchDataset`; patches grow by Dijkstra's search.

    The arguments are those of :class:`~dnf_pyg.datasets.MeshDataset`.
    """

    def get(self, idx: int) -> Data:
        """Serve one patch."""
        mesh = idx // self.num_patches
        entry = self._entry(mesh)
        generator = self._generator(idx)
        seed = int(np.searchsorted(entry["chance"], float(torch.rand((), generator=generator, dtype=torch.double))))
        graph = FacetGraph(entry["ptr"], entry["neighbor"], entry["length"], 1.0)
        wider, _ = BoundDijkstra(graph).grow(seed, self.patch_size + self.patch_size // 4)  # noise shifts the rim
        pos, face, member = self._region(entry, wider.numpy(), mesh, generator)
        patch = self._extractor(pos, face).extract(0)
        clean_normal = torch.from_numpy(entry["clean_normal"][member.numpy()])
        data = patch_to_data(patch, filled_face_normals(pos, face), clean_normal, face_surface(pos, face))
        data.face_id = member[data.face_id]
        return data

    def _serves_surface(self, row: int) -> bool:
        return True

    def _parameters(self) -> dict[str, Any]:
        return {"class": "FreshPatchDataset", "seeds": repr(self.seeds)}

    def _arrays(self, row: int, extractor: PatchExtractor, normal: Tensor, face: Tensor) -> Arrays:
        chance = self.seeds.weight(normal, face).cumsum(0)
        return {"length": extractor.graph.length, "chance": (chance / chance[-1]).numpy()}
