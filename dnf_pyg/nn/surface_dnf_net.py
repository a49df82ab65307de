"""Deep normal filtering network that sees the surface."""

from collections.abc import Sequence

import torch
from torch import Tensor
from torch.nn import ModuleList
from torch_geometric.typing import Adj

from dnf_pyg.nn.bilateral import JointBilateralConv
from dnf_pyg.nn.frame import in_frame, out_of_frame, patch_frames
from dnf_pyg.nn.head import NormalHead
from dnf_pyg.nn.neighbors import edges_per_level
from dnf_pyg.nn.network import FilteringNetwork, Stage
from dnf_pyg.nn.residual import ResidualUnit
from dnf_pyg.nn.surface import patch_surface
from dnf_pyg.nn.surface_embedding import SurfaceEmbedding

__all__ = ["SurfaceDNFNet"]


class SurfaceDNFNet(FilteringNetwork):
    """Filter the facet normals of patches whose shape the network sees as well; the released weights have this form.

    Residual learning units and heads are those of :class:`~dnf_pyg.nn.DNFNet`. Differs from the paper in three ways:

    - Each patch is turned into a frame of its own (:func:`~dnf_pyg.nn.frame.patch_frames`), so the result turns with
      the mesh.
    - The embedding sees places and areas of the faces (:class:`~dnf_pyg.nn.surface_embedding.SurfaceEmbedding`).
    - A learned bilateral filter (:class:`~dnf_pyg.nn.JointBilateralConv`) over the ``k[0]`` nearest faces refines the
      normals of the last unit. It is a stage of its own, with a residual of no channels.

    As a later network of a :class:`~dnf_pyg.nn.Cascade`, it sees the mesh that the networks before it made, and
    ``num_earlier`` further normals of each face: those that the last one found, and those of the noisy mesh. Its heads
    may choose among all of them.

    Args:
        k: Neighbours per face on each level of the embedding.
        num_units: Number of residual learning units.
        residual_k: Neighbours per face in feature space.
        channels: Features per face after each level of the embedding.
        embedding_channels: Features per face after the embedding.
        bilateral_iterations: Number of iterations of the bilateral filter.
        num_earlier: Number of further normals N of each face.

    Shapes:
        - **x:** :math:`(F, 3)`, facet normals, unit length
        - **pos:** :math:`(F, 3)`, face centroids, any unit
        - **area:** :math:`(F)`, face areas, the square of that unit
        - **earlier:** :math:`(F, N, 3)`, further normals, unit length; ``None`` without them
        - **edge_index**, **edge_attr**, **batch**, **output:** as for :class:`~dnf_pyg.nn.DNFNet`

    Raises:
        ValueError: If ``num_units`` or ``bilateral_iterations`` is not positive.

    Example:
        >>> net = SurfaceDNFNet(k=(1, 2, 2)).eval()
        >>> edge_index, rank = torch.tensor([[0, 1, 1, 0, 2, 1], [0, 0, 1, 1, 2, 2]]), torch.tensor([0, 1, 0, 1, 0, 1])
        >>> net(torch.eye(3), torch.randn(3, 3), torch.ones(3), edge_index, rank).shape
        torch.Size([3, 3])
    """

    def __init__(
        self,
        k: Sequence[int] = (10, 24, 40),
        num_units: int = 2,
        residual_k: int = 12,
        channels: Sequence[int] = (64, 128, 128),
        embedding_channels: int = 128,
        bilateral_iterations: int = 12,
        num_earlier: int = 0,
    ) -> None:
        super().__init__()
        for name, value in (("num_units", num_units), ("bilateral_iterations", bilateral_iterations)):
            if value < 1:
                raise ValueError(f"Expected '{name}' to be positive (got {value}). Use at least 1.")
        self.k = tuple(k)
        self.num_units = num_units
        self.residual_k = residual_k
        self.channels = tuple(channels)
        self.embedding_channels = embedding_channels
        self.bilateral_iterations = bilateral_iterations
        self.num_earlier = num_earlier
        self.embedding = SurfaceEmbedding(k, channels, embedding_channels, in_channels=4 + 3 * num_earlier)
        self.units = ModuleList(ResidualUnit(embedding_channels, residual_k) for _ in range(num_units))
        num_candidates = 1 + num_earlier if num_earlier else 0
        self.heads = ModuleList(NormalHead(embedding_channels, num_candidates) for _ in range(num_units))
        self.bilateral = JointBilateralConv(embedding_channels, num_iterations=bilateral_iterations)

    @property
    def inputs(self) -> tuple[str, ...]:
        """Attributes of a batch of patches that the network takes, by name."""
        given = ("x", "pos", "area", "edge_index", "edge_attr", "batch")
        return (*given, "earlier") if self.num_earlier else given

    @property
    def smoothing(self) -> float:
        """How much its normals need to be smoothed: less than those of a network that sees normals alone.

        As a later network of a cascade, it errs less again.
        """
        return 0.05 if self.num_earlier else 0.2

    @property
    def wide_smoothing(self) -> float:
        """All of the smoothing for a later network of a cascade, which leaves few errors from face to face."""
        return 1.0 if self.num_earlier else 0.4

    def reset_parameters(self) -> None:
        """Draw new weights."""
        for module in (self.embedding, *self.units, *self.heads, self.bilateral):
            module.reset_parameters()

    def stages(
        self,
        x: Tensor,
        pos: Tensor,
        area: Tensor,
        edge_index: Tensor | Sequence[Adj],
        edge_attr: Tensor | None = None,
        batch: Tensor | None = None,
        earlier: Tensor | None = None,
    ) -> list[Stage]:
        """Compute the filtered normals (F, 3) and the residual (F, C) of every unit and of the bilateral filter."""
        frame = patch_frames(x, batch)
        frame = frame if batch is None else frame[batch]  # (F, 3, 3)
        place, area = patch_surface(pos, area, batch)
        edges = edges_per_level(edge_index, edge_attr, self.k)
        normals = [in_frame(normal, frame) for normal in (x, *(() if earlier is None else earlier.unbind(dim=1)))]
        candidates = None if earlier is None else torch.stack(normals, dim=1)
        seen = torch.cat([normals[0], area.log(), *normals[1:], in_frame(place, frame)], dim=1)
        features = self.embedding(seen, edges, batch=batch)
        stages: list[Stage] = []
        for unit, head in zip(self.units, self.heads, strict=True):
            residual = unit(features, batch)
            features = features - residual
            stages.append((out_of_frame(head(features, candidates), frame), residual))
        refined = self.bilateral(stages[-1][0], features, edges[0], area)
        return [*stages, (refined, features[:, :0])]
