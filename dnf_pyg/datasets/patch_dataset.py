"""Training patches that are cut once and cached."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch_geometric.data import Data

from dnf_pyg.datasets.mesh_dataset import Arrays, MeshDataset, MeshPair
from dnf_pyg.datasets.packing import pack_rows, unpack_rows
from dnf_pyg.mesh import DijkstraGrowth, Growth, filled_face_normals
from dnf_pyg.patches.patch import Patch, PatchExtractor, face_surface, patch_to_data

__all__ = ["PatchDataset"]


class PatchDataset(MeshDataset):
    """Serve patches that are cut once: P of each mesh, in the form of :func:`~dnf_pyg.patches.patch_to_data`.

    A pair of a noisy and a clean file gives patches of the noisy mesh. A clean file alone gives patches of the
    clean mesh, and the noise is drawn afresh each time a patch is served: on its vertices only, along the normals
    and in the mean edge length of the whole mesh.

    Everything is kept in ``root/processed``, in one folder per pair, named after every parameter and the content of
    the files: what changed is prepared again. Workers and ranks map the same files, without copies.

    Args:
        pairs: Noisy file (or ``None``) and clean file of each mesh.
        root: Folder in which ``processed`` is written.
        growth: How patches grow.
        seed: Start of the random numbers that draw the seeds.
        options: All other arguments of :class:`~dnf_pyg.datasets.MeshDataset`, which lists the errors too.
    """

    def __init__(
        self,
        pairs: Sequence[MeshPair],
        root: str | Path,
        *,
        growth: Growth | None = None,
        seed: int = 0,
        **options: Any,
    ) -> None:
        self.growth = growth or DijkstraGrowth()
        self.seed = seed
        super().__init__(pairs, root, **options)

    def get(self, idx: int) -> Data:
        """Serve one patch."""
        mesh, row = divmod(idx, self.num_patches)
        entry = self._entry(mesh)
        size = int(entry["size"][row])
        face_id = entry["face_id"][row, :size].astype(np.int64)
        if self._serves_surface(mesh):
            pos, face, _ = self._region(entry, face_id, mesh, self._generator(idx))
            normal, surface = filled_face_normals(pos, face)[:size], face_surface(pos, face)[:size]
        else:
            normal, surface = (torch.from_numpy(entry[name][face_id]) for name in ("normal", "surface"))
        bits = self.patch_size.bit_length()
        neighbor = torch.from_numpy(unpack_rows(entry["packed"][row], bits, size, min(self.k, size)))
        distance = torch.from_numpy(entry["distance"][row, :size].copy())
        clean_normal = torch.from_numpy(entry["clean_normal"][face_id])
        data = patch_to_data(Patch(torch.arange(size), neighbor, distance), normal, clean_normal, surface)
        data.face_id = torch.from_numpy(face_id)
        return data

    def _parameters(self) -> dict[str, Any]:
        names = ("num_patches", "patch_size", "k", "seeds", "growth", "seed")
        return {"class": "PatchDataset", **{name: repr(getattr(self, name)) for name in names}}

    def _extractor(self, pos: Tensor, face: Tensor) -> PatchExtractor:
        return PatchExtractor(pos, face, self.growth, self.patch_size, self.k)

    def _arrays(self, row: int, extractor: PatchExtractor, normal: Tensor, face: Tensor) -> Arrays:
        generator = torch.Generator().manual_seed(self.seed + int(self.processed_file_names[row][-8:], 16))
        seeds, bits = self.seeds(normal, face, self.num_patches, generator), self.patch_size.bit_length()
        arrays: Arrays = {
            "size": np.zeros(self.num_patches, np.int32),
            "face_id": np.full((self.num_patches, self.patch_size), -1, np.int32),
            "packed": np.zeros((self.num_patches, -(-self.patch_size * self.k * bits // 8)), np.uint8),
            "distance": np.zeros((self.num_patches, self.patch_size), np.float32),
        }
        for number, patch in enumerate(map(extractor.extract, seeds.tolist())):
            size = len(patch.face_id)
            arrays["size"][number] = size
            arrays["face_id"][number, :size] = patch.face_id
            packed = pack_rows(patch.neighbor.numpy(), bits)
            arrays["packed"][number, : len(packed)] = packed
            arrays["distance"][number, :size] = patch.distance
        if not self._serves_surface(row):
            arrays["normal"] = normal.float().numpy()
        return arrays
