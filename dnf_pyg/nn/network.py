"""What all networks that filter facet normals have in common."""

import inspect
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

from torch import Tensor
from torch.nn import Module
from torch_geometric.data import Data
from torch_geometric.typing import Adj

from dnf_pyg.nn.config import NETWORKS
from dnf_pyg.nn.pretrained import Pretrained

__all__ = ["FilteringNetwork", "Stage"]

Stage = tuple[Tensor, Tensor]
"""Filtered normals (F, 3), unit length, and residual features (F, C) of one residual learning unit."""


class FilteringNetwork(Module, Pretrained, ABC):
    """Base of the networks: filter the facet normals of a batch of patches.

    Subclasses list the attributes of a patch that they take in :attr:`inputs` and implement :meth:`stages` with keyword
    arguments of these names. Every constructor argument is kept as an attribute of the same name.
    """

    k: tuple[int, ...]
    """Neighbours per face on each level; a patch needs the ranks below ``max(k)``."""

    noise_range: tuple[float, float] | None = None
    """Smallest and largest noise level of the training data, in mean edge lengths, if known."""

    random_rotation: bool = False
    """Whether the patches of the training were rotated at random. Those of a mesh to be filtered then are, too, so that
    overlapping patches have different errors, which average out."""

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        NETWORKS[cls.__name__] = cls

    @property
    def inputs(self) -> tuple[str, ...]:
        """Attributes of a batch of patches that the network takes, by name."""
        return ("x", "edge_index", "edge_attr", "batch")

    @property
    def smoothing(self) -> float:
        """How much its normals need to be smoothed: a share of the angle by which white noise turns normals.

        Normals that differ from their mean over the faces around by less are taken for errors of the network
        (``dnf_pyg.mesh.normal_smoothing``).
        """
        return 0.5

    @property
    def wide_smoothing(self) -> float:
        """Share of :attr:`smoothing` that suits errors that are alike over many faces, which are smaller."""
        return 0.4

    @property
    def networks(self) -> list["FilteringNetwork"]:
        """The network itself, as a :class:`~dnf_pyg.nn.Cascade` of one."""
        return [self]

    @property
    def arguments(self) -> dict[str, Any]:
        """Constructor arguments as plain numbers and lists, read from the attributes of the same names."""
        values = {name: getattr(self, name) for name in inspect.signature(type(self)).parameters}
        return {name: list(value) if isinstance(value, tuple) else value for name, value in values.items()}

    @abstractmethod
    def stages(self, *inputs: Any, **named: Any) -> list[Stage]:
        """Compute the filtered normals and the residual of every supervised stage."""

    def forward(self, *inputs: Any, **named: Any) -> Tensor:
        """Filter the normals: the result (F, 3) of the last stage, unit length."""
        return self.stages(*inputs, **named)[-1][0]

    def gather(self, data: Data, edge_index: Adj | Sequence[Adj] | None = None) -> dict[str, Any]:
        """Collect the network's inputs from a batch of patches, in the floating point type of its weights.

        Args:
            data: Patch or batch of patches.
            edge_index: Edges to take in place of those of ``data``, such as a list with the edges of each level.

        Raises:
            ValueError: If ``data`` lacks an attribute that the network needs.
        """
        found = {name: data.get(name) for name in self.inputs}
        missing = [name for name, value in found.items() if value is None and name != "batch"]
        if missing:
            raise ValueError(
                f"Expected patches with {', '.join(self.inputs)} (got none of {', '.join(missing)}). Make them with "
                "`dnf_pyg.patches.patch_to_data`."
            )
        dtype = next(self.parameters()).dtype
        for name, value in found.items():
            if value is not None and value.is_floating_point():
                found[name] = value.to(dtype)
        return found if edge_index is None else {**found, "edge_index": edge_index}
