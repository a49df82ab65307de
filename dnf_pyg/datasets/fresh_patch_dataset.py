"""Training patches that are cut anew each time they are served."""

import numpy as np
import torch
from torch import Tensor
from torch_geometric.data import Data

from dnf_pyg.datasets.mesh_dataset import Arrays, MeshDataset
from dnf_pyg.mesh import DijkstraGrowth, FacetGraph, Growth
from dnf_pyg.mesh.geodesic import BoundDijkstra
from dnf_pyg.patches.patch import FaceFeatures, PatchExtractor, patch_to_data

__all__ = ["FreshPatchDataset"]


class FreshPatchDataset(MeshDataset):
    """Patches that are cut when they are served, from a new seed each time: no two epochs are alike.

    The noise of a clean mesh is drawn first, so that the patch and its nearest faces follow the noisy surface, as they
    do when a mesh is denoised. Only the meshes and their facet graphs are kept on disk.

    The arguments and errors are those of :class:`~dnf_pyg.datasets.MeshDataset`.

    Raises:
        ValueError: If ``patches.growth`` is not Dijkstra's algorithm.
    """

    def get(self, idx: int) -> Data:
        """Serve one patch."""
        mesh = idx // self.patches.num_patches
        entry = self._entry(mesh)
        generator = self._generator(idx)
        share = torch.rand((), generator=generator, dtype=torch.double, device="cpu")
        seed = int(np.searchsorted(entry["chance"], float(share)))
        graph = FacetGraph(entry["ptr"], entry["neighbor"], entry["length"], 1.0)
        size = self.patches.patch_size
        wider, _ = BoundDijkstra(graph).grow(seed, size + size // 4)  # noise moves the rim
        pos, face, member = self._region(entry, wider.numpy(), mesh, generator)
        patch = self._extractor(pos, face).extract(0)
        clean_normal = torch.from_numpy(entry["clean_normal"][member.numpy()])
        earlier = torch.from_numpy(entry["earlier"][member.numpy()]) if "earlier" in entry else None
        data = patch_to_data(patch, FaceFeatures.from_mesh(pos, face, earlier), clean_normal)
        data.face_id = member[data.face_id]
        return data

    def _needs_mesh(self, row: int) -> bool:
        return True

    @property
    def growth(self) -> Growth:
        """How patches grow."""
        if self.patches.growth is not None and not isinstance(self.patches.growth, DijkstraGrowth):
            raise ValueError(
                f"Expected 'growth' DijkstraGrowth() for patches that are cut anew (got {self.patches.growth}). "
                "The heat method would factorize a mesh for every patch: cut the patches once, or leave 'growth' out."
            )
        return DijkstraGrowth()

    def _parameters(self) -> dict[str, str]:
        return {"class": "FreshPatchDataset", "growth": repr(self.growth), "seeds": repr(self.seeds)}

    def _arrays(self, row: int, extractor: PatchExtractor, normal: Tensor, face: Tensor) -> Arrays:
        chance = self.seeds.weight(normal, face).cumsum(0)
        return {"length": extractor.graph.length, "chance": (chance / chance[-1]).numpy()}
