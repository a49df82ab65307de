"""Data sets of training patches, prepared once per mesh and mapped into memory."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track
from torch import Tensor
from torch_geometric.data import Data, Dataset

from dnf_pyg.data.cache import load_entry, name_entry, write_entry
from dnf_pyg.data.patch import Patch, PatchExtractor, patch_to_data
from dnf_pyg.data.seeds import AnisotropicSeeds, SeedSampler
from dnf_pyg.errors import DataError
from dnf_pyg.mesh import DijkstraGrowth, Growth, filled_face_normals, mean_edge_length
from dnf_pyg.mesh.io import read_mesh
from dnf_pyg.mesh.noise import Noise

__all__ = ["PatchDataset"]

MeshPair = tuple[str | Path | None, str | Path]


class PatchDataset(Dataset):
    """Serve patches of meshes: P of each, in the form of :func:`~dnf_pyg.data.patch_to_data`.

    A pair of a noisy and a clean file gives patches of the noisy mesh. A clean file alone gives patches of the
    clean mesh, and the noise is drawn afresh each time a patch is served: on its vertices only, along the normals
    and in the mean edge length of the whole mesh.

    Patches are cut once and kept in ``root/processed``, in one folder per pair, named after every parameter and the
    content of the files: what changed is prepared again. Workers and ranks map the same files, without copies.

    Args:
        pairs: Noisy file (or ``None``) and clean file of each mesh, with the same faces in the same order.
        root: Folder in which ``processed`` is written.
        num_patches: Patches per mesh P.
        patch_size: Faces per patch N.
        k: Nearest faces kept for each face, itself included.
        seeds: How seeds are drawn.
        growth: How patches grow.
        noise: Noise for the clean files that come alone.
        noise_level: Smallest and largest level, multiples of the mean edge length; each patch draws its own.
        noise_seed: Give every patch always the same noise, drawn from this seed (validation).
        transform: Applied to each patch when it is served.
        seed: Start of the random numbers that draw the seeds.
        num_workers: Threads that prepare.

    Raises:
        DataError: If there is no pair, a pair does not match, or a clean file comes alone and ``noise`` is missing.
        MeshFileError: If a file cannot be read.
    """

    def __init__(
        self,
        pairs: Sequence[MeshPair],
        root: str | Path,
        num_patches: int = 100,
        patch_size: int = 800,
        k: int = 50,
        seeds: SeedSampler | None = None,
        growth: Growth | None = None,
        noise: Noise | None = None,
        noise_level: tuple[float, float] = (0.1, 0.3),
        noise_seed: int | None = None,
        transform: Callable[[Data], Data] | None = None,
        seed: int = 0,
        num_workers: int = 2,
    ) -> None:
        if not pairs:
            raise DataError("Expected at least one mesh (got none). Check the folder that the meshes are listed from.")
        self.pairs = [(Path(noisy) if noisy else None, Path(clean)) for noisy, clean in pairs]
        alone = next((clean for noisy, clean in self.pairs if noisy is None), None)
        if noise is None and alone:
            raise DataError(f"Expected 'noise' for a clean mesh without a noisy one (got None for '{alone}').")
        self.num_patches = num_patches
        self.patch_size = patch_size
        self.k = k
        self.seeds = seeds or AnisotropicSeeds()
        self.growth = growth or DijkstraGrowth()
        self.noise = noise
        self.noise_level = noise_level
        self.noise_seed = noise_seed
        self.seed = seed
        self.num_workers = num_workers
        self._names: list[str] | None = None
        self._entries: dict[int, dict[str, NDArray]] = {}
        super().__init__(str(root), transform=transform, log=False)

    @property
    def raw_paths(self) -> list[str]:
        """Files that the data set is made from."""
        return [str(path) for pair in self.pairs for path in pair if path is not None]

    @property
    def processed_file_names(self) -> list[str]:
        """Folder of each pair, named after all that shapes it."""
        if self._names is None:
            parameters = {
                name: repr(getattr(self, name))
                for name in ("num_patches", "patch_size", "k", "seeds", "growth", "seed")
            }
            self._names = [name_entry([path for path in pair if path], parameters) for pair in self.pairs]
        return self._names

    def process(self) -> None:
        """Prepare the pairs that are not there yet."""
        missing = [row for row, path in enumerate(self.processed_paths) if not Path(path).is_dir()]
        with ThreadPoolExecutor(self.num_workers) as pool:
            done = pool.map(self._prepare, missing)
            for _ in track(done, "Preparing patches", len(missing), console=Console(stderr=True)):
                pass

    def len(self) -> int:
        """Number of patches of all meshes."""
        return len(self.pairs) * self.num_patches

    def get(self, idx: int) -> Data:
        """Serve one patch."""
        mesh, row = divmod(idx, self.num_patches)
        if mesh not in self._entries:
            self._entries[mesh] = load_entry(self.processed_paths[mesh])
        entry = self._entries[mesh]
        size = int(entry["size"][row])
        face_id = torch.from_numpy(entry["face_id"][row, :size].astype(np.int64))
        patch = Patch(face_id, _tensor(entry["neighbor"][row, :size]), _tensor(entry["distance"][row, :size]))
        data = patch_to_data(patch._replace(face_id=torch.arange(size)), *self._normals(entry, patch, idx))
        data.face_id = face_id
        return data

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_entries": {}}  # maps would be pickled as copies

    def _normals(self, entry: dict[str, NDArray], patch: Patch, idx: int) -> tuple[Tensor, Tensor]:
        """Input and target normals of the faces of a patch, (N, 3) each."""
        face_id = patch.face_id.numpy()
        clean_normal = _tensor(entry["clean_normal"][face_id])
        if "normal" in entry:
            return _tensor(entry["normal"][face_id]), clean_normal
        assert self.noise is not None  # by __init__
        generator = torch.Generator().manual_seed(
            int(torch.randint(2**62, ())) if self.noise_seed is None else self.noise_seed + idx
        )
        low, high = self.noise_level
        level = low + (high - low) * float(torch.rand((), generator=generator))
        pos, face = _surroundings(entry, face_id)
        noisy = self.noise(pos, face, level / mean_edge_length(pos, face).item(), generator)
        return filled_face_normals(noisy, face)[: len(face_id)], clean_normal

    def _prepare(self, row: int) -> None:
        noisy_path, clean_path = self.pairs[row]
        clean = read_mesh(clean_path)
        mesh = read_mesh(noisy_path) if noisy_path else clean
        if not torch.equal(mesh.face, clean.face):
            raise DataError(
                f"Expected the same faces in the same order in '{noisy_path}' and '{clean_path}' "
                f"(got {mesh.face.size(1)} and {clean.face.size(1)} faces). Export both from the same mesh."
            )
        extractor = PatchExtractor(mesh.pos, mesh.face, self.growth, self.patch_size, self.k)
        normal = filled_face_normals(mesh.pos, mesh.face)
        name = self.processed_file_names[row]
        generator = torch.Generator().manual_seed(self.seed + int(name[-8:], 16))
        seeds = self.seeds(normal, mesh.face, self.num_patches, generator)
        arrays: dict[str, NDArray] = {
            "size": np.zeros(self.num_patches, np.int32),
            "face_id": np.full((self.num_patches, self.patch_size), -1, np.int32),
            "neighbor": np.full((self.num_patches, self.patch_size, self.k), -1, np.int16),
            "distance": np.zeros((self.num_patches, self.patch_size), np.float32),
            "clean_normal": filled_face_normals(clean.pos, clean.face).float().numpy(),
        }
        for number, patch in enumerate(map(extractor.extract, seeds.tolist())):
            size, k = patch.neighbor.shape
            arrays["size"][number] = size
            arrays["face_id"][number, :size] = patch.face_id
            arrays["neighbor"][number, :size, :k] = patch.neighbor
            arrays["distance"][number, :size] = patch.distance
        if noisy_path:
            arrays["normal"] = normal.float().numpy()
        else:
            unit = mean_edge_length(mesh.pos, mesh.face) or 1.0
            arrays["pos"] = ((mesh.pos - mesh.pos.mean(dim=0)) / unit).float().numpy()
            arrays["face"] = mesh.face.t().int().numpy()
            arrays["ring_ptr"] = extractor.graph.ptr
            arrays["ring"] = extractor.graph.neighbor
        write_entry(Path(self.processed_dir) / name, arrays)


def _tensor(rows: NDArray) -> Tensor:
    """Copy rows out of the map."""
    return torch.from_numpy(np.array(rows))


def _surroundings(entry: dict[str, NDArray], face_id: NDArray[np.int64]) -> tuple[Tensor, Tensor]:
    """Mesh of a patch and the faces around it, the patch first: complete fans at all vertices of the patch."""
    ptr = entry["ring_ptr"]
    around = np.concatenate([entry["ring"][ptr[f] : ptr[f + 1]] for f in face_id])
    face = entry["face"][np.concatenate([face_id, np.setdiff1d(around, face_id)])]
    vertex, corner = np.unique(face, return_inverse=True)
    return _tensor(entry["pos"][vertex]), torch.from_numpy(corner.reshape(-1, 3).T.copy())
