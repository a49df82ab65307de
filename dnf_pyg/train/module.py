"""Training of a normal filtering network: steps, logging, optimizer; no maths of its own."""

from collections.abc import Sequence
from contextlib import nullcontext
from typing import Any, Literal, cast

import torch
from lightning.pytorch import LightningModule
from lightning.pytorch.cli import LRSchedulerCallable, OptimizerCallable
from lightning.pytorch.utilities import rank_zero_info
from torch import Tensor
from torch_geometric.data import Batch

from dnf_pyg.errors import WeightsError
from dnf_pyg.evaluate.metrics import MeanAngularDifference
from dnf_pyg.nn import DNFNet, subsample_neighbors
from dnf_pyg.train.distillation import Distillation
from dnf_pyg.train.losses import JointLoss, LossTerms
from dnf_pyg.train.processes import leave_at_exit
from dnf_pyg.train.split_statistics import SplitStatistics
from dnf_pyg.weights.load import load_network

__all__ = ["NormalFilteringModule"]


class NormalFilteringModule(LightningModule):
    """Train a network to filter the facet normals of patches.

    Every checkpoint carries the constructor arguments of the network (key ``network``), so that
    :func:`dnf_pyg.weights.load.load_network` rebuilds it from the file alone.

    Source: Li et al. 2020, Sec. 3.4 and 3.5.

    Args:
        net: The network.
        loss: The training loss; the paper's by default.
        optimizer: Makes the optimizer from the parameters; Adam with a rate of 1e-3 by default.
        scheduler: Makes a learning rate schedule from the optimizer.
        scheduler_interval: Step the schedule once an ``epoch`` or once a ``step``.
        train_k: Neighbours kept at random on each level while training (:func:`~dnf_pyg.nn.subsample_neighbors`);
            all of ``net.k`` if not given. Differs: the paper trains on all.
        train_k_steps: Steps after which all neighbours are kept, as in evaluation; never if not given.
        initial_weights: Weights to start from (name, folder or checkpoint, as for
            :func:`~dnf_pyg.weights.load.load_network`); layers that they lack start from new ones, and are named.
        separate_statistics: Names of data sets that keep running statistics of batch normalization of their own
            (:class:`~dnf_pyg.train.split_statistics.SplitStatistics`); for joint training.
        distillation: Trained teachers, one for each data set of a joint training.

    Raises:
        DataError: At the start of a run, if teachers and data sets do not fit each other.
    """

    def __init__(
        self,
        net: DNFNet,
        loss: JointLoss | None = None,
        optimizer: OptimizerCallable = torch.optim.Adam,
        scheduler: LRSchedulerCallable | None = None,
        scheduler_interval: Literal["epoch", "step"] = "epoch",
        train_k: Sequence[int] | None = None,
        train_k_steps: int | None = None,
        initial_weights: str | None = None,
        separate_statistics: Sequence[str] | None = None,
        distillation: Distillation | None = None,
    ) -> None:
        super().__init__()
        leave_at_exit()
        self.net = net
        self.loss = JointLoss() if loss is None else loss
        self.optimizer = optimizer
        self.scheduler = scheduler
        self.scheduler_interval = scheduler_interval
        self.train_k = train_k
        self.train_k_steps = train_k_steps
        if initial_weights is not None:
            self._start_from(initial_weights)
        self.statistics = SplitStatistics(net, separate_statistics) if separate_statistics else None
        self.distillation = distillation
        self.part_theta = torch.nn.ModuleDict()  # one for each stage and data set of a joint training
        self.train_theta, self.val_theta, self.test_theta = (MeanAngularDifference() for _ in range(3))

    def _start_from(self, weights: str) -> None:
        """Copy the tensors of trained weights.

        Raises:
            WeightsError: If a layer that both have differs in shape, or the weights have layers more.
        """
        state, own = load_network(weights).state_dict(), self.net.state_dict()
        wrong = [name for name in state if name not in own or own[name].shape != state[name].shape]
        if wrong:
            raise WeightsError(
                f"Expected weights of the configured network (got '{weights}' with other {wrong[0]}): "
                "change `model.net`"
            )
        self.net.load_state_dict(state, strict=False)
        fresh = sorted({name.split(".")[0] for name in own.keys() - state.keys()})
        if fresh:
            rank_zero_info(f"Layers that '{weights}' lacks start from new weights: {', '.join(fresh)}")

    def forward(self, batch: Batch) -> Tensor:
        """Filtered normals (F, 3) of a batch of patches."""
        return self.net(batch.normal, batch.edge_index, batch.batch, batch.get("surface"))

    def network_for(self, data_set: str | None = None, levels: Sequence[int] | None = None) -> DNFNet:
        """Copy the network as one data set of a joint training uses it, in evaluation mode.

        Args:
            data_set: Name of the data set, where ``separate_statistics`` keeps those of several; the one used last, if
                not given.
            levels: Nearest faces that each level sees; the network's own if not given.

        Raises:
            ValueError: If there are no statistics of such a data set.
        """
        if data_set is not None and self.statistics is None:
            raise ValueError(f"Expected a data set of 'separate_statistics' (got {data_set!r}, none are kept apart)")
        with self.statistics.use(data_set) if self.statistics and data_set else nullcontext():
            net = DNFNet(**{**self.net.config, "k": list(levels or self.net.k)})
            net.load_state_dict(self.net.state_dict())
        return net.to(self.device).eval()

    def setup(self, stage: str) -> None:
        """Check what only shows beside the data."""
        if self.distillation is not None and stage == "fit":
            parts = getattr(getattr(self.trainer, "datamodule", None), "parts", {})
            self.distillation.check({name: part.data.patches.k for name, part in parts.items()})

    def training_step(self, batch: Batch | dict[str, Batch], batch_idx: int) -> Tensor:
        """Joint loss of one batch, or of one batch of each data set."""
        return self._step(batch, "train", self.train_theta)

    def validation_step(self, batch: Batch | dict[str, Batch], batch_idx: int) -> None:
        """Log ``val/theta`` and ``val/loss``."""
        self._step(batch, "val", self.val_theta)

    def test_step(self, batch: Batch | dict[str, Batch], batch_idx: int) -> None:
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

    def _step(self, batch: Batch | dict[str, Batch], stage: str, theta: MeanAngularDifference) -> Tensor:
        """Weighted loss; several data sets are logged one by one under their names as well."""
        if not isinstance(batch, dict):
            terms = self._log_terms(batch, stage, [theta])
        else:
            parts = []
            for name, part in batch.items():
                key = f"{stage} {name}"
                if key not in self.part_theta:
                    self.part_theta[key] = MeanAngularDifference().to(self.device)
                own_theta = cast("MeanAngularDifference", self.part_theta[key])
                with self.statistics.use(name) if self.statistics else nullcontext():
                    own = self._log_terms(part, stage, [theta, own_theta], name)
                self.log(f"{stage}/{name}/theta", own_theta, metric_attribute=f"part_theta.{key}",
                         batch_size=part.num_graphs, on_step=False, on_epoch=True)  # fmt: skip
                parts.append(LossTerms(*(part.weight * term for term in own)))
            terms = LossTerms(*(torch.stack(term).sum() for term in zip(*parts, strict=True)))
            self._log_all(stage, stage, terms, sum(part.num_graphs for part in batch.values()))
        size = batch.num_graphs if not isinstance(batch, dict) else 1
        self.log(f"{stage}/theta", theta, batch_size=size, on_step=False, on_epoch=True, prog_bar=True)
        return terms.total

    def _log_terms(
        self, batch: Batch, stage: str, thetas: Sequence[MeanAngularDifference], data_set: str | None = None
    ) -> LossTerms:
        stages = self.net.stages(batch.normal, self._edges(batch), batch.batch, batch.get("surface"))
        terms = self.loss(stages, batch.clean_normal, batch.batch)
        if self.distillation is not None and data_set is not None and self.training:
            terms = self.distillation(terms, self.loss, stages, data_set, batch)
        for theta in thetas:
            theta.update(stages[-1][0].detach(), batch.clean_normal)
        self._log_all(stage, stage if data_set is None else f"{stage}/{data_set}", terms, batch.num_graphs)
        return terms

    def _log_all(self, stage: str, place: str, terms: LossTerms, batch_size: int) -> None:
        values = {
            f"{place}/loss": terms.total,
            f"{place}/recovery": terms.recovery,
            f"{place}/residual": terms.residual,
        }
        training = stage == "train"  # a curve over steps; elsewhere one value an epoch
        self.log_dict(values, batch_size=batch_size, on_step=training, on_epoch=not training, sync_dist=not training)

    def _edges(self, batch: Batch) -> Tensor | list[Tensor]:
        """Edges of each level: nearest first, as many as the data set says, some left out while training."""
        levels = getattr(batch, "levels", None) or self.net.k
        finishing = self.train_k_steps is not None and self.global_step >= self.train_k_steps
        keep = levels if self.train_k is None or finishing or not self.training else self.train_k
        if list(keep) == list(self.net.k):
            return batch.edge_index
        pairs = zip(levels, keep, strict=True)
        return [subsample_neighbors(batch.edge_index, k, min(k, fewer)) for k, fewer in pairs]
