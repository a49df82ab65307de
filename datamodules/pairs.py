"""Any folders of noisy and clean meshes with the same faces, paired by name."""

import re
from pathlib import Path
from typing import Literal

import torch
from lightning.pytorch.utilities import rank_zero_warn
from torch.utils.data import Dataset

from datamodules.patches import PatchDataModule, spread
from dnf_pyg.data import PatchDataset
from dnf_pyg.errors import DataError, DNFError
from dnf_pyg.mesh import Growth
from dnf_pyg.mesh.io import SUFFIXES, read_mesh

__all__ = ["PairsDataModule", "find_pairs", "sound_pairs"]

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


def sound_pairs(pairs: list[Pair], broken: Literal["stop", "skip"]) -> list[Pair]:
    """Read all pairs and keep those that can be trained on.

    Args:
        pairs: Noisy and clean files.
        broken: ``stop`` raises an error that lists every broken pair; ``skip`` leaves them out with a warning.

    Raises:
        DataError: If a pair cannot be read or differs in its faces and ``broken`` is ``stop``, or none is left.
    """
    faults = {}
    for pair in pairs:
        try:
            one, two = (read_mesh(path).face for path in pair)
            if not torch.equal(one, two):
                faults[pair] = f"{one.size(1)} and {two.size(1)} faces, or the same in another order"
        except DNFError as error:
            faults[pair] = str(error)
    listed = "\n".join(f"  '{noisy}' and '{clean}': {fault}" for (noisy, clean), fault in faults.items())
    sound = [pair for pair in pairs if pair not in faults]
    if faults and (broken == "stop" or not sound):
        raise DataError(
            f"Expected readable pairs with the same faces in the same order (got {len(faults)} others):\n{listed}\n"
            "Repair or remove them, or leave them out with `broken: skip`."
        )
    if faults:
        rank_zero_warn(f"{len(faults)} pairs are left out:\n{listed}")
    return sound


class PairsDataModule(PatchDataModule):
    """Patches of noisy and clean meshes from two folders; a share of the clean meshes is held back.

    Args:
        noisy: Folder of noisy meshes.
        clean: Folder of clean meshes.
        pattern: Regular expression of noisy names; its first group is the clean name.
        broken: What to do with pairs that cannot be read or differ in their faces: ``stop`` or ``skip``.
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
        broken: Literal["stop", "skip"] = "stop",
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
        super().__init__(batch_size, num_workers, rotate, jitter, growth)
        self.remember(locals(), "growth")
        self._pairs: list[Pair] | None = None

    def dataset(self, split: str) -> Dataset:
        """Patches of ``train``, or of the held-back meshes."""
        options = self.hparams
        if self._pairs is None:
            self._pairs = sound_pairs(find_pairs(options.noisy, options.clean, options.pattern), options.broken)
        held_back = spread(sorted({clean.stem for _, clean in self._pairs}), options.val_share)
        return PatchDataset(
            [pair for pair in self._pairs if (pair[1].stem in held_back) == (split != "train")],
            options.cache or options.noisy,
            num_patches=options.num_patches,
            patch_size=options.patch_size,
            k=options.k,
            growth=self.growth,
            seed=options.seed,
            transform=self.augmentation if split == "train" else None,
        )
