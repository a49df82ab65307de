"""Options that say how patches are cut from a mesh."""

from dataclasses import dataclass

from dnf_pyg.mesh import Growth

__all__ = ["PatchOptions"]


@dataclass(frozen=True)
class PatchOptions:
    """How many patches are cut from each mesh, and how large they are.

    Source: Li et al. 2020, Sec. 3.5: the defaults are those of the paper for synthetic noise.

    Args:
        num_patches: Patches per mesh P; of each noisy version, where a mesh has several.
        patch_size: Faces per patch N.
        k: Nearest faces kept for each face, the face itself included.
        growth: How a patch grows from its seed; :class:`~dnf_pyg.mesh.DijkstraGrowth` if not given.
        seed: Seed of everything that is random about the patches: the choice of seed faces, their order and their
            noise.

    Raises:
        ValueError: If ``num_patches`` is not positive.

    Example:
        >>> PatchOptions(k=150)
        PatchOptions(num_patches=100, patch_size=800, k=150, growth=None, seed=0)
    """

    num_patches: int = 100
    patch_size: int = 800
    k: int = 50
    growth: Growth | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        if self.num_patches < 1:
            raise ValueError(f"Expected 'num_patches' of at least 1 (got {self.num_patches}). Raise it.")
