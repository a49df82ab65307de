"""Options that say how the data modules serve patches."""

from dataclasses import dataclass

__all__ = ["LoaderOptions"]


@dataclass(frozen=True)
class LoaderOptions:
    """How patches are batched, loaded and augmented.

    Source: Li et al. 2020, Sec. 3.2, for the augmentation.

    Args:
        batch_size: Patches per batch of each process.
        num_workers: Processes that load the training patches; 0 loads them in the training process.
        rotate: Whether each training patch is turned by a random rotation.
        jitter: Standard deviation of the jitter of the training normals, clipped at twice this value; 0 for none.

    Raises:
        ValueError: If ``batch_size`` is not positive.
    """

    batch_size: int = 10
    num_workers: int = 0
    rotate: bool = True
    jitter: float = 0.005

    def __post_init__(self) -> None:
        if self.batch_size < 1:
            raise ValueError(f"Expected 'batch_size' of at least 1 (got {self.batch_size}). Raise it.")
