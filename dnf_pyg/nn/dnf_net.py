"""Deep normal filtering network."""

from collections.abc import Sequence

from torch import Tensor
from torch.nn import ModuleList
from torch_geometric.typing import Adj

from dnf_pyg.nn.embedding import MultiScaleEmbedding
from dnf_pyg.nn.head import NormalHead
from dnf_pyg.nn.network import FilteringNetwork, Stage
from dnf_pyg.nn.residual import ResidualUnit

__all__ = ["DNFNet"]


class DNFNet(FilteringNetwork):
    r"""Filter the facet normals of patches of a noisy mesh.

    .. math::
        \mathbf{F}_0 = \mathrm{embed}(\mathbf{n}), \quad
        \mathbf{F}_u = \mathbf{F}_{u-1} - \Delta_u(\mathbf{F}_{u-1}), \quad
        \mathbf{n}_u = \frac{h_u(\mathbf{F}_u)}{\Vert h_u(\mathbf{F}_u) \Vert}

    with residual learning units :math:`\Delta_u` and heads :math:`h_u`, every :math:`\mathbf{n}_u` supervised in
    training.
    Source: Li et al. 2020, Sec. 3.3 and Fig. 3.
    Differs: the authors' code adds the features of the unit before to the input of the last head; the paper does not.

    Args:
        k: Neighbours per face on each level of the embedding.
        num_units: Number of residual learning units.
        residual_k: Neighbours per face in feature space.
        channels: Features per face after each level of the embedding.
        embedding_channels: Features per face after the embedding.
        subtract: Group differences of features in the embedding (the paper's Table 1 has it without).

    Shapes:
        - **x:** :math:`(F, 3)`, facet normals, unit length
        - **edge_index:** :math:`(2, E)`, neighbour (row 0) to centre (row 1); or a list with the edges of each level
        - **edge_attr:** :math:`(E)`, rank of the neighbour among the nearest faces of its centre, 0 for the face itself
        - **batch:** :math:`(F)`, patch of each face, sorted; one patch if ``None``
        - **output:** :math:`(F, 3)`, unit length

    Raises:
        ValueError: If ``num_units`` is not positive.

    Example:
        >>> import torch
        >>> net = DNFNet(k=(1, 2, 2)).eval()
        >>> edge_index, rank = torch.tensor([[0, 1, 1, 0, 2, 1], [0, 0, 1, 1, 2, 2]]), torch.tensor([0, 1, 0, 1, 0, 1])
        >>> net(torch.eye(3), edge_index, rank).shape
        torch.Size([3, 3])
    """

    def __init__(
        self,
        k: Sequence[int] = (10, 30, 50),
        num_units: int = 2,
        residual_k: int = 20,
        channels: Sequence[int] = (64, 128, 256),
        embedding_channels: int = 128,
        subtract: bool = True,
    ) -> None:
        super().__init__()
        if num_units < 1:
            raise ValueError(f"Expected 'num_units' to be positive (got {num_units}). Use at least one unit.")
        self.k = tuple(k)
        self.num_units = num_units
        self.residual_k = residual_k
        self.channels = tuple(channels)
        self.embedding_channels = embedding_channels
        self.subtract = subtract
        self.embedding = MultiScaleEmbedding(k, channels, embedding_channels, subtract)
        self.units = ModuleList(ResidualUnit(embedding_channels, residual_k) for _ in range(num_units))
        self.heads = ModuleList(NormalHead(embedding_channels) for _ in range(num_units))

    def reset_parameters(self) -> None:
        """Draw new weights."""
        for module in (self.embedding, *self.units, *self.heads):
            module.reset_parameters()

    def stages(
        self,
        x: Tensor,
        edge_index: Tensor | Sequence[Adj],
        edge_attr: Tensor | None = None,
        batch: Tensor | None = None,
    ) -> list[Stage]:
        """Compute the filtered normals (F, 3) and the residual (F, C) of every unit."""
        features = self.embedding(x, edge_index, edge_attr, batch)
        stages = []
        for unit, head in zip(self.units, self.heads, strict=True):
            residual = unit(features, batch)
            features = features - residual
            stages.append((head(features), residual))
        return stages
