"""Pairs of meshes that are prepared once and mapped into memory: the base of the data sets of patches."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import torch
from numpy.typing import NDArray
from torch import Generator, Tensor
from torch_geometric.data import Data, Dataset
from tqdm import tqdm

from dnf_pyg.datasets.cache import load_entry, name_entry, write_entry
from dnf_pyg.datasets.submesh import surroundings
from dnf_pyg.errors import DataError
from dnf_pyg.io import read_mesh
from dnf_pyg.mesh import DijkstraGrowth, Growth, filled_face_normals, mean_edge_length
from dnf_pyg.mesh.noise import Noise
from dnf_pyg.patches.options import PatchOptions
from dnf_pyg.patches.patch import FaceFeatures, PatchExtractor
from dnf_pyg.patches.seeds import AnisotropicSeeds

__all__ = ["Arrays", "MeshDataset", "Refine"]

Arrays = dict[str, NDArray]
Refine = Callable[[Tensor, Tensor], tuple[Tensor, Tensor]]


class MeshDataset(Dataset, ABC):
    """Patches of pairs of meshes, in the form of :func:`~dnf_pyg.patches.patch_to_data`.

    The meshes are prepared in ``root/processed``, in one folder per pair, named after every parameter and the content
    of the files: what has changed is prepared again. Workers and processes map the same files, without copies.

    Args:
        root: Folder in which ``processed`` is written.
        pairs: Noisy file (or ``None``) and clean file of each mesh, with the same faces in the same order.
        patches: Number and size of the patches; the paper's by default.
        transform: Applied to each patch when it is served.
        noise: Noise for the clean meshes that come without a noisy file.
        noise_level: Smallest and largest noise level, multiples of the mean edge length; each patch draws its own.
        noise_seed: Draw the noise of every item from this seed, the same each time (validation); a new one each time
            if not given.
        num_workers: Threads that prepare the meshes.
        refine: Gives what earlier networks make of a noisy mesh (V, 3) and (3, F): its positions (V, 3) and further
            facet normals (F, M, 3), the attribute ``earlier`` of the patches. Its ``repr`` enters the names of the
            folders.

    Raises:
        DataError: If there is no pair, a file is missing, a pair does not match, or a clean mesh comes without noisy
            file and ``noise``, or without noisy file and with ``refine``.
        ValueError: If ``noise_level`` is out of range.
    """

    def __init__(
        self,
        root: str | Path,
        pairs: Sequence[tuple[str | Path | None, str | Path]],
        patches: PatchOptions | None = None,
        transform: Callable[[Data], Data] | None = None,
        *,
        noise: Noise | None = None,
        noise_level: tuple[float, float] = (0.1, 0.3),
        noise_seed: int | None = None,
        num_workers: int = 2,
        refine: Refine | None = None,
    ) -> None:
        if not pairs:
            raise DataError("Expected at least one mesh (got none). Check the folder that the meshes are listed from.")
        self.pairs = [(Path(noisy) if noisy else None, Path(clean)) for noisy, clean in pairs]
        for path in (path for pair in self.pairs for path in pair if path):
            if not path.is_file():
                raise DataError(f"Expected a mesh file (got '{path}', which does not exist). Check the path.")
        alone = next((clean for noisy, clean in self.pairs if noisy is None), None)
        if noise is None and alone:
            raise DataError(
                f"Expected 'noise' for a clean mesh without a noisy one (got None for '{alone}'). Name a noise model."
            )
        if refine is not None and alone:
            raise DataError(
                f"Expected a noisy file of each mesh that is refined (got none for '{alone}'). Add noise to the mesh "
                "with `dnf-pyg add-noise`."
            )
        if not 0 <= noise_level[0] <= noise_level[1]:
            raise ValueError(
                f"Expected 'noise_level' as 0 <= smallest <= largest (got {noise_level}). Put the smaller level first."
            )
        self.patches = patches or PatchOptions()
        self.seeds = AnisotropicSeeds()
        self.noise = noise
        self.noise_level = noise_level
        self.noise_seed = noise_seed
        self.num_workers = num_workers
        self.refine = refine
        self._names: list[str] | None = None
        self._entries: dict[int, Arrays] = {}
        super().__init__(str(root), transform=transform, log=False)

    @property
    def growth(self) -> Growth:
        """How patches grow."""
        return self.patches.growth or DijkstraGrowth()

    @property
    def raw_paths(self) -> list[str]:
        """Files that the data set is made from."""
        return [str(path) for pair in self.pairs for path in pair if path is not None]

    @property
    def processed_file_names(self) -> list[str]:
        """Folder of each pair, named after everything that shapes it."""
        if self._names is None:
            parameters = self._parameters() | ({} if self.refine is None else {"refine": repr(self.refine)})
            self._names = [name_entry([path for path in pair if path], parameters) for pair in self.pairs]
        return self._names

    def process(self) -> None:
        """Prepare the pairs that have not been prepared yet."""
        missing = [row for row, path in enumerate(self.processed_paths) if not Path(path).is_dir()]
        with ThreadPoolExecutor(self.num_workers) as pool:
            for _ in tqdm(pool.map(self._prepare, missing), "Preparing patches", len(missing)):
                pass

    def len(self) -> int:
        """Number of patches of all meshes."""
        return len(self.pairs) * self.patches.num_patches

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_entries": {}}  # memory maps would be pickled as copies

    @abstractmethod
    def _parameters(self) -> dict[str, str]:
        """Values that shape an entry."""

    @abstractmethod
    def _arrays(self, row: int, extractor: PatchExtractor, normal: Tensor, face: Tensor) -> Arrays:
        """Arrays of an entry that only this kind of data set needs."""

    def _needs_mesh(self, row: int) -> bool:
        """Whether the items of a pair need the mesh itself, not only its facet normals."""
        return self.pairs[row][0] is None

    def _prepare(self, row: int) -> None:
        noisy_path, clean_path = self.pairs[row]
        clean = read_mesh(clean_path)
        mesh = read_mesh(noisy_path) if noisy_path else clean
        if not torch.equal(mesh.face, clean.face):
            raise DataError(
                f"Expected the same faces in the same order in '{noisy_path}' and '{clean_path}' "
                f"(got {mesh.face.size(1)} and {clean.face.size(1)} faces). Export both from the same mesh."
            )
        pos, earlier = (mesh.pos, None) if self.refine is None else self.refine(mesh.pos, mesh.face)
        extractor = self._extractor(pos, mesh.face)
        normal = filled_face_normals(pos, mesh.face)
        arrays = self._arrays(row, extractor, normal, mesh.face)
        arrays["clean_normal"] = filled_face_normals(clean.pos, clean.face).float().numpy()
        if self._needs_mesh(row):
            unit = float(mean_edge_length(pos, mesh.face)) or 1.0
            arrays["pos"] = ((pos - pos.mean(dim=0)) / unit).float().numpy()
            arrays["face"] = mesh.face.t().int().numpy()
            arrays["ptr"] = extractor.graph.ptr
            arrays["neighbor"] = extractor.graph.neighbor
            if earlier is not None:
                arrays["earlier"] = earlier.float().numpy()
        else:
            features = FaceFeatures.from_mesh(pos - pos.mean(dim=0), mesh.face, earlier)
            arrays |= {name: value.float().numpy() for name, value in features._asdict().items() if value is not None}
        write_entry(Path(self.processed_paths[row]), arrays)

    def _extractor(self, pos: Tensor, face: Tensor) -> PatchExtractor:
        return PatchExtractor(pos, face, self.growth, self.patches.patch_size, self.patches.k)

    def _entry(self, mesh: int) -> Arrays:
        if mesh not in self._entries:
            self._entries[mesh] = load_entry(self.processed_paths[mesh])
        return self._entries[mesh]

    def _region(
        self, entry: Arrays, face_id: NDArray, mesh: int, generator: Generator
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Cut out faces with those around them, and add noise to the vertices where the mesh has no noisy file.

        Returns positions (W, 3) in mean edge lengths of the mesh, faces (3, M), and their rows in the mesh (M,).
        """
        vertex_id, corner, member = surroundings(
            entry["face"], entry["ptr"], entry["neighbor"], face_id, len(entry["pos"])
        )
        pos, face = torch.from_numpy(entry["pos"][vertex_id]), torch.from_numpy(corner)
        if self.noise is not None and self.pairs[mesh][0] is None:
            low, high = self.noise_level
            level = low + (high - low) * float(torch.rand((), generator=generator))
            pos = self.noise(pos, face, level / (float(mean_edge_length(pos, face)) or 1.0), generator)
        return pos, face, torch.from_numpy(member)

    def _generator(self, idx: int) -> Generator:
        """Random numbers of one item: the same each time, or drawn from the global generator of this worker."""
        seed = int(torch.randint(2**62, (), device="cpu")) if self.noise_seed is None else self.noise_seed + idx
        return torch.Generator().manual_seed(seed)
