"""Training of a normal filtering network: steps, logging, optimizer; no maths of its own."""

from collections.abc import Sequence
from typing import Any, Literal

import torch
from lightning.pytorch import LightningModule
from lightning.pytorch.cli import LRSchedulerCallable, OptimizerCallable
from torch import Tensor
from torch_geometric.data import Batch

from dnf_pyg.errors import WeightsError
from dnf_pyg.losses import JointLoss
from dnf_pyg.metrics import MeanAngularDifference
from dnf_pyg.nn import DNFNet, subsample_neighbors

__all__ = ["NormalFilteringModule"]


class NormalFilteringModule(LightningModule):
    """Train a network to filter the facet normals of patches.

    Every checkpoint carries the constructor arguments of the network (key ``network``), so that
    :func:`dnf_pyg.pretrained.load_network` rebuilds it from the file alone.

    Source: Li et al. 2020, Sec. 3.4 and 3.5.

    Args:
        net: The network.
        loss: The training loss; the paper's by default.
        optimizer: Makes the optimizer from the parameters; Adam with a rate of 1e-3 by default.
        scheduler: Makes a learning rate schedule from the optimizer.
        scheduler_interval: Step the schedule once an ``epoch`` or once a ``step``.
        train_k: Neighbours kept at random on each level while training (:func:`~dnf_pyg.nn.subsample_neighbors`);
            all of ``net.k`` if not given. Differs: the paper trains on all.
    """

    def __init__(
        self,
        net: DNFNet,
        loss: JointLoss | None = None,
        optimizer: OptimizerCallable = torch.optim.Adam,
        scheduler: LRSchedulerCallable | None = None,
        scheduler_interval: Literal["epoch", "step"] = "epoch",
        train_k: Sequence[int] | None = None,
    ) -> None:
        super().__init__()
        self.net = net
        self.loss = JointLoss() if loss is None else loss
        self.optimizer = optimizer
        self.scheduler = scheduler
        self.scheduler_interval = scheduler_interval
        self.train_k = train_k
        self.train_theta, self.val_theta, self.test_theta = (MeanAngularDifference() for _ in range(3))

    def forward(self, batch: Batch) -> Tensor:
        """Filtered normals (F, 3) of a batch of patches."""
        return self.net(batch.normal, batch.edge_index, batch.batch)

    def training_step(self, batch: Batch, batch_idx: int) -> Tensor:
        """Joint loss of one batch."""
        return self._step(batch, "train", self.train_theta)

    def validation_step(self, batch: Batch, batch_idx: int) -> None:
        """Log ``val/theta`` and ``val/loss``."""
        self._step(batch, "val", self.val_theta)

    def test_step(self, batch: Batch, batch_idx: int) -> None:
        """Log ``test/theta`` and ``test/loss``."""
        self._step(batch, "test", self.test_theta)

    def predict_step(self, batch: Batch, batch_idx: int) -> Tensor:
        """Filtered normals (F, 3) of a batch of patches."""
        return self(batch)

    def configure_optimizers(self) -> Any:
        """Optimizer and, if one is configured, its schedule."""
        optimizer = self.optimizer(self.net.parameters())
        if self.scheduler is None:
            return optimizer
        schedule = {"scheduler": self.scheduler(optimizer), "interval": self.scheduler_interval}
        return {"optimizer": optimizer, "lr_scheduler": schedule}

    def on_save_checkpoint(self, checkpoint: dict[str, Any]) -> None:
        """Store what rebuilds the network."""
        checkpoint["network"] = self.net.config

    def on_load_checkpoint(self, checkpoint: dict[str, Any]) -> None:
        """Refuse the checkpoint of another architecture.

        Raises:
            WeightsError: If the checkpoint's network was built with other arguments.
        """
        stored, own = checkpoint.get("network", {}), self.net.config
        differing = {key: (stored.get(key), own[key]) for key in own if stored.get(key) != own[key]}
        if differing:
            listed = ", ".join(f"{key}: {theirs} in the file, {ours} here" for key, (theirs, ours) in differing.items())
            raise WeightsError(f"Expected a checkpoint of the configured network (got {listed}): change `model.net`")

    def _step(self, batch: Batch, stage: str, theta: MeanAngularDifference) -> Tensor:
        stages = self.net.stages(batch.normal, self._edges(batch.edge_index), batch.batch)
        terms = self.loss(stages, batch.clean_normal, batch.batch)
        theta.update(stages[-1][0].detach(), batch.clean_normal)
        values = {
            f"{stage}/loss": terms.total,
            f"{stage}/recovery": terms.recovery,
            f"{stage}/residual": terms.residual,
        }
        training = stage == "train"  # a curve over steps; elsewhere one value an epoch
        self.log_dict(
            values, batch_size=batch.num_graphs, on_step=training, on_epoch=not training, sync_dist=not training
        )
        self.log(f"{stage}/theta", theta, batch_size=batch.num_graphs, on_step=False, on_epoch=True, prog_bar=True)
        return terms.total

    def _edges(self, edge_index: Tensor) -> Tensor | list[Tensor]:
        if not self.training or self.train_k is None:
            return edge_index
        return [subsample_neighbors(edge_index, k, keep) for k, keep in zip(self.net.k, self.train_k, strict=True)]
