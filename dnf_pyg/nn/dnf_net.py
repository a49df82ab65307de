"""Deep normal filtering network."""

from collections.abc import Iterator, Sequence
from typing import Any

import torch
from huggingface_hub import PyTorchModelHubMixin
from torch import Tensor
from torch.nn import Module, ModuleList
from torch.nn import functional as F
from torch_geometric.nn import MLP
from torch_geometric.typing import Adj

from dnf_pyg.nn.bilateral import JointBilateralConv
from dnf_pyg.nn.embedding import MultiScaleEmbedding
from dnf_pyg.nn.frame import in_frame, patch_frames
from dnf_pyg.nn.residual import ResidualUnit
from dnf_pyg.nn.surface import patch_surface

__all__ = ["DNFNet"]


class DNFNet(Module, PyTorchModelHubMixin, library_name="dnf_pyg", tags=["mesh-denoising"]):
    r"""Filter the facet normals of patches of a noisy mesh.

    .. math::
        \mathbf{F}_0 = \mathrm{embed}(\mathbf{n}), \quad
        \mathbf{F}_u = \mathbf{F}_{u-1} - \Delta_u(\mathbf{F}_{u-1}), \quad
        \mathbf{n}_u = \frac{h_u(\mathbf{F}_u)}{\Vert h_u(\mathbf{F}_u) \Vert}

    with residual units :math:`\Delta_u` and heads :math:`h_u`, every :math:`\mathbf{n}_u` supervised in training.
    ``save_pretrained(folder)`` writes the weights and the configuration, ``from_pretrained(folder)`` reads them.
    Source: Li et al. 2020, Sec. 3.3 and Fig. 3.

    Args:
        k: Neighbours per face on each level of the embedding; ``max(k)`` must be known per face.
        num_units: Residual units, at least one.
        residual_k: Neighbours per face in feature space.
        channels: Features per face after each level of the embedding.
        embedding_channels: Features per face from there on.
        subtract: Group differences of features in the embedding.
        align: Turn each patch into a frame of its own before and back after (:func:`~dnf_pyg.nn.frame.patch_frames`),
            so that the result turns with the mesh. Differs: the paper does without and learns from turned patches.
        bilateral_iterations: Iterations of a learned bilateral filter over the ``k[0]`` nearest faces at the end
            (:class:`~dnf_pyg.nn.JointBilateralConv`); none if 0. Differs: the paper does without.
        surface: See places and areas of the faces beside their normals. Differs: the paper does without.

    Shapes:
        - **normal:** :math:`(F, 3)`, unit length
        - **edge_index:** :math:`(2, E)`, neighbour (row 0) to centre (row 1), within a centre nearest first, the face
          itself before all; or a list with one ``edge_index`` per level, for other neighbours on some levels. A face
          with fewer than ``k`` edges uses what it has.
        - **batch:** :math:`(F)`, patch of each face, sorted; one patch if ``None``
        - **surface:** :math:`(F, 4)`, centroid and area of each face, any unit; for a network with ``surface`` only
        - **output:** :math:`(F, 3)`, unit length

    Raises:
        ValueError: If ``num_units`` is not positive, or ``surface`` is missing where the network needs it.

    Example:
        >>> net = DNFNet(k=(1, 2, 2)).eval()
        >>> net(torch.eye(3), torch.tensor([[0, 1, 1, 0, 2, 1], [0, 0, 1, 1, 2, 2]])).shape
        torch.Size([3, 3])
    """

    noise_range: tuple[float, float] | None = None
    """Noise levels that the weights were trained on, in mean edge lengths, where that is known."""

    def __init__(
        self,
        k: Sequence[int] = (10, 30, 50),
        num_units: int = 2,
        residual_k: int = 20,
        channels: Sequence[int] = (64, 128, 256),
        embedding_channels: int = 128,
        subtract: bool = True,
        align: bool = False,
        bilateral_iterations: int = 0,
        surface: bool = False,
    ) -> None:
        super().__init__()
        if num_units < 1:
            raise ValueError(f"Expected 'num_units' to be positive (got {num_units})")
        self.k = tuple(k)
        self.num_units = num_units
        self.residual_k = residual_k
        self.channels = tuple(channels)
        self.embedding_channels = embedding_channels
        self.subtract = subtract
        self.align = align
        self.bilateral_iterations = bilateral_iterations
        self.surface = surface
        self.embedding = MultiScaleEmbedding(k, channels, embedding_channels, subtract, surface)
        self.units = ModuleList(ResidualUnit(embedding_channels, residual_k) for _ in range(num_units))
        head = [embedding_channels, embedding_channels, embedding_channels // 2, 3]
        self.heads = ModuleList(MLP(head, norm_kwargs={"allow_single_element": True}) for _ in range(num_units))
        self.bilateral = (
            JointBilateralConv(embedding_channels, num_iterations=bilateral_iterations, k=self.k[0])
            if bilateral_iterations
            else None
        )

    @property
    def config(self) -> dict[str, Any]:
        """Constructor arguments as plain numbers and lists; ``DNFNet(**net.config)`` has the same layers."""
        return {
            "k": list(self.k),
            "num_units": self.num_units,
            "residual_k": self.residual_k,
            "channels": list(self.channels),
            "embedding_channels": self.embedding_channels,
            "subtract": self.subtract,
            "align": self.align,
            "bilateral_iterations": self.bilateral_iterations,
            "surface": self.surface,
        }

    def reset_parameters(self) -> None:
        """Draw new weights."""
        for module in (self.embedding, *self.units, *self.heads):
            module.reset_parameters()
        if self.bilateral is not None:
            self.bilateral.reset_parameters()

    def forward(
        self,
        normal: Tensor,
        edge_index: Adj | Sequence[Adj],
        batch: Tensor | None = None,
        surface: Tensor | None = None,
    ) -> Tensor:
        """Filter the normals: the output of the last unit, without the heads of the others."""
        frame = self._frame(normal, batch)
        place, area = self._surface(surface, batch, frame)
        *_, (x, _) = self._features(normal, edge_index, batch, frame, place)
        out = self._filtered(self.heads[-1], x, frame)
        return out if self.bilateral is None else self.bilateral(out, x, self._nearest(edge_index), area)

    def stages(
        self,
        normal: Tensor,
        edge_index: Adj | Sequence[Adj],
        batch: Tensor | None = None,
        surface: Tensor | None = None,
    ) -> list[tuple[Tensor, Tensor]]:
        """Return what each residual unit gives: filtered normals (F, 3) and its residual (F, C).

        The bilateral filter, where there is one, is a stage more, with a residual of no channels.
        """
        frame = self._frame(normal, batch)
        place, area = self._surface(surface, batch, frame)
        features = list(self._features(normal, edge_index, batch, frame, place))
        stages = [
            (self._filtered(head, x, frame), residual) for head, (x, residual) in zip(self.heads, features, strict=True)
        ]
        if self.bilateral is not None:
            (out, _), (x, _) = stages[-1], features[-1]
            out = self.bilateral(out, x, self._nearest(edge_index), area)
            stages.append((out, x.new_zeros(x.size(0), 0)))
        return stages

    def _surface(
        self, surface: Tensor | None, batch: Tensor | None, frame: Tensor | None
    ) -> tuple[Tensor | None, Tensor | None]:
        """Places (F, 4) and areas (F, 1) in units of the patch, for a network that looks at them."""
        if not self.surface:
            return None, None
        if surface is None:
            raise ValueError(
                "Expected 'surface' of shape [num_faces, 4] for a network that sees places and areas (got None): pass "
                "`data.surface` of the patches"
            )
        return patch_surface(surface, batch, frame)

    @staticmethod
    def _nearest(edge_index: Adj | Sequence[Adj]) -> Adj:
        """Edges of the first level."""
        return edge_index[0] if isinstance(edge_index, list | tuple) else edge_index

    def _frame(self, normal: Tensor, batch: Tensor | None) -> Tensor | None:
        """Axes of the patch of each face, shape (F, 3, 3) or (1, 3, 3)."""
        if not self.align:
            return None
        frame = patch_frames(normal, batch)
        return frame if batch is None else frame[batch]

    def _features(
        self,
        normal: Tensor,
        edge_index: Adj | Sequence[Adj],
        batch: Tensor | None,
        frame: Tensor | None,
        place: Tensor | None,
    ) -> Iterator[tuple[Tensor, Tensor]]:
        """Cleaned feature map and residual after each unit."""
        if frame is not None:
            normal = in_frame(normal, frame)
        x = self.embedding(normal, edge_index, batch, surface=place)
        for unit in self.units:
            residual = unit(x, batch)
            x = x - residual
            yield x, residual

    @staticmethod
    def _filtered(head: MLP, x: Tensor, frame: Tensor | None) -> Tensor:
        """Unit normals, turned back; in full precision, since bf16 directions are a quarter of a degree apart."""
        with torch.autocast(x.device.type, enabled=False):
            out = F.normalize(head(x.to(head.lins[0].weight.dtype)), dim=-1)
        return out if frame is None else (frame * out.unsqueeze(1)).sum(dim=2)
