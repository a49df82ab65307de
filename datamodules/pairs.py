"""Any folders of noisy and clean meshes with the same faces, paired by name."""

import re
from pathlib import Path

from torch.utils.data import Dataset

from dnf_pyg.datamodules.patches import OnBroken, PatchDataModule
from dnf_pyg.errors import DataError
from dnf_pyg.io import SUFFIXES
from dnf_pyg.mesh import Growth

__all__ = ["PairsDataModule", "find_pairs"]

Pair = tuple[Path, Path]


def find_pairs(noisy: str | Path, clean: str | Path, pattern: str) -> list[Pair]:
    """List noisy and clean files that belong together.

    Args:
        noisy: Folder of noisy meshes.
        clean: Folder of clean meshes; may be the same.
        pattern: Regular expression that a noisy name (without ending) matches; its first group is the clean name.

    Raises:
        DataError: If a folder is missing, or files of either have no partner: all of them are listed.
    """
    for folder in (Path(noisy), Path(clean)):
        if not folder.is_dir():
            raise DataError(f"Expected a folder of meshes (got '{folder}', which does not exist). Check the path.")
    meshes = {Path(folder): sorted(p for p in Path(folder).iterdir() if p.suffix.lower() in SUFFIXES)
              for folder in (noisy, clean)}  # fmt: skip
    matches = {path: re.fullmatch(pattern, path.stem) for path in meshes[Path(noisy)]}
    targets = {path.stem: path for path in meshes[Path(clean)] if Path(noisy) != Path(clean) or not matches[path]}
    pairs = [(path, targets[match[1]]) for path, match in matches.items() if match and match[1] in targets]
    paired = {path for pair in pairs for path in pair}
    alone = [str(path) for path in sorted({*matches, *targets.values()} - paired)]
    if alone or not pairs:
        raise DataError(
            f"Expected a partner for every mesh of '{noisy}' and '{clean}' by the pattern '{pattern}' (got none for: "
            f"{', '.join(alone) or 'anything, the folders are empty'}). Rename or move them, or change `pattern`."
        )
    return pairs


class PairsDataModule(PatchDataModule):
    """Patches of noisy and clean meshes from two folders; a share of the clean meshes is held back.

    Args:
        noisy: Folder of noisy meshes.
        clean: Folder of clean meshes.
        pattern: Regular expression of noisy names; its first group is the clean name.
        broken: ``stop`` before training if a pair cannot be read or differs in its faces, or ``skip`` it; all of them
            are named.
        num_patches: Patches per noisy mesh.
        patch_size: Faces per patch.
        k: Nearest faces kept for each face.
        growth: How patches grow; by Dijkstra's algorithm if not given, else :class:`~dnf_pyg.mesh.HeatGrowth`.
        batch_size: Patches per batch.
        val_share: Share of the clean meshes held back for validation and testing, with all their noisy versions.
        cache: Folder for the prepared patches; ``noisy`` if not given.
        num_workers: Processes that load training patches.
        rotate: Turn every training patch by a random rotation.
        jitter: Jitter of the training normals.
        seed: Seed of the choice of patches and of their order.
    """

    def __init__(
        self,
        noisy: str,
        clean: str,
        pattern: str = r"(.+)_(?:n\d+|noisy)",
        broken: OnBroken = "stop",
        num_patches: int = 100,
        patch_size: int = 800,
        k: int = 50,
        growth: Growth | None = None,
        batch_size: int = 10,
        val_share: float = 0.1,
        cache: str | None = None,
        num_workers: int = 0,
        rotate: bool = True,
        jitter: float = 0.005,
        seed: int = 0,
    ) -> None:
        super().__init__(batch_size, num_workers, rotate, jitter, growth, broken)
        self.remember(locals(), "growth")

    def dataset(self, split: str) -> Dataset:
        """Patches of ``train``, or of the held-back meshes."""
        options = self.options
        pairs = self.sound(find_pairs(options.noisy, options.clean, options.pattern))
        return self.patches(self.share(pairs, split), split)
