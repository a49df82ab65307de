"""Training patches that are cut once and cached."""

import numpy as np
import torch
from torch import Tensor
from torch_geometric.data import Data

from dnf_pyg.datasets.mesh_dataset import Arrays, MeshDataset
from dnf_pyg.patches.patch import FaceFeatures, Patch, PatchExtractor, patch_to_data

__all__ = ["PatchDataset"]


class PatchDataset(MeshDataset):
    """Patches that are cut once, ``patches.num_patches`` of each mesh.

    A pair of a noisy and a clean file gives patches of the noisy mesh. A clean file alone gives patches of the
    clean mesh; its noise is drawn each time a patch is served, for the vertices of the patch only, along the vertex
    normals and in mean edge lengths of the whole mesh.

    The arguments and errors are those of :class:`~dnf_pyg.datasets.MeshDataset`.
    """

    def get(self, idx: int) -> Data:
        """Serve one patch."""
        mesh, row = divmod(idx, self.patches.num_patches)
        entry = self._entry(mesh)
        size = int(entry["size"][row])
        face_id = entry["face_id"][row, :size].astype(np.int64)
        if self._needs_mesh(mesh):
            pos, face, _ = self._region(entry, face_id, mesh, self._generator(idx))
            features = FaceFeatures.from_mesh(pos, face)
        else:
            stored = [name for name in FaceFeatures._fields if name in entry]
            features = FaceFeatures(**{name: torch.from_numpy(entry[name][face_id]) for name in stored})
        neighbor = torch.from_numpy(entry["nearest"][row, :size, :size].copy())
        distance = torch.from_numpy(entry["distance"][row, :size].copy())
        clean_normal = torch.from_numpy(entry["clean_normal"][face_id])
        rows = torch.arange(size, device="cpu")
        data = patch_to_data(Patch(rows, neighbor, distance), features, clean_normal)
        data.face_id = torch.from_numpy(face_id)
        return data

    def _parameters(self) -> dict[str, str]:
        options = {**vars(self.patches), "growth": self.growth, "seeds": self.seeds}
        return {"class": "PatchDataset", **{name: repr(value) for name, value in options.items()}}

    def _arrays(self, row: int, extractor: PatchExtractor, normal: Tensor, face: Tensor) -> Arrays:
        options = self.patches
        generator = torch.Generator().manual_seed(options.seed + int(self.processed_file_names[row][-8:], 16))
        shape = (options.num_patches, options.patch_size)
        arrays: Arrays = {
            "size": np.zeros(options.num_patches, np.int32),
            "face_id": np.full(shape, -1, np.int32),
            "nearest": np.full((*shape, options.k), -1, np.int16),
            "distance": np.zeros(shape, np.float32),
        }
        seeds = self.seeds(normal, face, options.num_patches, generator)
        for number, patch in enumerate(map(extractor.extract, seeds.tolist())):
            size, k = patch.neighbor.shape
            arrays["size"][number] = size
            arrays["face_id"][number, :size] = patch.face_id
            arrays["nearest"][number, :size, :k] = patch.neighbor
            arrays["distance"][number, :size] = patch.distance
        return arrays
