"""Networks that filter a mesh one after another."""

from collections.abc import Sequence
from typing import cast

from torch.nn import Module, ModuleList

from dnf_pyg.nn.network import FilteringNetwork
from dnf_pyg.nn.pretrained import Pretrained

__all__ = ["Cascade"]


class Cascade(Module, Pretrained):
    """Filter the normals of a mesh by several networks, and update the vertices after each of them.

    The first network sees the noisy mesh. Each later one sees the mesh that the network before it made, the normals
    that this network found, and those of the noisy mesh (:class:`~dnf_pyg.nn.SurfaceDNFNet` with ``num_earlier=2``).
    :func:`dnf_pyg.denoise` runs it, since the vertex update in between needs the whole mesh. The paper's network is a
    cascade of one.

    Args:
        networks: The networks, first to last.

    Raises:
        ValueError: If there is no network.

    Example:
        >>> from dnf_pyg.nn import SurfaceDNFNet
        >>> cascade = Cascade([SurfaceDNFNet(), SurfaceDNFNet(num_earlier=2)])
        >>> len(cascade.networks), cascade.networks[1].inputs[-1]
        (2, 'earlier')
    """

    def __init__(self, networks: Sequence[FilteringNetwork]) -> None:
        super().__init__()
        if not networks:
            raise ValueError(f"Expected at least one network (got {networks}). Pass the networks, first to last.")
        self.stages = ModuleList(networks)

    @property
    def networks(self) -> list[FilteringNetwork]:
        """The networks, first to last."""
        return [cast("FilteringNetwork", net) for net in self.stages]

    @classmethod
    def of_networks(cls, networks: Sequence[FilteringNetwork]) -> "Cascade":
        """Make a cascade of the networks of a folder."""
        return cls(networks).eval()

    @property
    def noise_range(self) -> tuple[float, float] | None:
        """Smallest and largest noise level that the first network was trained on, in mean edge lengths, if known."""
        return self.networks[0].noise_range
