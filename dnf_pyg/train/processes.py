"""Clean end of the processes of a distributed run."""

import atexit
import gc

import torch

__all__ = ["leave_at_exit"]


def leave_at_exit() -> None:
    """Destroy all process groups before the interpreter exits. Further calls have no effect.

    The threads of a gloo group free the tensors of the last exchange at some later time. If the interpreter is already
    exiting, the process aborts ("terminate called without an active exception", status -6), and the other processes
    fail as well. Destroying a group waits for its threads, unless another object refers to the group, so modules keep
    weak references to theirs. Lightning only destroys the groups of NCCL.

    Source: https://github.com/pytorch/pytorch/issues/190489.
    """
    atexit.unregister(_leave)
    atexit.register(_leave)


def _leave() -> None:
    if torch.distributed.is_available() and torch.distributed.is_initialized():
        gc.collect()  # DDP refers to the group from a reference cycle
        torch.distributed.destroy_process_group()
