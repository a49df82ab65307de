"""Separate running statistics of batch normalization for several data sets."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import torch
from torch import Tensor
from torch.nn.modules.batchnorm import _BatchNorm

__all__ = ["SplitStatistics"]


class SplitStatistics(torch.nn.Module):
    """Keep the running mean and variance of a network's normalization layers separately for each data set.

    All data sets share the weights. Each batch updates, and is evaluated with, the statistics of its own data set.
    Source: Chang et al. 2019, "Domain-specific batch normalization" (here the statistics only, not scale and shift).

    Args:
        net: Network with the layers; it holds the statistics of the data set that was used last.
        names: Names of the data sets.

    Example:
        >>> norm = torch.nn.BatchNorm1d(1)
        >>> split = SplitStatistics(norm, ["a", "b"])
        >>> with split.use("a"):
        ...     _ = norm(torch.full((4, 1), 10.0))
        >>> with split.use("b"):
        ...     norm.running_mean
        tensor([0.])
    """

    def __init__(self, net: torch.nn.Module, names: Sequence[str]) -> None:
        super().__init__()
        self.names = list(names)
        norms = {name: module for name, module in net.named_modules() if isinstance(module, _BatchNorm)}
        self._norms = list(norms.values())
        self.tensors = [f"{name}.{key}" for name, norm in norms.items() for key, _ in norm.named_buffers(recurse=False)]
        for row, (norm, key) in enumerate(self._places()):
            own = getattr(norm, key)
            self.register_buffer(f"values_{row}", own.detach().clone().expand(len(self.names), *own.shape).clone())

    @contextmanager
    def use(self, name: str) -> Iterator[None]:
        """Use the statistics of a data set in the network, and keep their updates.

        Raises:
            ValueError: If the data set is not known.
        """
        if name not in self.names:
            raise ValueError(
                f"Expected 'name' to be one of {self.names} (got {name!r}). Add it to `separate_statistics`."
            )
        place = self.names.index(name)
        own = [getattr(norm, key) for norm, key in self._places()]
        for row, (norm, key) in enumerate(self._places()):  # new tensors, since a graph may still hold the old ones
            setattr(norm, key, self._kept(row)[place].clone())
        try:
            yield
        finally:
            for row, ((norm, key), buffer) in enumerate(zip(self._places(), own, strict=True)):
                self._kept(row)[place] = getattr(norm, key)
                # the network keeps its own buffers, with the new values
                setattr(norm, key, buffer.copy_(getattr(norm, key)))

    def _places(self) -> list[tuple[_BatchNorm, str]]:
        return [(norm, key) for norm in self._norms for key, _ in norm.named_buffers(recurse=False)]

    def _kept(self, row: int) -> Tensor:
        return getattr(self, f"values_{row}")
