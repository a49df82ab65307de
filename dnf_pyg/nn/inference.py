"""Networks in use: in evaluation mode on a device, and with fewer neighbours for speed."""

import copy
from collections.abc import Sequence
from typing import TypeVar

import torch
from torch import Tensor
from torch.nn import Module
from torch_geometric.data import Data

from dnf_pyg.nn.thinning import evenly_spaced_ranks, select_ranks

__all__ = ["evaluation_network", "sparser_edges"]

Network = TypeVar("Network", bound=Module)


def evaluation_network(net: Network, device: torch.device) -> Network:
    """Provide a network in evaluation mode on a device without changing the given one.

    Args:
        net: Network in any mode, on any device.
        device: Device to run on.

    Returns:
        The network itself if it is ready, and a copy otherwise.

    Example:
        >>> net = torch.nn.BatchNorm1d(3)
        >>> evaluation_network(net, torch.device("cpu")).training, net.training
        (False, True)
    """
    tensors = [*net.parameters(), *net.buffers()]
    if not any(module.training for module in net.modules()) and all(tensor.device == device for tensor in tensors):
        return net
    return copy.deepcopy(net).eval().to(device)


def sparser_edges(data: Data, k: Sequence[int], wanted: Sequence[int] | None) -> list[Tensor] | None:
    """Select the edges of each level of a network that is to see fewer neighbours than it was trained with.

    Args:
        data: Patch or batch of patches.
        k: Neighbours per face on each level of the network.
        wanted: Neighbours per face to keep on each level, spread evenly over these; all if not given.

    Returns:
        Edges (2, E) of each level; None if all are kept.

    Example:
        >>> data = Data(edge_index=torch.tensor([[0, 1, 2], [0, 0, 0]]), edge_attr=torch.tensor([0, 1, 2]))
        >>> sparser_edges(data, k=(2, 3), wanted=(2, 2))
        [tensor([[0, 1],
                [0, 0]]), tensor([[0, 2],
                [0, 0]])]
    """
    if wanted is None:
        return None
    ranks = (evenly_spaced_ranks(most, min(most, few)) for most, few in zip(k, wanted, strict=True))
    return [select_ranks(data.edge_index, data.edge_attr, level) for level in ranks]
