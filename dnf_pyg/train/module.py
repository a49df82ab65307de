"""Training of a network that filters facet normals: steps, logging and optimizer."""

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any, Literal, Self, cast

import torch
from lightning.pytorch import LightningModule
from lightning.pytorch.cli import LRSchedulerCallable, OptimizerCallable
from lightning.pytorch.utilities import rank_zero_info
from torch import Tensor
from torch_geometric.data import Batch

from dnf_pyg.errors import DataError, WeightsError
from dnf_pyg.evaluate.metrics import MeanAngularDifference
from dnf_pyg.nn import FilteringNetwork, nearest_edges
from dnf_pyg.nn.config import build_network, check_same_network, describe_network
from dnf_pyg.train.distillation import Distillation
from dnf_pyg.train.losses import JointLoss, LossTerms
from dnf_pyg.train.processes import leave_at_exit
from dnf_pyg.train.settings import PartSettings, Thinning
from dnf_pyg.train.split_statistics import SplitStatistics
from dnf_pyg.weights.load import copy_weights, network_tensors, read_checkpoint

__all__ = ["NormalFilteringModule"]


class NormalFilteringModule(LightningModule):
    """Train a network to filter the facet normals of patches.

    Every checkpoint describes its network (key ``network``), so :func:`~dnf_pyg.weights.load_network` and
    ``load_from_checkpoint`` rebuild it from the file alone.

    Source: Li et al. 2020, Sec. 3.4 and 3.5.

    Args:
        net: The network.
        loss: The training loss; the paper's by default.
        optimizer: Makes the optimizer from the parameters; Adam with a rate of 1e-3 by default.
        scheduler: Makes a learning rate schedule from the optimizer.
        scheduler_interval: Step the schedule once an ``epoch`` or once a ``step``.
        thinning: Train on fewer neighbours; on all of them if not given.
        initial_weights: Weights to start from (see :func:`~dnf_pyg.weights.load_network`). Layers that these weights
            lack keep their random initialization and are named in the log.
        parts: Settings of the data sets of a joint training, by name.
        separate_statistics: Names of data sets that keep running statistics of batch normalization of their own
            (:class:`~dnf_pyg.train.split_statistics.SplitStatistics`); for joint training.
        distillation: Trained teachers, one for each data set of a joint training.

    Raises:
        ValueError: If ``thinning`` or a part has another number of levels than the network.
        DataError: At the start of a run, if the data sets of a joint training do not fit ``parts`` or the teachers.
    """

    def __init__(
        self,
        net: FilteringNetwork,
        loss: JointLoss | None = None,
        optimizer: OptimizerCallable = torch.optim.Adam,
        scheduler: LRSchedulerCallable | None = None,
        scheduler_interval: Literal["epoch", "step"] = "epoch",
        thinning: Thinning | None = None,
        initial_weights: str | None = None,
        parts: Mapping[str, PartSettings] | None = None,
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
        self.thinning = thinning
        self.parts = dict(parts or {})
        for name, settings in {**self.parts, "thinning": thinning}.items():
            k = settings and settings.k
            if k and len(k) != len(net.k):
                raise ValueError(
                    f"Expected 'k' of '{name}' with {len(net.k)} levels (got {k}). Give one for each level."
                )
        if initial_weights is not None:
            kept = ", ".join(copy_weights(initial_weights, net)) or "none"
            rank_zero_info(f"Layers that '{initial_weights}' lacks and that keep their initial values: {kept}")
        self.statistics = SplitStatistics(net, separate_statistics) if separate_statistics else None
        self.distillation = distillation
        self.part_theta = torch.nn.ModuleDict()  # one for each stage and data set of a joint training
        self.train_theta, self.val_theta, self.test_theta = (MeanAngularDifference() for _ in range(3))

    @classmethod
    def load_from_checkpoint(cls, checkpoint_path: str | Path, **arguments: Any) -> Self:  # type: ignore[override]
        """Rebuild the module with its network and its statistics from a checkpoint alone, on the CPU.

        Hyperparameters in the checkpoint are ignored, since Lightning would import and call any class they name.

        Args:
            checkpoint_path: Checkpoint that a training of this module wrote.
            arguments: Constructor arguments other than ``net`` and ``separate_statistics``.

        Raises:
            WeightsError: If the file is damaged, holds code, or is another kind of checkpoint.
        """
        checkpoint = read_checkpoint(checkpoint_path)
        net = build_network(checkpoint["network"], network_tensors(checkpoint), str(checkpoint_path)).train()
        module = cls(net, separate_statistics=checkpoint["statistics"]["names"], **arguments)
        try:
            module.load_state_dict(checkpoint["state_dict"])
        except (RuntimeError, TypeError) as error:
            raise WeightsError(
                f"Expected the state of a {cls.__name__} (got '{checkpoint_path}': "
                f"{str(error).splitlines()[-1].strip()}). Give a checkpoint that a training of this module wrote."
            ) from error
        return module

    def forward(self, batch: Batch) -> Tensor:
        """Filter the normals (F, 3) of a batch of patches."""
        return self.net(**self.net.gather(batch))

    def network_for(self, data_set: str | None = None, k: Sequence[int] | None = None) -> FilteringNetwork:
        """Copy the network as one data set of a joint training uses it, in evaluation mode.

        Args:
            data_set: Name of the data set; without it, the network as it is.
            k: Neighbours per face on each level; those of the data set or of the network if not given.

        Raises:
            ValueError: If neither ``parts`` nor ``separate_statistics`` has such a data set.
        """
        known = {*self.parts, *(self.statistics.names if self.statistics else [])}
        if data_set is not None and data_set not in known:
            raise ValueError(f"Expected 'data_set' to be one of {sorted(known)} (got {data_set!r}). Change it.")
        k = k or self._settings(data_set).k or self.net.k
        with self._using(data_set):
            net = type(self.net)(**{**self.net.arguments, "k": list(k)})
            net.load_state_dict(self.net.state_dict())
        net.noise_range, net.random_rotation = self.net.noise_range, self.net.random_rotation
        return net.to(self.device).eval()

    def setup(self, stage: str) -> None:
        """Check the data sets of a joint training, and note in the network whether patches are rotated at random."""
        data = getattr(self.trainer, "datamodule", None)
        data_sets = getattr(data, "parts", {})
        unknown = sorted(self.parts.keys() - data_sets.keys())
        if data is not None and unknown:
            raise DataError(
                f"Expected 'parts' of the data sets {sorted(data_sets)} (got {unknown}). Use the names in `data.parts`."
            )
        for name, data_set in data_sets.items():
            data_set.check_neighbors(max(self._settings(name).k or self.net.k))
        if stage == "fit":
            loaders = [getattr(part, "loader", None) for part in data_sets.values() or [data]]
            self.net.random_rotation = all(getattr(loader, "rotate", False) for loader in loaders)
        if self.distillation is not None and stage == "fit":
            self.distillation.check({name: data_set.patches.k for name, data_set in data_sets.items()})

    def training_step(self, batch: Batch | dict[str, Batch], batch_idx: int) -> Tensor:
        """Joint loss of one batch, or of one batch of each data set."""
        return self._step(batch, "train", self.train_theta)

    def validation_step(self, batch: Batch | dict[str, Batch], batch_idx: int) -> None:
        """Log ``val/theta`` and ``val/loss``."""
        self._step(batch, "val", self.val_theta)

    def test_step(self, batch: Batch | dict[str, Batch], batch_idx: int) -> None:
        """Log ``test/theta`` and ``test/loss``."""
        self._step(batch, "test", self.test_theta)

    def predict_step(self, batch: Any, batch_idx: int, dataloader_idx: int = 0) -> Tensor | dict[str, Tensor]:
        """Filtered normals (F, 3) of a batch of patches, or of one batch of each data set."""
        if not isinstance(batch, dict):
            return self(batch)
        found = {}
        for name, part in batch.items():
            with self._using(name):
                found[name] = self.net(**self.net.gather(part, self._edges(part, name)))
        return found

    def configure_optimizers(self) -> Any:
        """Optimizer and, if one is configured, its schedule."""
        optimizer = self.optimizer(self.net.parameters())
        if self.scheduler is None:
            return optimizer
        schedule = {"scheduler": self.scheduler(optimizer), "interval": self.scheduler_interval}
        return {"optimizer": optimizer, "lr_scheduler": schedule}

    def on_save_checkpoint(self, checkpoint: dict[str, Any]) -> None:
        """Store what rebuilds the network."""
        checkpoint["network"] = describe_network(self.net)
        if self.statistics is not None:
            checkpoint["statistics"] = {"names": self.statistics.names, "tensors": self.statistics.tensors}

    def on_load_checkpoint(self, checkpoint: dict[str, Any]) -> None:
        """Refuse the checkpoint of a network of another class or with other arguments."""
        check_same_network(checkpoint.get("network"), self.net, "the checkpoint")

    def _settings(self, data_set: str | None) -> PartSettings:
        return self.parts.get(data_set or "", PartSettings())

    def _using(self, data_set: str | None) -> AbstractContextManager:
        """Statistics of batch normalization of a data set, where they are kept apart."""
        return self.statistics.use(data_set) if self.statistics is not None and data_set else nullcontext()

    def _step(self, batch: Batch | dict[str, Batch], stage: str, theta: MeanAngularDifference) -> Tensor:
        """Weighted loss; that of several data sets is logged by their names as well."""
        if not isinstance(batch, dict):
            terms = self._log_terms(batch, stage, [theta])
        else:
            parts = []
            for name, part in batch.items():
                key = f"{stage} {name}"
                if key not in self.part_theta:
                    self.part_theta[key] = MeanAngularDifference().to(self.device)
                own_theta = cast("MeanAngularDifference", self.part_theta[key])
                with self._using(name):
                    own = self._log_terms(part, stage, [theta, own_theta], name)
                self.log(f"{stage}/{name}/theta", own_theta, metric_attribute=f"part_theta.{key}",
                         batch_size=part.num_graphs, on_step=False, on_epoch=True)  # fmt: skip
                parts.append(LossTerms(*(self._settings(name).weight * term for term in own)))
            terms = LossTerms(*(torch.stack(term).sum() for term in zip(*parts, strict=True)))
            self._log_all(stage, stage, terms, sum(part.num_graphs for part in batch.values()))
        size = batch.num_graphs if not isinstance(batch, dict) else 1
        self.log(f"{stage}/theta", theta, batch_size=size, on_step=False, on_epoch=True, prog_bar=True)
        return terms.total

    def _log_terms(
        self, batch: Batch, stage: str, thetas: Sequence[MeanAngularDifference], data_set: str | None = None
    ) -> LossTerms:
        stages = self.net.stages(**self.net.gather(batch, self._edges(batch, data_set)))
        terms = self.loss(stages, batch.y, batch.batch)
        if self.distillation is not None and data_set is not None and self.training:
            terms = self.distillation(terms, self.loss, stages, data_set, batch)
        for theta in thetas:
            theta.update(stages[-1][0].detach(), batch.y)
        self._log_all(stage, stage if data_set is None else f"{stage}/{data_set}", terms, batch.num_graphs)
        return terms

    def _log_all(self, stage: str, place: str, terms: LossTerms, batch_size: int) -> None:
        values = {f"{place}/{name}": term for name, term in zip(("loss", "recovery", "residual"), terms, strict=True)}
        training = stage == "train"  # a curve over steps; elsewhere one value an epoch
        self.log_dict(values, batch_size=batch_size, on_step=training, on_epoch=not training, sync_dist=not training)

    def _edges(self, batch: Batch, data_set: str | None = None) -> list[Tensor] | None:
        """Edges of each level; ``None`` where the network is to select its own."""
        k = self._settings(data_set).k
        if self.thinning is not None and self.training and self.thinning.applies(self.global_step):
            return self.thinning.choose(batch.edge_index, batch.edge_attr, k or self.net.k)
        return None if k is None else [nearest_edges(batch.edge_index, batch.edge_attr, level) for level in k]
