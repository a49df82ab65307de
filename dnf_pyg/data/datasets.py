"""Data sets of training patches: cut once and cached, or cut afresh each time."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch_geometric.data import Data

from dnf_pyg.data.mesh_dataset import Arrays, MeshDataset, MeshPair
from dnf_pyg.data.packing import pack_rows, unpack_rows
from dnf_pyg.data.patch import Patch, PatchExtractor, face_surface, patch_to_data
from dnf_pyg.mesh import DijkstraGrowth, FacetGraph, Growth, filled_face_normals
from dnf_pyg.mesh.geodesic import BoundDijkstra

__all__ = ["FreshPatchDataset", "PatchDataset"]


class PatchDataset(MeshDataset):
    """Serve patches that are cut once: P of each mesh, in the form of :func:`~dnf_pyg.data.patch_to_data`.

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
        options: All other arguments of :class:`~dnf_pyg.data.MeshDataset`, which lists the errors too.
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


class FreshPatchDataset(MeshDataset):
    """Serve patches that are cut when they are asked for, from a new seed each time: no two epochs are alike.

    Noise, where the clean file comes alone, is drawn first: the patch and its nearest faces then follow the noisy
    surface, as they will when a mesh is denoised. Only the meshes and their facet graphs are kept on disk, under the
    rules of :class:`PatchDataset`; patches grow by Dijkstra's search.

    The arguments are those of :class:`~dnf_pyg.data.MeshDataset`.
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
