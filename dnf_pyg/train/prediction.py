"""Denoise many files with Lightning's ``Trainer.predict``; every process takes a share of them."""

import time
import weakref
from dataclasses import replace
from datetime import timedelta
from pathlib import Path
from typing import NamedTuple

import torch
from lightning.pytorch import LightningModule

from dnf_pyg.errors import DNFError
from dnf_pyg.io import MeshFile, read_mesh, write_mesh
from dnf_pyg.nn import Cascade, FilteringNetwork
from dnf_pyg.options import FilterOptions, UpdateOptions
from dnf_pyg.pipeline import DenoiseResult, denoise
from dnf_pyg.train.processes import leave_at_exit

__all__ = ["DenoisedFile", "FailedFile", "MeshDenoisingModule"]

_PATIENCE = timedelta(days=30)  # how long a process that is done waits for the others; the default is half an hour


class DenoisedFile(NamedTuple):
    """Result of ``predict_step`` for a file that was denoised.

    Attributes:
        mesh: The input.
        result: The denoised mesh.
        output: File that it was written to.
        seconds: Time to read, denoise and write it.
    """

    mesh: MeshFile
    result: DenoiseResult
    output: Path
    seconds: float


class FailedFile(NamedTuple):
    """Result of ``predict_step`` for a file that failed.

    Attributes:
        source: The input.
        reason: The error.
    """

    source: Path
    reason: str


class MeshDenoisingModule(LightningModule):
    """Denoise mesh files; the failure of one is recorded and does not stop the others.

    Args:
        net: The network, or the networks of a cascade.
        filtering: See :func:`~dnf_pyg.denoise`; the device is that of the module.
        update: See :func:`~dnf_pyg.denoise`.
        num_passes: See :func:`~dnf_pyg.denoise`.

    Attributes:
        failures: Reason for each input of this process that failed, by its path.
    """

    def __init__(
        self,
        net: FilteringNetwork | Cascade,
        filtering: FilterOptions = FilterOptions(),
        update: UpdateOptions = UpdateOptions(),
        num_passes: int = 1,
    ) -> None:
        super().__init__()
        leave_at_exit()
        self.net = net
        self.filtering, self.update, self.num_passes = filtering, update, num_passes
        self.failures: dict[str, str] = {}
        self._group: weakref.ref | None = None  # torch holds it until the process leaves

    def setup(self, stage: str) -> None:
        """Prepare to exchange failures at the end, however long the other processes take."""
        if torch.distributed.is_available() and torch.distributed.is_initialized():
            self._group = weakref.ref(torch.distributed.new_group(timeout=_PATIENCE, backend="gloo"))

    def predict_step(self, batch: tuple[Path, Path], batch_idx: int) -> DenoisedFile | FailedFile:
        """Denoise one file into another, which appears whole or not at all."""
        source, output = batch
        start = time.perf_counter()
        try:
            mesh = read_mesh(source)
            filtering = replace(self.filtering, device=str(self.device))
            result = denoise(mesh, self.net, filtering=filtering, update=self.update, num_passes=self.num_passes)
            write_mesh(mesh, result.pos, output)
        except DNFError as error:
            failed = FailedFile(source, str(error))
        except Exception as error:  # a fault of ours, or too little memory, at one of thousands of files
            failed = FailedFile(source, f"{type(error).__name__}: {error}")
        else:
            return DenoisedFile(mesh, result, output, time.perf_counter() - start)
        self.failures[str(source)] = failed.reason
        return failed

    def failures_of_all(self) -> dict[str, str]:
        """Failures of all processes, by path; every process has to call this."""
        group = None if self._group is None else self._group()
        if group is None:
            return dict(self.failures)
        shares: list[dict[str, str]] = [{}] * torch.distributed.get_world_size(group)
        torch.distributed.all_gather_object(shares, self.failures, group=group)
        return {path: reason for share in shares for path, reason in share.items()}
